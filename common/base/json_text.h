/*
 * Members of JSON objects, appended to text (base/text.h).
 */
#ifndef WEFT_BASE_JSON_TEXT_H
#define WEFT_BASE_JSON_TEXT_H

#include "base/bytes.h"

/* "key":"value". Valid UTF-8 whatever the value holds: U+FFFD stands for each byte that is not. */
void json_text_string(struct bytes *text, const char *key, const char *value);

/* "key":value, with so many decimals; null for what is not finite, which JSON has no way to write. */
void json_text_number(struct bytes *text, const char *key, double value, int decimals);

#endif
