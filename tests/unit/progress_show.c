/* When progress is shown, and what a terminal makes of it. */
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/log.h"
#include "base/text.h"
#include "coordinator/progress.h"
#include "tests/unit/progress_help.h"

/* --- when something is shown ------------------------------------------------------------------------------ */

static size_t file_lines(FILE *file)
{
    size_t lines = 0;
    rewind(file);
    for (int c; (c = getc(file)) != EOF;)
        lines += c == '\n';
    fseek(file, 0, SEEK_END);
    return lines;
}

static void test_json_times(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 2, 1);
    FILE *file = tmpfile();
    struct progress *progress = progress_create(PROGRESS_JSON, file);
    assert_int_equal(progress_wait_ms(progress, 1000), 0);
    progress_update(progress, &farm.snapshot, 1000);
    assert_int_equal(progress_wait_ms(progress, 1000), 250);
    progress_update(progress, &farm.snapshot, 1249);
    assert_int_equal(file_lines(file), 1);
    progress_update(progress, &farm.snapshot, 1250);
    assert_int_equal(file_lines(file), 2);
    farm.jobs[0].state = JOB_DONE;
    progress_update(progress, &farm.snapshot, 1260);
    assert_int_equal(file_lines(file), 3);
    progress_finish(progress, &farm.snapshot, 1270);
    assert_int_equal(file_lines(file), 4);
    progress_update(progress, &farm.snapshot, 9999);
    assert_int_equal(file_lines(file), 4);
    assert_int_equal(progress_wait_ms(progress, 9999), -1);
    progress_destroy(&progress);
    assert_null(progress);
    progress_destroy(&progress);
    fclose(file);
}

static void test_line_times(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 1);
    FILE *file = tmpfile();
    struct progress *progress = progress_create(PROGRESS_LINES, file);
    for (int64_t now = 0; now <= 10000; now += 100)
        progress_update(progress, &farm.snapshot, now);
    progress_finish(progress, &farm.snapshot, 10001);
    assert_int_equal(file_lines(file), 2);
    progress_destroy(&progress);
    fclose(file);
}

static void test_none_shows_nothing(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 1);
    FILE *file = tmpfile();
    struct progress *progress = progress_create(PROGRESS_NONE, file);
    assert_int_equal(progress_wait_ms(progress, 0), -1);
    progress_update(progress, &farm.snapshot, 0);
    progress_finish(progress, &farm.snapshot, 1);
    progress_destroy(&progress);
    assert_int_equal(file_lines(file), 0);
    fclose(file);
}

/* --- a terminal ------------------------------------------------------------------------------------------- */

enum { SCREEN_ROWS = 12, SCREEN_COLUMNS = 60 };

/* A pseudo-terminal and what a person would see on it. Cells hold ASCII; any other character is shown as '*'.
 * It knows just what progress.c sends, and fails on anything else. */
struct screen {
    int master;
    FILE *terminal;
    int old_stderr;
    char cells[SCREEN_ROWS][SCREEN_COLUMNS + 1];
    size_t row, column;
};

static void screen_erase(struct screen *screen, size_t row, size_t column)
{
    memset(screen->cells[row] + column, ' ', SCREEN_COLUMNS - column);
}

static void screen_resize(struct screen *screen, unsigned short columns)
{
    struct winsize size = {.ws_row = SCREEN_ROWS, .ws_col = columns};
    assert_int_equal(ioctl(screen->master, TIOCSWINSZ, &size), 0);
}

/* Standard error goes there too, where the log writes. */
static void screen_init(struct screen *screen)
{
    memset(screen, 0, sizeof *screen);
    for (size_t row = 0; row < SCREEN_ROWS; row++)
        screen_erase(screen, row, 0);
    screen->master = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(screen->master >= 0);
    assert_int_equal(grantpt(screen->master) | unlockpt(screen->master), 0);
    int fd = open(ptsname(screen->master), O_RDWR | O_NOCTTY);
    assert_true(fd >= 0);
    screen->terminal = fdopen(fd, "w");
    screen->old_stderr = dup(STDERR_FILENO);
    dup2(fd, STDERR_FILENO);
    screen_resize(screen, SCREEN_COLUMNS);
}

static void screen_finish(struct screen *screen)
{
    dup2(screen->old_stderr, STDERR_FILENO);
    close(screen->old_stderr);
    fclose(screen->terminal);
    close(screen->master);
}

