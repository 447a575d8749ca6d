/* The sockets with keys: who gets in over TCP, as what, and who does not. */
#include "base/log.h"
#include "base/memory.h"
#include "tests/unit/socket_help.h"
#include "wire/message.h"

static char farm[64], other[64]; /* folders of keys */

/* The coordinator's keys in that folder. */
static struct wire_server *guarded(const char *keys_of, char *bound)
{
    static const struct key wiped;
    struct coordinator_keys keys;
    assert_int_equal(coordinator_keys_read(&keys, keys_of, &error), STATUS_OK);
    struct wire_server *server = open_server_with(&keys);
    assert_memory_equal(&keys.secret, &wiped, sizeof wiped);
    assert_int_equal(wire_server_bind(server, "tcp://127.0.0.1:*", bound, &error), STATUS_OK);
    return server;
}

/* A client that has the secret at `path` in the folder `secret_of` and wants the coordinator of `server_of`. */
static struct wire_client *join_as(const char *bound, const char *server_of, const char *secret_of, const char *path)
{
    static const struct worker_keys wiped;
    char secret[80];
    struct worker_keys keys;
    assert_int_equal(worker_keys_read(&keys, server_of, &error), STATUS_OK);
    snprintf(secret, sizeof secret, "%s/%s", secret_of, path);
    assert_int_equal(key_file_read(&keys.secret, secret, KEY_SECRET, &error), STATUS_OK);
    struct wire_client *client = join_with(bound, &keys);
    assert_memory_equal(&keys, &wiped, sizeof wiped);
    return client;
}

static struct wire_client *join_and_greet_as(struct wire_server *server, const char *bound, const char *path,
                                             struct wire_peer *peer)
{
    struct wire_client *client = join_as(bound, farm, farm, path);
    client_send(client, "hello", 5);
    assert_server_receives(server, peer, "hello");
    return client;
}

static void test_worker_and_watcher(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer worker_peer, watcher_peer, peer;
    struct wire_server *server = guarded(farm, bound);
    struct wire_client *worker = join_and_greet_as(server, bound, "worker.key", &worker_peer);
    struct wire_client *watcher = join_and_greet_as(server, bound, "watcher.key", &watcher_peer);
    struct wire_client *loom = join_and_greet_as(server, bound, "loom/worker.key", &peer);
    assert_true(worker_peer.may_work);
    assert_false(watcher_peer.may_work);
    assert_true(peer.may_work);
    assert_true(wire_server_send(server, &worker_peer, "for work", 8));
    assert_true(wire_server_send(server, &watcher_peer, "for show", 8));
    assert_client_receives(worker, "for work");
    assert_client_receives(watcher, "for show");
    leave(worker);
    leave(watcher);
    leave(loom);
    close_server(server);
}

/* A machine is its key, on whatever connection; by ipc there is but this one. */
static void test_machines(void **state)
{
    (void)state;
    static const struct wire_machine here;
    static const char *const names[] = {"worker.key", "worker.key", "loom/worker.key", "watcher.key"};
    enum { CLIENTS = sizeof names / sizeof *names };
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer peers[CLIENTS], local_peer;
    struct wire_client *joined[CLIENTS];
    struct wire_server *server = guarded(farm, bound);
    assert_int_equal(wire_server_bind(server, ipc_endpoint(), NULL, &error), STATUS_OK);
    for (int i = 0; i < CLIENTS; i++) {
        joined[i] = join_and_greet_as(server, bound, names[i], &peers[i]);
        assert_false(wire_machine_equal(&peers[i].machine, &here));
        for (int k = 0; k < i; k++)
            assert_int_equal(wire_machine_equal(&peers[i].machine, &peers[k].machine), strcmp(names[i], names[k]) == 0);
    }
    struct wire_client *local = join_and_greet_as(server, ipc_endpoint(), "worker.key", &local_peer);
    assert_true(wire_machine_equal(&local_peer.machine, &here));
    for (int i = 0; i < CLIENTS; i++)
        leave(joined[i]);
    leave(local);
    close_server(server);
}

