/* What one says who asks a coordinator, and what is taken of its answers, under a virtual clock. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "coordinator/inquiry.h"
#include "wire/message.h"

static struct inquiry inquiry;
static struct error error;

static int end(void **state)
{
    (void)state;
    inquiry_finish(&inquiry);
    return 0;
}

static void assert_asks(uint64_t number, uint64_t ticket, int64_t now_ms)
{
    struct bytes bytes = {0};
    struct message message;
    assert_true(inquiry_say(&inquiry, &bytes, now_ms));
    assert_int_equal(message_decode(&message, bytes.data, bytes.size, &error), STATUS_OK);
    assert_int_equal(message.kind, MESSAGE_ASK);
    assert_int_equal(message.ask.number, number);
    assert_int_equal(message.ask.ticket, ticket);
    assert_int_equal(message.ask.pause_ms, inquiry.pause_ms);
    bytes_finish(&bytes);
}

static void assert_silent(int64_t now_ms)
{
    struct bytes bytes = {0};
    assert_false(inquiry_say(&inquiry, &bytes, now_ms));
    assert_int_equal(bytes.size, 0);
}

static enum status take(const struct message *message, int64_t now_ms)
{
    struct bytes bytes = {0};
    message_encode(message, &bytes);
    enum status status = inquiry_take(&inquiry, bytes.data, bytes.size, now_ms, &error);
    bytes_finish(&bytes);
    return status;
}

/* The part of "0123456789" from there. */
static void hear(uint64_t number, uint64_t ticket, uint64_t offset, uint32_t size, int64_t now_ms)
{
    const uint8_t *data = (const uint8_t *)"0123456789" + offset;
    struct message message = {.kind = MESSAGE_STATUS,
                              .status = {number, ticket, 0, offset, 10, data, size}};
    assert_int_equal(take(&message, now_ms), STATUS_OK);
}

static void hear_ticket(uint64_t number, uint64_t ticket, int64_t now_ms)
{
    struct message message = {.kind = MESSAGE_STATUS, .status = {.number = number, .ticket = ticket}};
    assert_int_equal(take(&message, now_ms), STATUS_OK);
    assert_false(inquiry.complete);
}

static void assert_complete(void)
{
    assert_true(inquiry.complete);
    assert_int_equal(inquiry.text.size, 10);
    assert_memory_equal(inquiry.text.data, "0123456789", 10);
}

static void test_answers(void **state)
{
    (void)state;
    inquiry_init(&inquiry, 100, 5000, 1000);
    assert_asks(1, 0, 1000);
    assert_silent(1001);
    hear_ticket(1, 40, 1010);
    assert_int_equal(inquiry_deadline(&inquiry), 1010);
    assert_asks(1, 40, 1010);
    hear(1, 41, 0, 4, 1020);
    assert_false(inquiry.complete);
    assert_asks(1, 40, 1010 + INQUIRY_AGAIN_MS); /* the ticket counts when all of the answer is there */
    hear(1, 41, 4, 6, 2020);
    assert_complete();
    assert_silent(9000);
    inquiry_go_on(&inquiry, 2030);
    assert_asks(2, 41, 2030);
    hear(1, 50, 0, 10, 2040); /* of the question before */
    assert_false(inquiry.complete);
    hear(2, 51, 0, 10, 2050);
    assert_complete();
    assert_false(inquiry.last);
}

/* Parts that do not fit together, and an answer that begins anew in the middle. */
static void test_parts(void **state)
{
    (void)state;
    inquiry_init(&inquiry, 0, 5000, 1000);
    hear_ticket(1, 40, 1000);
    hear(1, 41, 3, 7, 1000);
    assert_int_equal(inquiry.text.size, 0);
    hear(1, 41, 0, 4, 1000);
    hear(1, 41, 5, 5, 1000);
    assert_int_equal(inquiry.text.size, 4);
    hear(1, 42, 0, 2, 1000);
    assert_int_equal(inquiry.text.size, 2);
    hear(1, 42, 2, 0, 1000);
    assert_int_equal(inquiry.text.size, 2);
    hear(1, 42, 2, 8, 1000);
    assert_complete();
    assert_int_equal(inquiry.ticket, 42);
}

static void test_patience(void **state)
{
    (void)state;
    inquiry_init(&inquiry, 250, 5000, 1000);
    assert_asks(1, 0, 1000);
    inquiry_not_said(&inquiry, 1000);
    assert_silent(999 + INQUIRY_RETRY_MS);
    assert_asks(1, 0, 1000 + INQUIRY_RETRY_MS);
    assert_false(inquiry_is_late(&inquiry, 5999));
    assert_true(inquiry_is_late(&inquiry, 6000));
    hear_ticket(1, 40, 4000);
    assert_false(inquiry_is_late(&inquiry, 9249)); /* answers may come so far apart */
    assert_true(inquiry_is_late(&inquiry, 9250));
    hear_ticket(1, 41, 8000); /* an endless supply of tickets is no answer */
    hear(1, 41, 0, 0, 8000);
    assert_true(inquiry_is_late(&inquiry, 9250));
    hear(1, 41, 0, 1, 9000);
    assert_false(inquiry_is_late(&inquiry, 14249));
    assert_true(inquiry_is_late(&inquiry, 14250));
}

static void assert_refused(const void *data, size_t size, const char *says)
{
    assert_int_equal(inquiry_take(&inquiry, data, size, 1000, &error), STATUS_FAILED);
    assert_string_equal(error.text, says);
}

static void test_refusals(void **state)
{
    (void)state;
    inquiry_init(&inquiry, 0, 5000, 1000);
    assert_refused("WEFT\3\0\x8", 7, "the coordinator speaks version 3 of the protocol, this weft 2");
    assert_refused("weft", 4, "message: expected one of weft's, found other bytes");
    struct message refusal = {.kind = MESSAGE_REFUSE, .refuse.reason = "no"};
    assert_int_equal(take(&refusal, 1000), STATUS_FAILED);
    assert_string_equal(error.text, "the coordinator does not answer: no");
    assert_int_equal(take(&(struct message){.kind = MESSAGE_WELCOME}, 1000), STATUS_OK); /* passed over */
    assert_false(inquiry.heard);
}

static void test_goodbye(void **state)
{
    (void)state;
    struct bytes bytes = {0};
    struct message message;
    inquiry_init(&inquiry, 0, 5000, 1000);
    inquiry_goodbye(&bytes);
    assert_int_equal(message_decode(&message, bytes.data, bytes.size, &error), STATUS_OK);
    assert_int_equal(message.kind, MESSAGE_GOODBYE);
    assert_int_equal(message.epoch, 0);
    bytes_finish(&bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_answers, end),  cmocka_unit_test_teardown(test_parts, end),
        cmocka_unit_test_teardown(test_patience, end), cmocka_unit_test_teardown(test_refusals, end),
        cmocka_unit_test_teardown(test_goodbye, end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