static void screen_newline(struct screen *screen)
{
    if (++screen->row < SCREEN_ROWS)
        return;
    screen->row = SCREEN_ROWS - 1;
    memmove(screen->cells[0], screen->cells[1], sizeof screen->cells - sizeof screen->cells[0]);
    screen_erase(screen, screen->row, 0);
}

/* Obeys the sequence behind ESC and returns what follows it. */
static const char *screen_obey(struct screen *screen, const char *at)
{
    char *end;
    assert_int_equal(*at, '[');
    size_t count = strtoul(at + 1, &end, 10);
    if (*end == 'A') {
        assert_in_range(count, 1, screen->row);
        screen->row -= count;
        return end + 1;
    }
    assert_true(*end == 'K' || *end == 'J');
    screen_erase(screen, screen->row, screen->column);
    for (size_t row = screen->row + 1; *end == 'J' && row < SCREEN_ROWS; row++)
        screen_erase(screen, row, 0);
    return end + 1;
}

static void screen_put(struct screen *screen, uint32_t code)
{
    for (size_t i = 0; i < text_code_columns(code); i++) {
        assert_in_range(screen->column, 0, SCREEN_COLUMNS - 2); /* the last column would wrap */
        screen->cells[screen->row][screen->column++] = code < 0x80 ? (char)code : '*';
    }
}

/* All that was written since the last call, into text[capacity]. What one end of a terminal writes reaches the
 * other some time later, so a bell marks its end. */
static void screen_receive(struct screen *screen, char *text, size_t capacity)
{
    size_t size = 0;
    assert_int_equal(write(fileno(screen->terminal), "\a", 1), 1);
    do {
        ssize_t more = read(screen->master, text + size, capacity - size);
        assert_true(more > 0);
        size += (size_t)more;
    } while (text[size - 1] != '\a');
    text[size - 1] = '\0';
}

/* Takes in what was written since the last call. */
static void screen_read(struct screen *screen)
{
    static char text[65536];
    screen_receive(screen, text, sizeof text);
    const char *at = text;
    for (uint32_t code; (code = text_next(&at));) {
        if (code == '\033')
            at = screen_obey(screen, at);
        else if (code == '\r')
            screen->column = 0;
        else if (code == '\n')
            screen_newline(screen);
        else
            screen_put(screen, code);
    }
}

static void assert_row(const struct screen *screen, size_t row, const char *start)
{
    if (!*start)
        assert_int_equal(strspn(screen->cells[row], " "), SCREEN_COLUMNS);
    else if (strncmp(screen->cells[row], start, strlen(start)) != 0)
        fail_msg("row %zu: expected \"%s\", found \"%s\"", row, start, screen->cells[row]);
}

static void assert_blank_from(const struct screen *screen, size_t row)
{
    assert_int_equal(screen->row, row);
    assert_int_equal(screen->column, 0);
    for (; row < SCREEN_ROWS; row++)
        assert_row(screen, row, "");
}

static void test_block_is_redrawn_in_place(void **state)
{
    (void)state;
    struct farm farm;
    struct screen screen;
    farm_init(&farm, 1, 3);
    screen_init(&screen);
    struct progress *progress = progress_create(PROGRESS_BAR, screen.terminal);
    progress_update(progress, &farm.snapshot, 0);
    screen_read(&screen);
    assert_row(&screen, 0, "showcase.json * showcase.png  1920 * 1080, 16 samples");
    assert_row(&screen, 5, "  3  ");
    assert_blank_from(&screen, 6);
    assert_int_equal(progress_wait_ms(progress, 0), 100);
    farm.snapshot.worker_count = 1;
    farm.jobs[0].scene = "b.json";
    progress_update(progress, &farm.snapshot, 99); /* too early */
    screen_read(&screen);
    assert_row(&screen, 5, "  3  ");
    progress_update(progress, &farm.snapshot, 100);
    screen_read(&screen);
    assert_row(&screen, 0, "b.json * showcase.png  1920 * 1080, 16 samples       ");
    assert_blank_from(&screen, 4);
    progress_finish(progress, &farm.snapshot, 110);
    screen_read(&screen);
    assert_blank_from(&screen, 0);
    progress_destroy(&progress);
    screen_finish(&screen);
}

