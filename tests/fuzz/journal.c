/*
 * Journals that are broken. The first byte says how: '0', the file is what follows; '1', it is a head and what follows;
 * else it is a good one of BANDS bands, and what follows are places in it (u16) and what is added to the bytes there.
 * Whatever comes of it can be gone on from: a band added behind is found again, as are those that were found before it.
 */
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "coordinator/journal.h"
#include "tests/fuzz/fuzz.h"

enum { BANDS = 3, BAND_BYTES = 40, HEAD_BYTES = 108, FILE_BYTES_MAX = 1 << 16 };

static const struct journal_key key = {{{1}}, {{2}}, {{3}}};
static char output[64], path[80];
static uint8_t good[FILE_BYTES_MAX]; /* a journal of BANDS bands */
static size_t good_size;

static struct journal *open_journal(void)
{
    struct error error;
    enum status status;
    struct journal *journal = journal_open(output, &key, true, &status, &error);
    require(journal);
    return journal;
}

static void add_band(struct journal *journal, uint32_t number)
{
    struct journal_band band = {.pass = PASS_RENDER, .first_row = number, .rows = 1, .size = BAND_BYTES};
    uint8_t data[BAND_BYTES];
    struct error error;
    memset(data, (int)number, sizeof data);
    require(journal_add(journal, &band, data, &error) == STATUS_OK);
}

/* Counts the bands that are found; those of a good journal are as they were added. */
static uint32_t count_bands(struct journal *journal, bool is_good)
{
    struct journal_band band;
    struct bytes data = {0};
    uint32_t count = 0;
    for (; journal_next(journal, &band, &data); count++)
        if (is_good)
            require(band.first_row == count && data.size == BAND_BYTES && data.data[0] == (uint8_t)count);
    bytes_finish(&data);
    return count;
}

static void remove_files(void)
{
    unlink(path);
    *strrchr(output, '/') = '\0';
    rmdir(output);
}

static void begin(void)
{
    snprintf(output, sizeof output, "/tmp/weft-fuzz-XXXXXX");
    require(mkdtemp(output));
    strcat(output, "/out.png");
    snprintf(path, sizeof path, "%.*s/.out.png.journal", (int)(strrchr(output, '/') - output), output);
    atexit(remove_files);
    log_start("journal", LOG_SILENT);
    struct journal *journal = open_journal();
    for (uint32_t i = 0; i < BANDS; i++)
        add_band(journal, i);
    journal_close(&journal, false);
    struct bytes file = {0};
    struct error error;
    require(bytes_read_file(&file, path, sizeof good, &error) == STATUS_OK);
    good_size = file.size;
    memcpy(good, file.data, file.size);
    bytes_finish(&file);
}

static void write_file(const uint8_t *head, size_t head_size, const uint8_t *rest, size_t rest_size)
{
    int file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    require(file >= 0 && write(file, head, head_size) == (ssize_t)head_size);
    require(write(file, rest, rest_size) == (ssize_t)rest_size);
    close(file);
}

static void write_changed(const uint8_t *changes, size_t size)
{
    uint8_t changed[FILE_BYTES_MAX];
    memcpy(changed, good, good_size);
    for (size_t i = 0; i + 2 < size; i += 3)
        changed[(changes[i] | changes[i + 1] << 8) % good_size] += changes[i + 2];
    write_file(changed, good_size, changes, 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (good_size == 0)
        begin();
    if (size == 0 || size > FILE_BYTES_MAX)
        return 0;
    bool is_good = data[0] != '0' && data[0] != '1';
    if (is_good)
        write_changed(data + 1, size - 1);
    else
        write_file(good, data[0] == '1' ? HEAD_BYTES : 0, data + 1, size - 1);
    struct journal *journal = open_journal();
    uint32_t count = count_bands(journal, is_good);
    add_band(journal, count);
    journal_close(&journal, false);
    journal = open_journal();
    require(count_bands(journal, is_good) == count + 1);
    journal_close(&journal, true);
    require(access(path, F_OK) != 0);
    return 0;
}
