/* Workers by their addresses. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "coordinator/peer_index.h"

enum { PEERS = 5000 };

static struct peer peers[PEERS + 1];

/* As ZeroMQ makes them: a zero, then a number that counts up. */
static struct wire_peer address_of(uint32_t number)
{
    struct wire_peer address = {.may_work = true, .size = 5};
    for (int i = 0; i < 4; i++)
        address.id[1 + i] = (uint8_t)(number >> (24 - 8 * i));
    return address;
}

static struct peer_index index_of_all(void)
{
    struct peer_index index = {0};
    for (uint32_t number = 1; number <= PEERS; number++) {
        peers[number - 1] = (struct peer){.number = number, .address = address_of(number)};
        peer_index_add(&index, peers, number);
    }
    return index;
}

static uint32_t find(const struct peer_index *index, struct wire_peer address)
{
    return peer_index_find(index, peers, &address);
}

static void test_empty(void **state)
{
    (void)state;
    struct peer_index index = {0};
    assert_int_equal(find(&index, address_of(1)), 0);
    peer_index_finish(&index);
}

static void test_many(void **state)
{
    (void)state;
    struct peer_index index = index_of_all();
    for (uint32_t number = 1; number <= PEERS; number++)
        assert_int_equal(find(&index, address_of(number)), number);
    assert_int_equal(find(&index, address_of(0)), 0);
    assert_int_equal(find(&index, address_of(PEERS + 1)), 0);
    assert_int_equal(index.count, PEERS);
    peer_index_finish(&index);
    assert_null(index.slots);
}

/* The same name on another socket of the server, or a longer one that begins alike, is somebody else's. */
static void test_nearly_equal(void **state)
{
    (void)state;
    struct peer_index index = index_of_all();
    struct wire_peer other_socket = address_of(7), longer = address_of(7), looker = address_of(7);
    other_socket.socket = 1;
    longer.size++;
    looker.may_work = false;
    assert_int_equal(find(&index, other_socket), 0);
    assert_int_equal(find(&index, longer), 0);
    assert_int_equal(find(&index, looker), 7);
    peer_index_finish(&index);
}

/* One that went and came again on the same connection. */
static void test_again(void **state)
{
    (void)state;
    struct peer_index index = index_of_all();
    peers[PEERS] = (struct peer){.number = PEERS + 1, .address = address_of(7)};
    peer_index_add(&index, peers, PEERS + 1);
    assert_int_equal(find(&index, address_of(7)), PEERS + 1);
    assert_int_equal(find(&index, address_of(8)), 8);
    assert_int_equal(index.count, PEERS);
    peer_index_finish(&index);
}

/* Whoever is left is still found; one whose address another has taken over is not there to be removed. */
static void test_remove(void **state)
{
    (void)state;
    struct peer_index index = index_of_all();
    peers[PEERS] = (struct peer){.number = PEERS + 1, .address = address_of(7)};
    peer_index_add(&index, peers, PEERS + 1);
    peer_index_remove(&index, peers, 7);
    assert_int_equal(find(&index, address_of(7)), PEERS + 1);
    for (uint32_t number = 1; number <= PEERS; number++)
        if (number % 3 > 0)
            peer_index_remove(&index, peers, number == 7 ? PEERS + 1 : number);
    for (uint32_t number = 1; number <= PEERS; number++)
        assert_int_equal(find(&index, address_of(number)), number % 3 > 0 ? 0 : number);
    assert_int_equal(index.count, PEERS / 3);
    peer_index_remove(&index, peers, 1); /* again */
    assert_int_equal(index.count, PEERS / 3);
    for (uint32_t number = 1; number <= PEERS; number++)
        if (number % 3 > 0)
            peer_index_add(&index, peers, number);
    for (uint32_t number = 1; number <= PEERS; number++)
        assert_int_equal(find(&index, address_of(number)), number);
    peer_index_finish(&index);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_empty),
        cmocka_unit_test(test_many),
        cmocka_unit_test(test_nearly_equal),
        cmocka_unit_test(test_again),
        cmocka_unit_test(test_remove),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
