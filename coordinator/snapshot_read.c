/* A snapshot that comes as JSON from a process that may not mean well. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/memory.h"
#include "coordinator/snapshot_copy.h"
#include "coordinator/snapshot_json.h"
#include "scene/json_syntax.h"
#include "scene/json_tree.h"
#include "wire/message.h"

/* The first thing that is not as it should be fills *error, and nothing after that counts. */
struct reader {
    enum status status;
    struct error *error;
    const char *list; /* what is being read: its list, */
    size_t index;     /* and the place in it; "" for the whole */
};

/* What is read, with all that it points to, until it is copied into one piece. */
struct reading {
    struct snapshot snapshot;
    cJSON *json; /* whose strings it has */
    struct job_snapshot *jobs;
    struct worker_snapshot *workers;
    struct stretch_snapshot *stretches;
};

/* --- members ---------------------------------------------------------------------------------------------- */

static void refuse(struct reader *r, const char *key, const char *expected)
{
    if (r->status != STATUS_OK)
        return;
    if (*r->list)
        r->status = error_set(r->error, STATUS_INPUT, "the status: %s[%zu].%s: expected %s, found something else",
                              r->list, r->index, key, expected);
    else
        r->status =
            error_set(r->error, STATUS_INPUT, "the status: %s: expected %s, found something else", key, expected);
}

static const cJSON *get(const cJSON *object, const char *key)
{
    return cJSON_GetObjectItemCaseSensitive(object, key);
}

static double get_real(struct reader *r, const cJSON *object, const char *key, double max)
{
    const cJSON *item = get(object, key);
    if (cJSON_IsNumber(item) && item->valuedouble >= 0 && item->valuedouble <= max)
        return item->valuedouble;
    refuse(r, key, "a number of its range");
    return 0;
}

/* Which null is allowed for, and stands for that. */
static double get_real_or(struct reader *r, const cJSON *object, const char *key, double max, double if_null)
{
    return cJSON_IsNull(get(object, key)) ? if_null : get_real(r, object, key, max);
}

/* Up to the largest double below 2^64. */
#define COUNT_MAX 18446744073709549568.0

static uint64_t get_count(struct reader *r, const cJSON *object, const char *key, double max)
{
    double value = get_real(r, object, key, max);
    if (value == floor(value))
        return (uint64_t)value;
    refuse(r, key, "a whole number");
    return 0;
}

static uint32_t get_small(struct reader *r, const cJSON *object, const char *key, uint32_t max)
{
    return (uint32_t)get_count(r, object, key, max);
}

/* Borrowed from the tree. */
static const char *get_text(struct reader *r, const cJSON *object, const char *key)
{
    const cJSON *item = get(object, key);
    if (cJSON_IsString(item))
        return item->valuestring;
    refuse(r, key, "a text");
    return "";
}

/* One of `count` words, the names of 0 and so on; null is that which has none. */
static int get_word(struct reader *r, const cJSON *object, const char *key, const char *(*name)(int), int count)
{
    const cJSON *item = get(object, key);
    for (int i = 0; i < count; i++) {
        const char *word = name(i);
        if (word ? cJSON_IsString(item) && strcmp(item->valuestring, word) == 0 : cJSON_IsNull(item))
            return i;
    }
    refuse(r, key, "a word that is known");
    return 0;
}

static const char *job_word(int state)
{
    return job_state_name((enum job_state)state);
}

static const char *stretch_word(int state)
{
    return stretch_state_name((enum stretch_state)state);
}

static const char *worker_word(int state)
{
    return worker_state_name((enum worker_state)state);
}

static const char *trouble_word(int trouble)
{
    return worker_trouble_name((enum worker_trouble)trouble);
}

static const cJSON *get_list(struct reader *r, const cJSON *object, const char *key)
{
    const cJSON *item = get(object, key);
    if (cJSON_IsArray(item))
        return item;
    refuse(r, key, "a list");
    return NULL;
}

static size_t length_of(const cJSON *list)
{
    return list ? (size_t)cJSON_GetArraySize(list) : 0;
}

/* --- parts ------------------------------------------------------------------------------------------------ */

#define SECONDS_MAX 1e12
#define RATE_MAX 1e18

static struct stretch_snapshot read_stretch(struct reader *r, const cJSON *object)
{
    return (struct stretch_snapshot){
        .first_row = get_small(r, object, "first_row", MESSAGE_SIDE_MAX),
        .rows = get_small(r, object, "rows", MESSAGE_SIDE_MAX),
        .state = (enum stretch_state)get_word(r, object, "state", stretch_word, STRETCH_STATES),
        .worker = cJSON_IsNull(get(object, "worker")) ? 0 : get_small(r, object, "worker", UINT32_MAX),
    };
}

/* They are the whole picture, from the top without gaps. */
static void read_stretches(struct reader *r, const cJSON *list, struct job_snapshot *job, struct stretch_snapshot *to)
{
    const cJSON *item;
    uint32_t next_row = 0;
    job->stretches = to;
    cJSON_ArrayForEach(item, list)
    {
        struct stretch_snapshot stretch = read_stretch(r, item);
        if (stretch.first_row != next_row || stretch.rows < 1 || stretch.rows > job->height - next_row)
            refuse(r, "bands", "all rows from the top");
        if (r->status != STATUS_OK)
            return;
        next_row += stretch.rows;
        to[job->stretch_count++] = stretch;
    }
    if (next_row != job->height)
        refuse(r, "bands", "all rows from the top");
}

