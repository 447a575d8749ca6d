/*
 * A worker's session with a coordinator that sends anything, on a connection that may be lost at any message. The input
 * is a script (script.h).
 *
 * Messages of the coordinator, in the epoch that W named last:
 *   W EPOCH .     welcome                      R . .        refuse
 *   J JOB FILE    job, with that manifest      e JOB .      end
 *   a FILE CHUNK  asset, a chunk               A FILE CHUNK asset, a chunk that is one byte short
 *   b JOB LEASE   band                         s JOB LEASE  band of a survey
 *   k LEASE .     ack                          r LEASE .    revoke
 *   B . .         beat                         g . .        goodbye
 *   m . COUNT     the next COUNT bytes, as a message
 * What else happens:
 *   l JOB .       loaded                       f JOB .      could not be loaded
 *   n LEASE SIZE  rendered, 1 + SIZE * 16 KiB  t TIME UNIT  TIME ms later, or (UNIT 1) TIME * 256 ms
 *   d . .         to be drained                x COUNT .    the next message but COUNT cannot be sent
 */
#include <ctype.h>

#include "base/memory.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/script.h"
#include "wire/manifest.h"
#include "worker/session.h"

enum { WIDTH = 640, HEIGHT = 360, RECORD_UNIT = 16 * 1024, NEVER = -1 };

/* A coordinator's files: of three bytes, of two chunks, empty; then manifests: of the three, of one of them under two
 * names, of a file that it says is longer than it is; and one that is none. */
enum { FILE_SMALL, FILE_LARGE, FILE_EMPTY, MANIFEST_ALL, MANIFEST_TWICE, MANIFEST_WRONG, MANIFEST_BROKEN, FILES };

static struct file {
    struct bytes bytes;
    struct digest digest;
} files[FILES];

static struct {
    struct session *session;
    int64_t now_ms;
    uint64_t epoch;
    int fails;                 /* how many messages can be sent before one cannot, or NEVER */
    unsigned started[SCRIPT_NUMBERS]; /* bands of each lease, which are to be rendered */
} run;

/* --- files ------------------------------------------------------------------------------------------------ */

static void keep_file(size_t place, struct bytes bytes)
{
    files[place] = (struct file){bytes, digest_of(bytes.data, bytes.size)};
}

static void keep_manifest(size_t place, const size_t *listed, size_t count, size_t more_bytes)
{
    struct manifest manifest = {.entries = memory_array(count, sizeof(struct manifest_entry)), .count = count};
    struct bytes bytes = {0};
    for (size_t i = 0; i < count; i++) {
        struct manifest_entry *entry = &manifest.entries[i];
        snprintf(entry->name, sizeof entry->name, "file%zu", i);
        entry->digest = files[listed[i]].digest;
        entry->size = files[listed[i]].bytes.size + more_bytes;
    }
    manifest_encode(&manifest, &bytes);
    manifest_finish(&manifest);
    keep_file(place, bytes);
}

static void make_files(void)
{
    static const size_t sizes[] = {[FILE_SMALL] = 3, [FILE_LARGE] = MESSAGE_CHUNK_MAX + 5, [FILE_EMPTY] = 0};
    static const size_t all[] = {FILE_SMALL, FILE_LARGE, FILE_EMPTY}, twice[] = {FILE_SMALL, FILE_SMALL};
    for (size_t i = 0; i <= FILE_EMPTY; i++)
        keep_file(i, (struct bytes){memory_array(sizes[i], 1), sizes[i], sizes[i]});
    keep_manifest(MANIFEST_ALL, all, 3, 0);
    keep_manifest(MANIFEST_TWICE, twice, 2, 0);
    keep_manifest(MANIFEST_WRONG, twice, 1, 1);
    keep_file(MANIFEST_BROKEN, (struct bytes){(uint8_t *)memory_string("not a manifest"), 14, 15});
}

/* --- what the session does -------------------------------------------------------------------------------- */

static void take_sent(struct bytes *bytes)
{
    struct message message;
    struct error error;
    require(message_decode(&message, bytes->data, bytes->size, &error) == STATUS_OK);
    require(message.kind < MESSAGE_WELCOME || message.kind >= MESSAGE_BEAT);
    bytes_finish(bytes);
    if (run.fails != NEVER && run.fails-- == 0)
        session_send_failed(run.session, run.now_ms);
}

static void take_load(uint32_t job)
{
    struct job_settings settings;
    struct asset_set assets = {0};
    const char *name = session_assets(run.session, job, &settings, &assets);
    require(strcmp(name, assets.assets[0].name) == 0);
    require(settings.width == WIDTH && settings.height == HEIGHT);
    asset_set_finish(&assets);
}

static void take_actions(void)
{
    struct session_action action;
    while (session_take(run.session, &action)) {
        if (action.kind == SESSION_SEND)
            take_sent(&action.bytes);
        if (action.kind == SESSION_LOAD)
            take_load(action.job);
        if (action.kind == SESSION_START) {
            require(order_fits(&action.order, &(struct job_settings){.width = WIDTH, .height = HEIGHT}));
            run.started[action.lease % SCRIPT_NUMBERS]++;
        }
    }
}

static void handle(const struct session_event *event)
{
    session_handle(run.session, event, run.now_ms);
    take_actions();
}

