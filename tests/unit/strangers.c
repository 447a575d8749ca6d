/*
 * A dispatcher among strangers who come and go: what it remembers of them, how many lines it has for them, and whom it
 * blames when it stood still.
 */
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/log.h"
#include "coordinator/dispatcher_private.h"

static struct dispatcher *dispatcher;
static int64_t now_ms;
static uint32_t connections; /* there ever were */
static enum message_kind heard; /* the last that was sent, */
static uint64_t epoch;          /* and in which conversation */
static bool cut;                /* nothing can be sent */
static FILE *lines;             /* of the log, which is standard error */
static int standard_error;

static bool hear(void *context, const struct wire_peer *to, const void *data, size_t size)
{
    (void)context;
    (void)to;
    struct message message;
    struct error error;
    assert_int_equal(message_decode(&message, data, size, &error), STATUS_OK);
    if (cut)
        return false;
    heard = message.kind;
    epoch = message.epoch;
    return true;
}

static int start(void **state)
{
    (void)state;
    const struct dispatcher_config config = {.bell = -1, .send = hear};
    now_ms = 1000000;
    cut = false;
    dispatcher = dispatcher_create(&config, now_ms);
    log_start("weft", LOG_INFO);
    lines = tmpfile();
    standard_error = dup(STDERR_FILENO);
    dup2(fileno(lines), STDERR_FILENO);
    return 0;
}

static int finish(void **state)
{
    (void)state;
    dup2(standard_error, STDERR_FILENO);
    close(standard_error);
    fclose(lines);
    dispatcher_destroy(&dispatcher);
    return 0;
}

/* How many lines of the log have that text, and how many there are in all ("" ). */
static uint32_t count_lines(const char *text)
{
    char line[2048];
    uint32_t count = 0;
    rewind(lines);
    while (fgets(line, sizeof line, lines))
        count += strstr(line, text) != NULL;
    return count;
}

/* A new connection from that machine. */
static struct wire_peer connection(uint8_t machine)
{
    struct wire_peer peer = {.may_work = true, .size = 5, .machine = {{machine}}};
    connections++;
    memcpy(peer.id + 1, &connections, sizeof connections);
    return peer;
}

static void say(const struct wire_peer *from, struct message message)
{
    struct bytes bytes = {0};
    message_encode(&message, &bytes);
    dispatcher_take_message(dispatcher, from, bytes.data, bytes.size, now_ms);
    bytes_finish(&bytes);
}

/* Which kind of answer it gets. */
static enum message_kind say_hello(const struct wire_peer *from, uint32_t pid, bool stranger)
{
    struct message hello = {.kind = MESSAGE_HELLO, .hello = {.core_revision = {{stranger}}, .host = "loom", .kernel = "ref",
                                                             .pid = pid, .threads = 1, .credit = 2}};
    say(from, hello);
    return heard;
}

/* A million would be the same; each with another process number. */
static void test_coming_and_going(void **state)
{
    (void)state;
    enum { TIMES = 20000, KEPT_MOST = 10 };
    struct wire_peer steady = connection(2);
    assert_int_equal(say_hello(&steady, 1, false), MESSAGE_WELCOME);
    for (uint32_t i = 0; i < TIMES; i++) {
        struct wire_peer peer = connection(1);
        assert_int_equal(say_hello(&peer, i, false), MESSAGE_WELCOME);
        say(&peer, (struct message){.kind = MESSAGE_GOODBYE, .epoch = epoch});
    }
    assert_true(dispatcher->peer_count < KEPT_MOST);
    assert_true(dispatcher->peers_by_address.count < KEPT_MOST);
    assert_int_equal(dispatcher->machines.count, 2);
    assert_int_equal(dispatcher_present(dispatcher), 1);
    assert_int_equal(count_lines("joined"), 1 + 256 / 2);
    now_ms += 60000;
    struct wire_peer peer = connection(1);
    say_hello(&peer, 0, false);
    assert_int_equal(count_lines("more like that from its machine)"), 1);
}

