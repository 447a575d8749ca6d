#include "base/json_text.h"

#include <math.h>

#include "base/text.h"

void json_text_string(struct bytes *text, const char *key, const char *value)
{
    text_put(text, "\"%s\":\"", key);
    for (uint32_t code; (code = text_next(&value));) {
        if (code < 0x20 || code == 0x7F)
            text_put(text, "\\u%04x", (unsigned)code);
        else if (code == '"' || code == '\\')
            text_put(text, "\\%c", (char)code);
        else
            text_put_code(text, code);
    }
    text_put(text, "\"");
}

void json_text_number(struct bytes *text, const char *key, double value, int decimals)
{
    if (isfinite(value))
        text_put(text, "\"%s\":%.*f", key, decimals, value);
    else
        text_put(text, "\"%s\":null", key);
}
