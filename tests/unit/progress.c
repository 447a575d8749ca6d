/* The views of a snapshot for people: their layout at every size of terminal. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/text.h"
#include "coordinator/progress_views.h"
#include "tests/unit/progress_help.h"

static size_t widest_line(const char *text)
{
    size_t widest = 0, used = 0;
    for (uint32_t code; (code = text_next(&text));) {
        used = code == '\n' ? 0 : used + text_code_columns(code);
        widest = used > widest ? used : widest;
    }
    return widest;
}

/* The block as a string that the next call frees. */
static const char *block_of(const struct farm *farm, size_t columns, size_t rows)
{
    static struct bytes text;
    bytes_finish(&text);
    progress_block(&text, &farm->snapshot, columns, rows);
    return (const char *)text.data;
}

static const char *line_of(const struct farm *farm)
{
    static struct bytes text;
    bytes_finish(&text);
    progress_line(&text, &farm->snapshot);
    return (const char *)text.data;
}

static void assert_holds(const char *text, const char *part)
{
    if (!strstr(text, part))
        fail_msg("expected \"%s\" in:\n%s", part, text);
}

static void assert_lacks(const char *text, const char *part)
{
    if (strstr(text, part))
        fail_msg("did not expect \"%s\" in:\n%s", part, text);
}

/* --- layout ----------------------------------------------------------------------------------------------- */

static void test_block_fits_every_size(void **state)
{
    (void)state;
    static const size_t workers[] = {0, 1, 5, WORKERS};
    struct farm farm;
    for (size_t i = 0; i < sizeof workers / sizeof *workers; i++) {
        farm_init(&farm, 3, workers[i]);
        for (size_t columns = 1; columns <= 200; columns++) {
            for (size_t rows = 1; rows <= 50; rows += 7) {
                const char *text = block_of(&farm, columns, rows);
                assert_true(widest_line(text) < columns);
                assert_true(count_lines(text) <= (rows > 2 ? rows - 2 : 0));
            }
        }
    }
}

static void test_block_in_full(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 3);
    farm.workers[2].trouble = TROUBLE_LOST;
    assert_string_equal(block_of(&farm, 85, 24),
                        "showcase.json → showcase.png  1920 × 1080, 16 samples\n"
                        "█████████████████████████████████11111████bbbbb"
                        "░░░░░░░░░░░░░░░░░░░░░░░░░░░░░░░░░░░░░\n"
                        " 45 %   0:12   0:15 left   3.1 M rays/s  RMSE 0.00471\n"
                        "  1  localhost    1 thread   avx512     1 band   12.3 M rays/s  working\n"
                        "  2  münchen      2 threads  avx2       2 bands  12.3 M rays/s  idle\n"
                        "  3  計算機-01    3 threads  avx512     3 bands  12.3 M rays/s  working, was lost\n");
}

static void test_block_narrow(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 3);
    assert_string_equal(block_of(&farm, 21, 24), "showcase… → showcas…\n"
                                                 "████████1█b░░░░░░░░░\n"
                                                 " 45 %   0:12\n"
                                                 "  1  loca…  working\n"
                                                 "  2  münc…  idle\n"
                                                 "  3  計算…  working\n");
}

static void test_many_workers_are_capped(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, WORKERS);
    const char *text = block_of(&farm, 80, 12);
    assert_int_equal(count_lines(text), 10);
    assert_holds(text, "\n  6  ");
    assert_holds(text, "\n… and 94 more\n");
    assert_holds(block_of(&farm, 80, WORKERS + 5), "\n100+ ");
    assert_holds(block_of(&farm, 80, WORKERS + 5), "\n 11b ");

    farm.workers[0].state = WORKER_GONE;
    farm.workers[0].trouble = TROUBLE_STUCK;
    text = block_of(&farm, 80, 12);
    assert_lacks(text, "\n  1  ");
    assert_holds(text, "\n  7  ");
    assert_holds(text, "\n… and 93 more, 1 gone\n");
    assert_holds(block_of(&farm, 80, WORKERS + 5), "gone: stuck\n");
    farm.snapshot.refused = 2;
    assert_holds(block_of(&farm, 80, 12), "\n… and 93 more, 1 gone, 2 refused\n");
    assert_holds(block_of(&farm, 80, WORKERS + 6), "\n… 2 refused\n");
}

static void test_no_worker(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 0);
    farm.jobs[0] = job_of("a.json", "a.png", JOB_WAITING, 0);
    const char *text = block_of(&farm, 80, 24);
    assert_holds(text, "\nno worker yet\n");
    assert_holds(text, "0:13     waiting"); /* the command's own time: the job's does not run yet */
    farm.snapshot.refused = 1;
    assert_holds(block_of(&farm, 80, 24), "\nno worker yet, 1 refused\n");
}

