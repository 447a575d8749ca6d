/* Snapshots as JSON. What is taken is written as what is read again as the same, and can be shown. */
#include <stdlib.h>

#include "coordinator/progress_views.h"
#include "coordinator/snapshot_json.h"
#include "tests/fuzz/fuzz.h"

static void show(const struct snapshot *snapshot)
{
    static const size_t columns[] = {1, 2, 20, 80, 400};
    struct bytes text = {0};
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++)
        progress_block(&text, snapshot, columns[i], 10 * i);
    progress_line(&text, snapshot);
    for (size_t i = 0; i < text.size; i++)
        require(text.data[i] >= ' ' || text.data[i] == '\n');
    bytes_finish(&text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct error error = {{0}};
    struct bytes first = {0}, second = {0};
    struct snapshot *copy = snapshot_read_json((const char *)data, size, &error);
    if (!copy) {
        require_refusal(STATUS_INPUT, &error);
        return 0;
    }
    show(copy);
    snapshot_write_json(&first, copy);
    struct snapshot *again = snapshot_read_json((const char *)first.data, first.size, &error);
    require(again);
    snapshot_write_json(&second, again);
    require(first.size == second.size && memcmp(first.data, second.data, first.size) == 0);
    bytes_finish(&first);
    bytes_finish(&second);
    free(copy);
    free(again);
    return 0;
}
