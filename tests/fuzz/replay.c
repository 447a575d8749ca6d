/*
 * Puts files through a fuzz target, one after the other: those named, or all of the target's corpus. The target is
 * this program's own name. TAP on standard output; each file is named before it is tried, so that one which ends the
 * program is known.
 */
#include <dirent.h>
#include <errno.h>
#include <unistd.h>

#include "base/bytes.h"
#include "base/memory.h"
#include "tests/fuzz/fuzz.h"

enum { SECONDS_MAX = 120 }; /* for a file that takes milliseconds: one that hangs ends the program by SIGALRM */

static void replay(const char *path, int number)
{
    struct bytes file = {0};
    struct error error;
    printf("# %s\n", path);
    fflush(stdout);
    if (bytes_read_file(&file, path, SIZE_MAX, &error) != STATUS_OK) {
        printf("not ok %d - %s\n", number, error.text);
        return;
    }
    uint8_t *exact = memory_array(file.size, 1); /* so that reading on is noticed */
    memcpy(exact, file.data, file.size);
    alarm(SECONDS_MAX);
    LLVMFuzzerTestOneInput(exact, file.size);
    alarm(0);
    printf("ok %d - %s\n", number, path);
    free(exact);
    bytes_finish(&file);
}

static int is_visible(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

static void replay_folder(const char *folder)
{
    struct dirent **entries;
    int count = scandir(folder, &entries, is_visible, alphasort);
    if (count <= 0) {
        printf("Bail out! %s: %s\n", folder, count < 0 ? strerror(errno) : "expected files, found none");
        exit(1);
    }
    printf("1..%d\n", count);
    for (int i = 0; i < count; i++) {
        char *path = memory_format("%s/%s", folder, entries[i]->d_name);
        replay(path, i + 1);
        free(path);
        free(entries[i]);
    }
    free(entries);
}

int main(int argc, char **argv)
{
    if (argc > 1) {
        printf("1..%d\n", argc - 1);
        for (int i = 1; i < argc; i++)
            replay(argv[i], i);
        return 0;
    }
    const char *name = program_invocation_short_name;
    char *folder = memory_format("tests/fuzz/corpus/%.*s", (int)strcspn(name, "."), name);
    replay_folder(folder);
    free(folder);
    return 0;
}