static void test_an_error_asked_for(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 1);
    farm.jobs[0].error = 0.0025;
    farm.jobs[0].samples = 4.0625;
    assert_holds(block_of(&farm, 85, 24), "  1920 × 1080, error 0.0025, 4.1 samples\n");
    farm.jobs[0].state = JOB_SURVEYING;
    farm.jobs[0].samples = 0;
    farm.jobs[0].rows_done = 0;
    assert_holds(block_of(&farm, 85, 24), "  1920 × 1080, error 0.0025\n");
    farm.jobs[0].rmse = NAN;
    assert_holds(block_of(&farm, 85, 24), "\n  0 %   0:12   surveying   3.1 M rays/s\n");
    assert_string_equal(line_of(&farm), "weft: showcase.json: surveying, 12 s elapsed, 3.1 M rays/s, 1 worker\n");
}

static void test_several_jobs(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 5, 1);
    assert_holds(block_of(&farm, 80, 24), "1 of 5  showcase.json");
    farm.jobs[0].state = JOB_DONE;
    farm.jobs[1] = job_of("second.json", "out/second.png", JOB_RUNNING, 270);
    const char *text = block_of(&farm, 80, 24);
    assert_holds(text, "2 of 5  second.json → out/second.png");
    assert_holds(text, " 25 %");
    assert_holds(line_of(&farm), "weft: second.json (2 of 5): 25 %, ");
    for (size_t i = 0; i < 5; i++)
        farm.jobs[i].state = JOB_DONE;
    assert_holds(block_of(&farm, 80, 24), "5 of 5  ");
}

static void test_no_jobs(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 0, 1);
    assert_string_equal(block_of(&farm, 80, 24), "");
    assert_string_equal(line_of(&farm), "");
}

static void test_percent_is_100_only_when_done(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 1);
    for (farm.jobs[0].rows_done = 0; farm.jobs[0].rows_done <= 1080; farm.jobs[0].rows_done++) {
        char want[16];
        unsigned percent = farm.jobs[0].rows_done * 100 / 1080;
        snprintf(want, sizeof want, "%3u %%", percent < 99 ? percent : 99);
        assert_holds(block_of(&farm, 80, 24), want);
    }
    farm.jobs[0].state = JOB_DONE;
    assert_holds(block_of(&farm, 80, 24), "\n100 %");
    farm.jobs[0].state = JOB_FAILED;
    assert_holds(block_of(&farm, 80, 24), "\n 99 %");
    assert_holds(block_of(&farm, 80, 24), "failed");
}

/* --- the strip -------------------------------------------------------------------------------------------- */

/* The strip of a picture of so many rows of which these are done, in work, done, in work and to come. */
static const char *strip_of(const uint32_t rows[STRETCHES], const uint32_t workers[STRETCHES], size_t columns)
{
    static char strip[4096];
    struct farm farm;
    uint32_t row = 0;
    farm_init(&farm, 1, 0);
    for (size_t i = 0; i < STRETCHES; i++) {
        farm.stretches[i].first_row = row;
        farm.stretches[i].rows = rows[i];
        farm.stretches[i].worker = workers[i];
        row += rows[i];
    }
    farm.jobs[0].height = row;
    const char *text = strchr(block_of(&farm, columns, 24), '\n') + 1;
    memcpy(strip, text, strcspn(text, "\n"));
    strip[strcspn(text, "\n")] = '\0';
    return strip;
}

static void test_strip(void **state)
{
    (void)state;
    static const uint32_t workers[] = {0, 9, 0, 35, 0};
    assert_string_equal(strip_of((uint32_t[]){2, 1, 1, 2, 4}, workers, 11), "██9█zz░░░░");
    assert_string_equal(strip_of((uint32_t[]){2, 1, 1, 2, 4}, workers, 21), "████99██zzzz░░░░░░░░");
    assert_string_equal(strip_of((uint32_t[]){3, 1, 4, 1, 3}, workers, 7), "█9██z░");
    assert_string_equal(strip_of((uint32_t[]){65527, 2, 2, 2, 2}, workers, 5), "███z");
    static const uint32_t many[] = {0, 36, 0, 4000000000, 0};
    assert_string_equal(strip_of((uint32_t[]){1, 1, 1, 1, 1}, many, 6), "█+█+░");
}

static void test_strip_of_partly_done_rows(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 0);
    farm.jobs[0].height = 40;
    farm.stretches[0] = (struct stretch_snapshot){0, 5, STRETCH_DONE, 0};
    farm.stretches[1] = (struct stretch_snapshot){5, 35, STRETCH_WAITING, 0};
    farm.jobs[0].stretch_count = 2;
    assert_holds(block_of(&farm, 11, 24), "\n█▒░░░░░░░░\n");
}

/* --- figures ---------------------------------------------------------------------------------------------- */