static void test_log_scrolls_above(void **state)
{
    (void)state;
    struct farm farm;
    struct screen screen;
    farm_init(&farm, 1, 2);
    screen_init(&screen);
    struct progress *progress = progress_create(PROGRESS_BAR, screen.terminal);
    log_warning("before");
    progress_update(progress, &farm.snapshot, 0);
    log_warning("first");
    log_warning("second");
    screen_read(&screen);
    assert_row(&screen, 0, "weft: warning: before");
    assert_row(&screen, 2, "weft: warning: second ");
    assert_row(&screen, 3, "showcase.json");
    assert_blank_from(&screen, 8);
    for (int i = 0; i < 10; i++)
        log_warning("line %d", i);
    progress_update(progress, &farm.snapshot, 100);
    screen_read(&screen);
    assert_row(&screen, 5, "weft: warning: line 9 ");
    assert_row(&screen, 6, "showcase.json");
    assert_row(&screen, 10, "  2  ");
    progress_destroy(&progress); /* as after an interrupt, without a last snapshot */
    log_warning("after");
    screen_read(&screen);
    assert_row(&screen, 6, "weft: warning: after ");
    assert_blank_from(&screen, 7);
    screen_finish(&screen);
}

/* What a terminal that becomes narrower does to the block: rows are split, and the cursor goes down. */
static size_t screen_wrap(struct screen *screen, size_t columns)
{
    size_t more = 0;
    for (size_t row = 0; row < screen->row; row++) {
        size_t used = SCREEN_COLUMNS;
        while (used && screen->cells[row][used - 1] == ' ')
            used--;
        more += used ? (used - 1) / columns : 0;
    }
    screen->row += more;
    assert_in_range(screen->row, 0, SCREEN_ROWS - 1);
    return more;
}

static void test_narrowing_leaves_no_junk(void **state)
{
    (void)state;
    struct farm farm;
    struct screen screen;
    farm_init(&farm, 1, 3);
    screen_init(&screen);
    struct progress *progress = progress_create(PROGRESS_BAR, screen.terminal);
    log_warning("kept");
    progress_update(progress, &farm.snapshot, 0);
    screen_read(&screen);
    screen_resize(&screen, 50);
    assert_int_equal(screen_wrap(&screen, 50), 3); /* the title, the strip and the figures */
    progress_disturb(progress, false);
    assert_int_equal(progress_wait_ms(progress, 1), 0);
    progress_update(progress, &farm.snapshot, 1);
    screen_read(&screen);
    assert_row(&screen, 0, "weft: warning: kept");
    assert_row(&screen, 1, "showcase.json");
    assert_blank_from(&screen, 7);
    progress_destroy(&progress);
    screen_read(&screen);
    assert_blank_from(&screen, 1);
    screen_finish(&screen);
}

/* A shell, say, has written below the block while we were stopped: that stays, and so does the block. */
static void test_being_stopped(void **state)
{
    (void)state;
    struct farm farm;
    struct screen screen;
    farm_init(&farm, 1, 0);
    screen_init(&screen);
    struct progress *progress = progress_create(PROGRESS_BAR, screen.terminal);
    progress_update(progress, &farm.snapshot, 0);
    assert_int_equal(write(fileno(screen.terminal), "$ fg\r\n", 6), 6);
    progress_disturb(progress, true);
    progress_update(progress, &farm.snapshot, 1);
    screen_read(&screen);
    assert_row(&screen, 0, "showcase.json");
    assert_row(&screen, 3, "no worker yet");
    assert_row(&screen, 4, "$ fg");
    assert_row(&screen, 5, "showcase.json");
    assert_blank_from(&screen, 9);
    progress_destroy(&progress);
    screen_read(&screen);
    assert_blank_from(&screen, 5);
    screen_finish(&screen);
}

static void test_auto_mode(void **state)
{
    (void)state;
    struct screen screen;
    screen_init(&screen);
    FILE *file = tmpfile();
    setenv("TERM", "xterm", 1);
    assert_int_equal(progress_mode_auto(screen.terminal), PROGRESS_BAR);
    assert_int_equal(progress_mode_auto(file), PROGRESS_LINES);
    setenv("TERM", "dumb", 1);
    assert_int_equal(progress_mode_auto(screen.terminal), PROGRESS_LINES);
    unsetenv("TERM");
    assert_int_equal(progress_mode_auto(screen.terminal), PROGRESS_LINES);
    fclose(file);
    screen_finish(&screen);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_json_times),
        cmocka_unit_test(test_line_times),
        cmocka_unit_test(test_none_shows_nothing),
        cmocka_unit_test(test_block_is_redrawn_in_place),
        cmocka_unit_test(test_log_scrolls_above),
        cmocka_unit_test(test_narrowing_leaves_no_junk),
        cmocka_unit_test(test_being_stopped),
        cmocka_unit_test(test_auto_mode),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