static struct job_snapshot read_job(struct reader *r, const cJSON *object)
{
    struct job_snapshot job = {
        .scene = get_text(r, object, "scene"),
        .output = get_text(r, object, "output"),
        .state = (enum job_state)get_word(r, object, "state", job_word, JOB_STATES),
        .width = get_small(r, object, "width", MESSAGE_SIDE_MAX),
        .height = get_small(r, object, "height", MESSAGE_SIDE_MAX),
        .samples = get_real_or(r, object, "samples", MESSAGE_SAMPLES_MAX, 0),
        .samples_max = get_small(r, object, "samples_max", MESSAGE_SAMPLES_MAX),
        .error = get_real_or(r, object, "error", 1, 0),
        .rmse = get_real_or(r, object, "rmse", RATE_MAX, NAN),
        .rows_in_work = get_small(r, object, "rows_in_work", UINT32_MAX),
        .rays = get_count(r, object, "rays", COUNT_MAX),
        .elapsed_seconds = get_real(r, object, "elapsed", SECONDS_MAX),
        .remaining_seconds = get_real_or(r, object, "remaining", SECONDS_MAX, -1),
    };
    job.rows_done = get_small(r, object, "rows_done", job.height);
    return job;
}

static struct worker_snapshot read_worker(struct reader *r, const cJSON *object)
{
    return (struct worker_snapshot){
        .number = get_small(r, object, "number", UINT32_MAX),
        .host = get_text(r, object, "host"),
        .kernel = get_text(r, object, "kernel"),
        .pid = get_small(r, object, "pid", UINT32_MAX),
        .threads = get_small(r, object, "threads", UINT32_MAX),
        .state = (enum worker_state)get_word(r, object, "state", worker_word, WORKER_STATES),
        .bands_held = get_small(r, object, "bands_held", UINT32_MAX),
        .bands_done = get_small(r, object, "bands_done", UINT32_MAX),
        .rows_done = get_count(r, object, "rows_done", COUNT_MAX),
        .rays = get_count(r, object, "rays", COUNT_MAX),
        .rays_per_second = get_real_or(r, object, "rays_per_second", RATE_MAX, NAN),
        .trouble = (enum worker_trouble)get_word(r, object, "trouble", trouble_word, WORKER_TROUBLES),
    };
}

/* --- the whole -------------------------------------------------------------------------------------------- */

static void read_jobs(struct reader *r, const cJSON *list, struct reading *to)
{
    const cJSON *item;
    size_t stretches = 0;
    cJSON_ArrayForEach(item, list)
        stretches += length_of(get(item, "bands"));
    to->jobs = memory_array(length_of(list), sizeof *to->jobs);
    to->stretches = memory_array(stretches, sizeof *to->stretches);
    struct stretch_snapshot *next = to->stretches;
    r->list = "jobs";
    r->index = 0;
    cJSON_ArrayForEach(item, list)
    {
        struct job_snapshot *job = &to->jobs[r->index];
        *job = read_job(r, item);
        read_stretches(r, get_list(r, item, "bands"), job, next);
        next += job->stretch_count;
        r->index++;
    }
    to->snapshot.jobs = to->jobs;
    to->snapshot.job_count = length_of(list);
}

static void read_workers(struct reader *r, const cJSON *list, struct reading *to)
{
    const cJSON *item;
    to->workers = memory_array(length_of(list), sizeof *to->workers);
    r->list = "workers";
    r->index = 0;
    cJSON_ArrayForEach(item, list)
    {
        to->workers[r->index] = read_worker(r, item);
        r->index++;
    }
    to->snapshot.workers = to->workers;
    to->snapshot.worker_count = length_of(list);
}

static void read_whole(struct reader *r, struct reading *to)
{
    const cJSON *json = to->json;
    to->snapshot = (struct snapshot){
        .elapsed_seconds = get_real(r, json, "elapsed", SECONDS_MAX),
        .rays_per_second = get_real_or(r, json, "rays_per_second", RATE_MAX, NAN),
        .rays = get_count(r, json, "rays", COUNT_MAX),
        .refused = get_small(r, json, "refused", UINT32_MAX),
    };
    read_jobs(r, get_list(r, json, "jobs"), to);
    r->list = "";
    read_workers(r, get_list(r, json, "workers"), to);
}

/* A tree takes a hundred bytes and more for each value, of which short ones could be many. */
static bool is_dense(const char *text, size_t size)
{
    enum { BYTES_EACH = 6, FEW = 64 }; /* more than six in what snapshot_write_json writes */
    size_t values = 0;
    bool quoted = false;
    for (size_t i = 0; i < size; i++) {
        if (quoted && text[i] == '\\')
            i++;
        else if (text[i] == '"')
            quoted = !quoted;
        else
            values += !quoted && (text[i] == ',' || text[i] == '[' || text[i] == '{');
    }
    return values > size / BYTES_EACH + FEW;
}

static enum status parse(struct reading *to, const char *text, size_t size, struct error *error)
{
    enum status status = json_syntax_check("the status", text, size, error);
    if (status != STATUS_OK)
        return status;
    if (is_dense(text, size))
        return error_set(error, STATUS_INPUT, "the status: expected a snapshot, found too many values");
    return json_tree_build("the status", text, size, &to->json, error);
}

static void finish(struct reading *reading)
{
    cJSON_Delete(reading->json);
    free(reading->jobs);
    free(reading->workers);
    free(reading->stretches);
}

struct snapshot *snapshot_read_json(const char *text, size_t size, struct error *error)
{
    struct reader r = {.error = error, .list = ""};
    struct reading reading = {0};
    r.status = parse(&reading, text, size, error);
    if (r.status == STATUS_OK)
        read_whole(&r, &reading);
    struct snapshot *copy = r.status == STATUS_OK ? snapshot_copy(&reading.snapshot) : NULL;
    finish(&reading);
    return copy;
}