static void test_times(void **state)
{
    (void)state;
    static const struct {
        double elapsed, remaining;
        const char *elapsed_text, *remaining_text;
    } cases[] = {
        {5.9, 4.1, " 0:05 ", " 0:05 left"},
        {59.99, 59.99, " 0:59 ", " 1:00 left"},
        {754, 754, " 12:34 ", " 12:34 left"},
        {3599.5, 3599.5, " 59:59 ", " 1:00:00 left"},
        {3723, 3723, " 1:02:03 ", " 1:02:03 left"},
        {-1, 0, " 0:00 ", " 0:00 left"},
    };
    struct farm farm;
    farm_init(&farm, 1, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        farm.jobs[0].elapsed_seconds = cases[i].elapsed;
        farm.jobs[0].remaining_seconds = cases[i].remaining;
        assert_holds(block_of(&farm, 100, 24), cases[i].elapsed_text);
        assert_holds(block_of(&farm, 100, 24), cases[i].remaining_text);
    }
    farm.jobs[0].remaining_seconds = -1;
    assert_lacks(block_of(&farm, 100, 24), "left");
    assert_lacks(line_of(&farm), "left");
}

static void test_rates(void **state)
{
    (void)state;
    static const struct {
        double rate;
        const char *text;
    } cases[] = {
        {0, " 0 rays/s"},
        {999.4, " 999 rays/s"},
        {999.6, " 1.0 k rays/s"},
        {12.34e6, " 12.3 M rays/s"},
        {99.96e6, " 100 M rays/s"},
        {999.4e6, " 999 M rays/s"},
        {999.6e6, " 1.0 G rays/s"},
        {1.0 / 0.0, " 0 rays/s"},
        {-3, " 0 rays/s"},
    };
    struct farm farm;
    farm_init(&farm, 1, 0);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        farm.snapshot.rays_per_second = cases[i].rate;
        assert_holds(block_of(&farm, 100, 24), cases[i].text);
    }
}

static void test_plain_line(void **state)
{
    (void)state;
    struct farm farm;
    farm_init(&farm, 1, 3);
    farm.workers[1].state = WORKER_GONE;
    assert_string_equal(line_of(&farm),
                        "weft: showcase.json: 45 %, 12 s elapsed, 15 s left, 3.1 M rays/s, 2 workers\n");
    farm.jobs[0].elapsed_seconds = 3723;
    farm.workers[2].state = WORKER_GONE;
    assert_string_equal(line_of(&farm),
                        "weft: showcase.json: 45 %, 1:02:03 elapsed, 15 s left, 3.1 M rays/s, 1 worker\n");
}

/* --- names from outside ----------------------------------------------------------------------------------- */

static void assert_cut(const char *text, size_t columns, const char *want)
{
    struct bytes out = {0};
    text_put(&out, "%s", "");
    size_t used = text_put_cut(&out, text, columns);
    assert_string_equal((const char *)out.data, want);
    assert_int_equal(used, text_columns(want));
    assert_true(used <= columns);
    bytes_finish(&out);
}

static void test_cut_by_columns(void **state)
{
    (void)state;
    assert_cut("showcase", 8, "showcase");
    assert_cut("showcase", 7, "showca…");
    assert_cut("showcase", 1, "…");
    assert_cut("showcase", 0, "");
    assert_cut("größe", 5, "größe");
    assert_cut("größe", 4, "grö…");
    assert_cut("計算機", 6, "計算機");
    assert_cut("計算機", 5, "計算…");
    assert_cut("計算機", 4, "計…"); /* half a character cannot be shown */
    assert_cut("e\xCC\x81t\xCC\x81", 2, "e\xCC\x81t\xCC\x81");
}

static void test_hostile_names(void **state)
{
    (void)state;
    assert_cut("a\033[2Jb\n\x7F", 20, "a�[2Jb��");
    assert_cut("\xE2\x80\xAEgnp", 20, "�gnp");         /* right-to-left override */
    assert_cut("\xC2\x9B" "2J", 20, "�2J");            /* the 8-bit form of ESC [ */
    assert_cut("\xC0\xAF\xED\xA0\x80", 20, "�����");   /* overlong; a surrogate */
    assert_cut("\xF4\x90\x80\x80|\xE2\x82", 20, "����|��"); /* beyond U+10FFFF; cut off */

    struct farm farm;
    farm_init(&farm, 1, 1);
    farm.workers[0].host = "evil\033]0;x\a";
    farm.workers[0].kernel = "\xFF\033c";
    farm.jobs[0].output = "a\r\n.png";
    const char *text = block_of(&farm, 100, 24);
    assert_lacks(text, "\033");
    assert_lacks(text, "\r");
    assert_int_equal(count_lines(text), 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_block_fits_every_size),
        cmocka_unit_test(test_block_in_full),
        cmocka_unit_test(test_block_narrow),
        cmocka_unit_test(test_many_workers_are_capped),
        cmocka_unit_test(test_no_worker),
        cmocka_unit_test(test_an_error_asked_for),
        cmocka_unit_test(test_several_jobs),
        cmocka_unit_test(test_no_jobs),
        cmocka_unit_test(test_percent_is_100_only_when_done),
        cmocka_unit_test(test_strip),
        cmocka_unit_test(test_strip_of_partly_done_rows),
        cmocka_unit_test(test_times),
        cmocka_unit_test(test_rates),
        cmocka_unit_test(test_plain_line),
        cmocka_unit_test(test_cut_by_columns),
        cmocka_unit_test(test_hostile_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
