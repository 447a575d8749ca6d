/* Files of keys: read as a list and as a single key. A key that is taken has a text from which it is read again. */
#include <sys/stat.h>
#include <unistd.h>

#include "tests/fuzz/fuzz.h"
#include "wire/key_file.h"

static char path[] = "/tmp/weft-fuzz-XXXXXX";

static void remove_file(void)
{
    unlink(path);
}

static void write_file(const void *data, size_t size)
{
    static int file = -1;
    if (file < 0) {
        file = mkstemp(path); /* mode 0600 */
        require(file >= 0);
        atexit(remove_file);
    }
    require(ftruncate(file, 0) == 0 && pwrite(file, data, size, 0) == (ssize_t)size);
}

static void try_single(size_t listed)
{
    struct key key = {{0}}, again;
    struct error error = {{0}};
    char text[KEY_TEXT_BYTES];
    enum status status = key_file_read(&key, path, KEY_SECRET, &error);
    require((status == STATUS_OK) == (listed == 1));
    if (status != STATUS_OK) {
        require_refusal(status, &error);
        return;
    }
    key_text(&key, text);
    write_file(text, strlen(text));
    require(key_file_read(&again, path, KEY_SECRET, &error) == STATUS_OK);
    require(memcmp(&again, &key, sizeof key) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct key_list list = {0};
    struct error error = {{0}};
    write_file(data, size);
    enum status status = key_list_read(&list, path, &error);
    if (status != STATUS_OK) {
        require_refusal(status, &error);
        require(list.count == 0 && !list.keys);
    }
    for (size_t i = 0; i < list.count; i++)
        require(key_list_has(&list, &list.keys[i]));
    try_single(status == STATUS_OK ? list.count : 0);
    key_list_finish(&list);
    return 0;
}
