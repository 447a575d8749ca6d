#include "coordinator/metrics.h"

#include <inttypes.h>
#include <math.h>

#include "base/text.h"

/* --- the format ------------------------------------------------------------------------------------------- */

static void put_head(struct bytes *text, const char *name, const char *type, const char *help)
{
    text_put(text, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

/* key="value", whatever the value holds. */
static void put_label(struct bytes *text, const char *key, const char *value)
{
    text_put(text, "%s=\"", key);
    for (uint32_t code = text_next(&value); code; code = text_next(&value)) {
        if (code == '\\' || code == '"')
            text_put(text, "\\%c", (int)code);
        else if (code == '\n')
            text_put(text, "\\n");
        else
            text_put_code(text, code);
    }
    text_put(text, "\"");
}

static void put_value(struct bytes *text, double value)
{
    text_put(text, " %.15g\n", value);
}

static void put_alone(struct bytes *text, const char *name, const char *type, const char *help, double value)
{
    put_head(text, name, type, help);
    text_put(text, "%s", name);
    put_value(text, value);
}

/* --- scenes ----------------------------------------------------------------------------------------------- */

struct job_metric {
    const char *name, *help;
    double (*value)(const struct job_snapshot *job); /* not finite: unknown, so it is left out */
};

static double job_rows(const struct job_snapshot *job)
{
    return job->height;
}

static double job_rows_done(const struct job_snapshot *job)
{
    return job->rows_done;
}

static double job_rows_in_work(const struct job_snapshot *job)
{
    return job->rows_in_work;
}

static double job_rays(const struct job_snapshot *job)
{
    return (double)job->rays;
}

static double job_elapsed(const struct job_snapshot *job)
{
    return job->elapsed_seconds;
}

static double job_remaining(const struct job_snapshot *job)
{
    return job->remaining_seconds < 0 ? NAN : job->remaining_seconds;
}

static double job_rmse(const struct job_snapshot *job)
{
    return job->rmse;
}

static double job_error(const struct job_snapshot *job)
{
    return job->error > 0 ? job->error : NAN;
}

/* Gauges: what an audit finds wrong is taken back. */
static const struct job_metric job_metrics[] = {
    {"weft_job_rows", "Rows of the picture.", job_rows},
    {"weft_job_rows_done", "Rows of the picture that are done.", job_rows_done},
    {"weft_job_rows_in_work", "Rows of the picture that workers hold.", job_rows_in_work},
    {"weft_job_rays", "Rays traced for the rows that are done.", job_rays},
    {"weft_job_elapsed_seconds", "Time since the first band was handed out.", job_elapsed},
    {"weft_job_remaining_seconds", "Estimated time until the picture is done.", job_remaining},
    {"weft_job_rmse_ratio", "Estimated RMSE of the rows that are done, 0 to 1.", job_rmse},
    {"weft_job_rmse_target_ratio", "RMSE that was asked for, 0 to 1.", job_error},
};

/* Where those with figures of their own begin. */
static size_t first_listed_job(const struct snapshot *s)
{
    size_t begun = 0;
    while (begun < s->job_count && s->jobs[begun].state != JOB_WAITING)
        begun++;
    return begun > METRICS_JOBS_MAX ? begun - METRICS_JOBS_MAX : 0;
}

static void put_job_value(struct bytes *text, const struct job_metric *metric, const struct snapshot *s, size_t job)
{
    double value = metric->value(&s->jobs[job]);
    if (!isfinite(value))
        return;
    text_put(text, "%s{job_number=\"%zu\",", metric->name, job + 1);
    put_label(text, "output", s->jobs[job].output);
    text_put(text, "}");
    put_value(text, value);
}

static void put_jobs(struct bytes *text, const struct snapshot *s)
{
    size_t counts[JOB_STATES] = {0}, first = first_listed_job(s);
    for (size_t i = 0; i < s->job_count; i++)
        counts[s->jobs[i].state]++;
    put_head(text, "weft_jobs", "gauge", "Scenes of the command, by state.");
    for (int state = 0; state < JOB_STATES; state++)
        text_put(text, "weft_jobs{state=\"%s\"} %zu\n", job_state_name((enum job_state)state), counts[state]);
    for (size_t m = 0; m < sizeof job_metrics / sizeof *job_metrics; m++) {
        put_head(text, job_metrics[m].name, "gauge", job_metrics[m].help);
        for (size_t i = first; i < s->job_count && i < first + METRICS_JOBS_MAX; i++)
            if (s->jobs[i].state != JOB_WAITING)
                put_job_value(text, &job_metrics[m], s, i);
    }
}

/* --- workers ---------------------------------------------------------------------------------------------- */

struct worker_metric {
    const char *name, *type, *help;
    double (*value)(const struct worker_snapshot *worker);
};

static double worker_threads(const struct worker_snapshot *worker)
{
    return worker->threads;
}

static double worker_held(const struct worker_snapshot *worker)
{
    return worker->bands_held;
}

static double worker_bands(const struct worker_snapshot *worker)
{
    return worker->bands_done;
}

static double worker_rows(const struct worker_snapshot *worker)
{
    return (double)worker->rows_done;
}

static double worker_rays(const struct worker_snapshot *worker)
{
    return (double)worker->rays;
}

static const struct worker_metric worker_metrics[] = {
    {"weft_worker_threads", "gauge", "Threads that render.", worker_threads},
    {"weft_worker_bands_held", "gauge", "Bands that the worker has in hand.", worker_held},
    {"weft_worker_bands_done_total", "counter", "Bands that the worker answered, of surveys too.", worker_bands},
    {"weft_worker_rows_done_total", "counter", "Rows that the worker rendered.", worker_rows},
    {"weft_worker_rays_total", "counter", "Rays that the worker traced.", worker_rays},
};

static void put_worker_value(struct bytes *text, const struct worker_metric *metric,
                             const struct worker_snapshot *worker)
{
    text_put(text, "%s{worker=\"%" PRIu32 "\",", metric->name, worker->number);
    put_label(text, "host", worker->host);
    text_put(text, "}");
    put_value(text, metric->value(worker));
}

static void put_each_worker(struct bytes *text, const struct snapshot *s, const struct worker_metric *metric)
{
    size_t listed = 0;
    put_head(text, metric->name, metric->type, metric->help);
    for (size_t i = 0; i < s->worker_count && listed < METRICS_WORKERS_MAX; i++)
        if (s->workers[i].state != WORKER_GONE) {
            put_worker_value(text, metric, &s->workers[i]);
            listed++;
        }
}

static void put_workers(struct bytes *text, const struct snapshot *s)
{
    size_t states[WORKER_STATES] = {0}, troubles[WORKER_TROUBLES] = {0};
    for (size_t i = 0; i < s->worker_count; i++) {
        states[s->workers[i].state]++;
        troubles[s->workers[i].trouble]++;
    }
    put_head(text, "weft_workers", "gauge", "Workers that ever joined, by state.");
    for (int i = 0; i < WORKER_STATES; i++)
        text_put(text, "weft_workers{state=\"%s\"} %zu\n", worker_state_name((enum worker_state)i), states[i]);
    put_head(text, "weft_workers_in_trouble", "gauge",
             "Workers that ever joined, by the last that went wrong with them.");
    for (int i = TROUBLE_NONE + 1; i < WORKER_TROUBLES; i++)
        text_put(text, "weft_workers_in_trouble{trouble=\"%s\"} %zu\n", worker_trouble_name((enum worker_trouble)i),
                 troubles[i]);
    for (size_t m = 0; m < sizeof worker_metrics / sizeof *worker_metrics; m++)
        put_each_worker(text, s, &worker_metrics[m]);
}

/* --- the whole -------------------------------------------------------------------------------------------- */

/* Of all workers, so that it never goes back. */
static double rays_of(const struct snapshot *s)
{
    double rays = 0;
    for (size_t i = 0; i < s->worker_count; i++)
        rays += (double)s->workers[i].rays;
    return rays;
}

void metrics_write(struct bytes *text, const struct snapshot *s)
{
    put_head(text, "weft_build_info", "gauge", "The version of weft; always 1.");
    text_put(text, "weft_build_info{version=\"%s\"} 1\n", WEFT_VERSION);
    put_alone(text, "weft_elapsed_seconds", "gauge", "Time since the command began.", s->elapsed_seconds);
    put_alone(text, "weft_rays_total", "counter", "Rays that all workers traced, those that are gone too.", rays_of(s));
    put_alone(text, "weft_joins_refused_total", "counter", "How often a worker asked to join and was not let in.",
              s->refused);
    put_jobs(text, s);
    put_workers(text, s);
}