/* Every message tells what its sender may do, also those that waited. */
static void test_each_message(void **state)
{
    (void)state;
    enum { MESSAGES = 5000 };
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer worker_peer, watcher_peer, peer;
    struct bytes data = {0};
    struct wire_server *server = guarded(farm, bound);
    struct wire_client *worker = join_and_greet_as(server, bound, "worker.key", &worker_peer);
    struct wire_client *watcher = join_and_greet_as(server, bound, "watcher.key", &watcher_peer);
    for (int i = 0; i < MESSAGES; i++)
        client_send(i % 2 ? worker : watcher, &i, sizeof i);
    for (int i = 0; i < MESSAGES; i++) {
        assert_true(server_receive_within(server, &peer, &data, PATIENCE_MS));
        assert_true(wire_peer_equal(&peer, peer.may_work ? &worker_peer : &watcher_peer));
        assert_int_equal(data.data[0] % 2, peer.may_work);
    }
    bytes_finish(&data);
    leave(worker);
    leave(watcher);
    close_server(server);
}

/* The bodies of a render, both ways, are the same after encryption. */
static void test_bodies(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer peer;
    struct bytes data = {0};
    struct wire_server *server = guarded(farm, bound);
    struct wire_client *client = join_and_greet_as(server, bound, "worker.key", &peer);
    uint8_t *body = memory_array(MESSAGE_BYTES_MAX, 1);
    for (size_t i = 0; i < MESSAGE_BYTES_MAX / 2; i++)
        body[i] = (uint8_t)(i * 31 + i / 1000);
    client_send(client, body, MESSAGE_BYTES_MAX / 2);
    assert_true(server_receive_within(server, &peer, &data, PATIENCE_MS));
    assert_int_equal(data.size, MESSAGE_BYTES_MAX / 2);
    assert_memory_equal(data.data, body, data.size);
    assert_true(wire_server_send(server, &peer, body, MESSAGE_BYTES_MAX / 2));
    while (!wire_client_receive(client, &data))
        wire_client_wait(client, NULL, 0, PATIENCE_MS);
    assert_memory_equal(data.data, body, data.size);
    free(body);
    bytes_finish(&data);
    leave(client);
    close_server(server);
}

/* --- who stays outside ------------------------------------------------------------------------------------ */

/* While an honest worker speaks, nothing is heard of the client, which tries all the while. */
static void assert_unheard(struct wire_server *server, const char *bound, struct wire_client *client)
{
    enum { WORDS = 50 };
    struct wire_peer honest_peer, peer;
    struct bytes data = {0};
    struct wire_client *honest = join_and_greet_as(server, bound, "worker.key", &honest_peer);
    for (int i = 0; i < WORDS; i++) {
        wire_client_send(client, "let me in", 9);
        wire_client_wait(client, NULL, 0, 10);
        client_send(honest, "word", 4);
        assert_true(server_receive_within(server, &peer, &data, PATIENCE_MS));
        assert_true(wire_peer_equal(&peer, &honest_peer));
        assert_int_equal(data.size, 4);
    }
    assert_false(wire_client_receive(client, &data));
    bytes_finish(&data);
    leave(honest);
    leave(client);
    close_server(server);
}

static void test_unknown_key(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_server *server = guarded(farm, bound);
    assert_unheard(server, bound, join_as(bound, farm, other, "worker.key"));
}

/* The public half of a pair is known to many; it does not stand for the secret one. */
static void test_coordinators_own_key(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_server *server = guarded(farm, bound);
    assert_unheard(server, bound, join_as(bound, farm, farm, "coordinator.key"));
}

static void test_no_key(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_server *server = guarded(farm, bound);
    assert_unheard(server, bound, join(bound));
}

static void test_other_coordinator(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_server *server = guarded(farm, bound);
    assert_unheard(server, bound, join_as(bound, other, farm, "worker.key"));
}

/* A client with keys speaks to no server that lacks them. */
static void test_plain_server(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer peer;
    struct bytes data = {0};
    struct wire_server *server = serve("tcp://127.0.0.1:*", bound);
    struct wire_client *client = join_as(bound, farm, farm, "worker.key");
    for (int i = 0; i < 20; i++) {
        wire_client_send(client, "hello", 5);
        assert_false(server_receive_within(server, &peer, &data, 20));
    }
    bytes_finish(&data);
    leave(client);
    close_server(server);
}