/* --- what happens to it ----------------------------------------------------------------------------------- */

static void receive_bytes(const void *data, size_t size)
{
    struct message message;
    struct error error;
    if (message_decode(&message, data, size, &error) == STATUS_OK)
        handle(&(struct session_event){.kind = SESSION_MESSAGE, .message = &message});
}

/* Goes through the encoding, as a real one does. */
static void receive(struct message message)
{
    struct bytes bytes = {0};
    message.epoch = run.epoch;
    message_encode(&message, &bytes);
    receive_bytes(bytes.data, bytes.size);
    bytes_finish(&bytes);
}

static void receive_asset(const struct file *file, size_t chunk, size_t lacking)
{
    size_t size = file->bytes.size, offset = chunk * MESSAGE_CHUNK_MAX, left = offset < size ? size - offset : 0;
    left = left < MESSAGE_CHUNK_MAX ? left : MESSAGE_CHUNK_MAX;
    if (offset <= size && lacking <= left)
        receive((struct message){.kind = MESSAGE_ASSET, .asset = {
            .digest = file->digest, .offset = offset, .total = size, .data = file->bytes.data + offset,
            .size = (uint32_t)(left - lacking)}});
}

static void receive_job(uint32_t job, const struct file *manifest)
{
    receive((struct message){.kind = MESSAGE_JOB, .job = {
        .job = job, .manifest = manifest->digest,
        .manifest_bytes = manifest->bytes.size > 0 ? manifest->bytes.size : 1,
        .settings = {.width = WIDTH, .height = HEIGHT}}});
}

static void receive_band(uint32_t job, uint64_t lease, enum render_pass pass)
{
    receive((struct message){.kind = MESSAGE_BAND, .band = {
        .job = job, .lease = lease, .pass = pass, .first_row = job, .rows = 2,
        .sampling = {1, 4 + 4 * (uint32_t)(lease % 2), 100}}});
}

/* A band comes back as often as it was started. */
static void render(uint64_t lease, size_t size)
{
    if (run.started[lease] == 0)
        return;
    run.started[lease]--;
    struct bytes records = {0};
    memset(bytes_extend(&records, size), 7, size);
    handle(&(struct session_event){.kind = SESSION_RENDERED, .lease = lease, .records = &records});
    require(!records.data); /* moved or freed */
}

static bool receive_step(char what, unsigned x, unsigned y)
{
    switch (what) {
    case 'W':
        run.epoch = x;
        receive((struct message){.kind = MESSAGE_WELCOME});
        return true;
    case 'R':
        receive((struct message){.kind = MESSAGE_REFUSE, .refuse = {"no"}});
        return true;
    case 'J':
        receive_job(x, &files[y % FILES]);
        return true;
    case 'e':
        receive((struct message){.kind = MESSAGE_END, .end = {x}});
        return true;
    case 'a':
    case 'A':
        receive_asset(&files[x % FILES], y, what == 'A');
        return true;
    case 'b':
    case 's':
        receive_band(x, y, what == 'b' ? PASS_RENDER : PASS_SURVEY);
        return true;
    case 'k':
        receive((struct message){.kind = MESSAGE_ACK, .ack = {x}});
        return true;
    case 'r':
        receive((struct message){.kind = MESSAGE_REVOKE, .revoke = {x}});
        return true;
    case 'B':
    case 'g':
        receive((struct message){.kind = what == 'B' ? MESSAGE_BEAT : MESSAGE_GOODBYE});
        return true;
    default:
        return false;
    }
}

static bool other_step(char what, unsigned x, unsigned y)
{
    switch (what) {
    case 'l':
        handle(&(struct session_event){.kind = SESSION_LOADED, .job = x});
        return true;
    case 'f':
        handle(&(struct session_event){.kind = SESSION_LOAD_FAILED, .job = x, .reason = "cannot"});
        return true;
    case 'n':
        render(x, 1 + y * RECORD_UNIT);
        return true;
    case 't':
        run.now_ms += x * (y == 1 ? 256 : 1);
        handle(&(struct session_event){.kind = SESSION_TICK, .progress = y});
        return true;
    case 'd':
        handle(&(struct session_event){.kind = SESSION_DRAIN});
        return true;
    case 'x':
        run.fails = (int)x;
        return true;
    default:
        return false;
    }
}

static bool step(char what, unsigned x, unsigned y)
{
    return receive_step(what, x, y) || other_step(what, x, y);
}

static void receive_raw(unsigned who, const struct bytes *bytes)
{
    (void)who;
    receive_bytes(bytes->data, bytes->size);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const struct script_reader reader = {step, receive_raw};
    struct session_config config = {.once = size > 0 && isupper(data[size - 1]), .wait_ms = -1};
    config.hello = (struct message){.kind = MESSAGE_HELLO,
                                    .hello = {.host = "host", .kernel = "ref", .threads = 2, .credit = 4}};
    if (!files[FILES - 1].bytes.data)
        make_files();
    memset(&run, 0, sizeof run);
    run.fails = NEVER;
    run.session = session_create(&config, run.now_ms);
    for (size_t at = 0; at < size;)
        at += script_take(&reader, data + at, size - at);
    session_destroy(&run.session);
    return 0;
}