/* The numbers of those who are here, or have done something, are not given away. */
static void test_numbers(void **state)
{
    (void)state;
    enum { PRESENT = 100, TIMES = 1000 };
    uint64_t epochs[PRESENT];
    struct wire_peer peers[PRESENT];
    for (uint32_t i = 0; i < PRESENT; i++) {
        peers[i] = connection(1);
        say_hello(&peers[i], i, false);
        epochs[i] = epoch;
    }
    dispatcher->peers[7].bands_done = 1;
    say(&peers[7], (struct message){.kind = MESSAGE_GOODBYE, .epoch = epochs[7]});
    for (uint32_t i = 0; i < TIMES; i++) {
        struct wire_peer peer = connection(1);
        say_hello(&peer, PRESENT + i, false);
        say(&peer, (struct message){.kind = MESSAGE_GOODBYE, .epoch = epoch});
    }
    assert_int_equal(dispatcher_present(dispatcher), PRESENT - 1);
    for (uint32_t i = 0; i < PRESENT; i++) {
        assert_int_equal(dispatcher->peers[i].number, i + 1);
        assert_int_equal(dispatcher->peers[i].pid, i);
        assert_int_equal(dispatcher->peers[i].epoch, epochs[i]);
    }
}

/* Who fails is left out, by its process; with a new process each time, by its machine. */
static void test_failing(void **state)
{
    (void)state;
    for (uint32_t machine = 1; machine <= 2; machine++) {
        uint32_t welcomed = 0;
        for (;;) {
            struct wire_peer peer = connection((uint8_t)machine);
            if (say_hello(&peer, machine == 1 ? 7 : welcomed, false) != MESSAGE_WELCOME)
                break;
            say(&peer, (struct message){.kind = MESSAGE_FAILED, .epoch = epoch, .failed.reason = "no"});
            assert_true(++welcomed < 100);
        }
        assert_int_equal(welcomed, machine == 1 ? 3 : MACHINE_PROCESSES_MAX + 1);
    }
    assert_int_equal(count_lines("it has failed too often in this render"), 2);
    struct wire_peer other = connection(3);
    assert_int_equal(say_hello(&other, 7, false), MESSAGE_WELCOME);
}

static void test_floods(void **state)
{
    (void)state;
    struct wire_peer peer = connection(1), other = connection(2);
    for (int i = 0; i < 1000; i++, now_ms += 10) {
        dispatcher_take_message(dispatcher, &peer, "nonsense", 8, now_ms);
        assert_int_equal(say_hello(&peer, 1, true), MESSAGE_REFUSE);
    }
    assert_int_equal(count_lines("ignored a message"), 1);
    assert_int_equal(count_lines("refused a worker"), 4);
    dispatcher_take_message(dispatcher, &other, "nonsense", 8, now_ms); /* another's is not passed over */
    assert_int_equal(count_lines("ignored a message"), 2);
    now_ms += 60000;
    dispatcher_take_message(dispatcher, &peer, "nonsense", 8, now_ms);
    assert_int_equal(count_lines("(and 999 more like that from its machine)"), 1);
}

/* A worker that cannot be reached after a call that took long has left, since nobody was heard; else it is lost. */
static void test_unreachable(void **state)
{
    (void)state;
    static const int64_t pauses_ms[] = {1, DISPATCHER_SILENCE_MS};
    for (int i = 0; i < 2; i++) {
        struct wire_peer peer = connection(1);
        say_hello(&peer, 1, false);
        cut = true;
        now_ms += 1000;
        dispatcher_tick(dispatcher, now_ms); /* its beat finds nobody */
        assert_int_equal(dispatcher_present(dispatcher), 0);
        assert_int_equal(dispatcher_deadline(dispatcher), now_ms + 1);
        assert_int_equal(count_lines("is lost"), i);
        now_ms += pauses_ms[i];
        cut = false;
        dispatcher_tick(dispatcher, now_ms);
        assert_int_equal(count_lines("is lost"), 1);
        assert_int_equal(count_lines("left while this process stood still"), i);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_coming_and_going, start, finish),
        cmocka_unit_test_setup_teardown(test_numbers, start, finish),
        cmocka_unit_test_setup_teardown(test_failing, start, finish),
        cmocka_unit_test_setup_teardown(test_floods, start, finish),
        cmocka_unit_test_setup_teardown(test_unreachable, start, finish),
    };
    return cmocka_run_group_tests_name("strangers", tests, NULL, NULL);
}