/* --- two sockets ------------------------------------------------------------------------------------------ */

/* Over ipc there are no keys, and its peers are others than those over TCP. */
static void test_ipc_stays_plain(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer remote_peer, local_peer, peer;
    struct wire_server *server = guarded(farm, bound);
    assert_int_equal(wire_server_bind(server, ipc_endpoint(), NULL, &error), STATUS_OK);
    struct wire_client *remote = join_and_greet_as(server, bound, "watcher.key", &remote_peer);
    struct wire_client *local = join_and_greet_as(server, ipc_endpoint(), "watcher.key", &local_peer);
    assert_false(remote_peer.may_work);
    assert_true(local_peer.may_work);
    struct wire_peer same_name = local_peer;
    same_name.socket = remote_peer.socket;
    assert_false(wire_peer_equal(&local_peer, &same_name));
    struct wire_client *plain = join_and_greet(server, ipc_endpoint(), &peer);
    assert_true(wire_server_send(server, &local_peer, "local", 5));
    assert_true(wire_server_send(server, &remote_peer, "remote", 6));
    assert_client_receives(local, "local");
    assert_client_receives(remote, "remote");
    leave(plain);
    leave(local);
    leave(remote);
    close_server(server);
}

/* A new connection has the keys of the old one, though nobody else keeps them. */
static void test_reconnect(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer before, after;
    struct wire_server *server = guarded(farm, bound);
    struct wire_client *client = join_and_greet_as(server, bound, "worker.key", &before);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(wire_client_reconnect(client, &error), STATUS_OK);
        greet_until_heard(client, "again", server, &after);
        assert_false(wire_peer_equal(&before, &after));
        assert_true(after.may_work);
        before = after;
    }
    leave(client);
    close_server(server);
}

/* One server with keys after another, and one that nobody binds. */
static void test_again(void **state)
{
    (void)state;
    char bound[WIRE_ENDPOINT_BYTES];
    struct wire_peer peer;
    struct coordinator_keys keys;
    for (int i = 0; i < 3; i++) {
        struct wire_server *server = guarded(farm, bound);
        struct wire_client *client = join_and_greet_as(server, bound, "worker.key", &peer);
        leave(client);
        close_server(server);
        wire_stop();
        assert_int_equal(wire_start(&error), STATUS_OK);
    }
    assert_int_equal(coordinator_keys_read(&keys, farm, &error), STATUS_OK);
    close_server(open_server_with(&keys));
}

static int make_keys(void **state)
{
    log_start("weft", LOG_ERROR); /* refusals are expected here */
    if (make_folder(state) != 0)
        return -1;
    snprintf(farm, sizeof farm, "%s/farm", folder);
    snprintf(other, sizeof other, "%s/other", folder);
    return keys_make(farm, &error) != STATUS_OK || keys_make(other, &error) != STATUS_OK ||
           keys_add_worker(farm, "loom", &error) != STATUS_OK;
}

static int remove_keys(void **state)
{
    char command[160];
    snprintf(command, sizeof command, "rm -r %s %s", farm, other);
    return system(command) != 0 || remove_folder(state) != 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_worker_and_watcher, start, stop),
        cmocka_unit_test_setup_teardown(test_machines, start, stop),
        cmocka_unit_test_setup_teardown(test_each_message, start, stop),
        cmocka_unit_test_setup_teardown(test_bodies, start, stop),
        cmocka_unit_test_setup_teardown(test_unknown_key, start, stop),
        cmocka_unit_test_setup_teardown(test_coordinators_own_key, start, stop),
        cmocka_unit_test_setup_teardown(test_no_key, start, stop),
        cmocka_unit_test_setup_teardown(test_other_coordinator, start, stop),
        cmocka_unit_test_setup_teardown(test_plain_server, start, stop),
        cmocka_unit_test_setup_teardown(test_ipc_stays_plain, start, stop),
        cmocka_unit_test_setup_teardown(test_reconnect, start, stop),
        cmocka_unit_test_setup_teardown(test_again, start, stop),
    };
    return cmocka_run_group_tests_name("socket_keys", tests, make_keys, remove_keys);
}
