/* The board between the loop and the one who answers: when a state is wanted, what is seen of it, lines and samples. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <poll.h>
#include <pthread.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "base/clock.h"
#include "coordinator/board.h"
#include "tests/unit/progress_help.h"

static bool rings(const struct board *board)
{
    struct pollfd file = {.fd = board_bell(board), .events = POLLIN};
    return poll(&file, 1, 0) == 1;
}

/* The loop of a farm: shows what is wanted until it is told to end. */
struct loop {
    struct board *board;
    struct farm farm;
    int shown;
    bool ending;
    pthread_t thread;
};

static void *run_loop(void *argument)
{
    struct loop *loop = argument;
    while (!__atomic_load_n(&loop->ending, __ATOMIC_ACQUIRE)) {
        struct pollfd file = {.fd = board_bell(loop->board), .events = POLLIN};
        poll(&file, 1, 20);
        if (board_wait_ms(loop->board, clock_now_ms()) > 0)
            continue;
        loop->farm.jobs[0].rows_done++;
        loop->shown++;
        board_publish(loop->board, &loop->farm.snapshot, clock_now_ms(), false);
    }
    return NULL;
}

static void test_nobody_answers(void **state)
{
    (void)state;
    struct board *board = board_create();
    struct farm farm;
    farm_init(&farm, 1, 1);
    assert_false(rings(board));
    assert_null(board_look(board)); /* patience ends */
    assert_true(rings(board));
    assert_int_equal(board_wait_ms(board, clock_now_ms()), 0);
    board_publish(board, &farm.snapshot, clock_now_ms() + 60000, false); /* so it stays fresh, however slow this is */
    assert_false(rings(board));
    assert_true(board_wait_ms(board, clock_now_ms()) > 0);
    const struct snapshot *seen = board_look(board);
    assert_non_null(seen);
    assert_int_equal(seen->jobs[0].rows_done, 486);
    assert_ptr_not_equal(seen->jobs, farm.jobs);
    assert_ptr_equal(board_look(board), seen); /* it is fresh enough */
    assert_false(rings(board));
    board_destroy(&board);
    assert_null(board);
}

static void test_the_loop_shows_what_is_wanted(void **state)
{
    (void)state;
    enum { FRESH_MS = 250, STEP_MS = 2000, PATIENCE_MS = 20000 };
    static struct loop loop;
    int64_t begun_ms = clock_now_ms();
    int looks = 0;
    loop.board = board_create();
    farm_init(&loop.farm, 1, 1);
    assert_int_equal(pthread_create(&loop.thread, NULL, run_loop, &loop), 0);
    uint32_t rows = 0;
    for (int i = 0; i < 3; i++) {
        const struct snapshot *seen;
        do { /* the loop may be late */
            seen = board_look(loop.board);
            looks++;
            assert_true(clock_now_ms() - begun_ms < PATIENCE_MS);
        } while (!seen || seen->jobs[0].rows_done == rows);
        assert_true(seen->jobs[0].rows_done > rows);
        rows = seen->jobs[0].rows_done;
        poll(NULL, 0, FRESH_MS + 50);
    }
    __atomic_store_n(&loop.ending, true, __ATOMIC_RELEASE);
    pthread_join(loop.thread, NULL);
    int samples = 1 + (int)((clock_now_ms() - begun_ms) / STEP_MS);
    assert_in_range(loop.shown, 3, looks + samples); /* when asked, and for the history: nothing else */
    board_destroy(&loop.board);
}

static void test_the_last_state_stays(void **state)
{
    (void)state;
    struct board *board = board_create();
    struct farm farm;
    farm_init(&farm, 1, 1);
    assert_false(board_is_over(board));
    board_publish(board, &farm.snapshot, 1, true); /* long ago: nobody could be asked for a newer one */
    assert_true(board_is_over(board));
    assert_non_null(board_look(board));
    assert_false(rings(board));
    board_linger(board); /* it was seen */
    board_destroy(&board);
}

static cJSON *take_json(struct bytes *text)
{
    cJSON *json = cJSON_ParseWithOpts((const char *)text->data, NULL, true);
    assert_non_null(json);
    bytes_finish(text);
    return json;
}

static void test_lines(void **state)
{
    (void)state;
    enum { KEPT = 256, SAID = 300 };
    struct board *board = board_create();
    struct bytes text = {0};
    for (int i = 0; i < SAID; i++) {
        char line[32];
        snprintf(line, sizeof line, "line %d", i);
        board_add_line(board, i % 2 ? LOG_INFO : LOG_WARNING, line);
    }
    board_put_lines(board, 0, &text);
    cJSON *json = take_json(&text);
    const cJSON *lines = cJSON_GetObjectItem(json, "lines");
    assert_int_equal(cJSON_GetObjectItem(json, "next")->valueint, SAID);
    assert_int_equal(cJSON_GetArraySize(lines), KEPT);
    const cJSON *first = cJSON_GetArrayItem(lines, 0);
    assert_string_equal(cJSON_GetObjectItem(first, "text")->valuestring, "line 44");
    assert_string_equal(cJSON_GetObjectItem(first, "level")->valuestring, "warning");
    cJSON_Delete(json);

    board_put_lines(board, SAID - 2, &text);
    json = take_json(&text);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(json, "lines")), 2);
    cJSON_Delete(json);
    board_put_lines(board, UINT64_MAX, &text);
    json = take_json(&text);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(json, "lines")), 0);
    cJSON_Delete(json);
    board_destroy(&board);
}

static void test_history(void **state)
{
    (void)state;
    enum { KEPT = 300, STEP_MS = 2000 };
    struct board *board = board_create();
    struct bytes text = {0};
    struct farm farm;
    farm_init(&farm, 1, 1);
    int64_t now_ms = clock_now_ms();
    for (int i = 0; i < 2 * (KEPT + 5); i++) { /* twice as often as samples are kept */
        farm.snapshot.elapsed_seconds = i;
        farm.jobs[0].remaining_seconds = i < 606 ? 5 : -1;
        board_publish(board, &farm.snapshot, now_ms + i * (STEP_MS / 2), false);
    }
    board_put_history(board, &text);
    cJSON *json = take_json(&text);
    const cJSON *samples = cJSON_GetObjectItem(json, "samples");
    assert_int_equal(cJSON_GetObjectItem(json, "step")->valueint, STEP_MS / 1000);
    assert_int_equal(cJSON_GetArraySize(samples), KEPT);
    assert_int_equal(cJSON_GetObjectItem(cJSON_GetArrayItem(samples, 0), "elapsed")->valueint, 10);
    assert_int_equal(cJSON_GetObjectItem(cJSON_GetArrayItem(samples, 0), "remaining")->valueint, 5);
    assert_true(cJSON_IsNull(cJSON_GetObjectItem(cJSON_GetArrayItem(samples, KEPT - 1), "remaining")));
    cJSON_Delete(json);
    board_destroy(&board);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nobody_answers),       cmocka_unit_test(test_the_loop_shows_what_is_wanted),
        cmocka_unit_test(test_the_last_state_stays), cmocka_unit_test(test_lines),
        cmocka_unit_test(test_history),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
