/* What becomes of bands that two workers have rendered, and of a worker that lied. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "coordinator/dispatcher_private.h"


/* Worker 0, an earlier run's, is nobody who could be asked again. */
static bool is_trusted(struct dispatcher *d, uint32_t worker)
{
    return worker > 0 && dispatcher_peer(d, worker)->address.own;
}

/* --- verdicts --------------------------------------------------------------------------------------------- */

/* What was accepted is right, if `by` is. After who lied was told: with this the pass may end. */
static void settle(struct dispatcher *d, const struct action *audit, uint32_t by)
{
    render_job_confirm(d->jobs[audit->job], audit->pass, audit->first_row, by);
    audit_drop(&d->audit, audit->job, audit->pass, audit->first_row);
    dispatcher_tell(d, &(struct event){.kind = EVENT_SETTLED, .job = audit->job, .pass = audit->pass,
                                       .first_row = audit->first_row}, NULL);
}

/* All its rows are there, and it has its name or is about to get it. */
static bool is_complete(const struct dispatcher *d, const struct render_job *job)
{
    bool writing = false;
    for (size_t i = 0; i < d->writing_count; i++)
        writing |= d->writing[i] == job;
    return writing || job->state == JOB_DONE;
}

/* Who that is, for a person. */
static const char *describe(struct dispatcher *d, uint32_t worker, char who[PEER_NAME_BYTES])
{
    return worker > 0 ? peer_name(dispatcher_peer(d, worker), who) : "an earlier run";
}

/* Whether each worker has lied, but for `spared`, which has not yet been found out. The caller frees. */
static bool *list_liars(const struct dispatcher *d, uint32_t spared)
{
    bool *lied = memory_array(d->peer_count + 1, sizeof *lied);
    lied[0] = d->earlier_lied;
    for (size_t i = 0; i < d->peer_count; i++)
        lied[i + 1] = d->peers[i].lied;
    lied[spared] = false;
    return lied;
}

/* Pictures that are complete cannot be mended any more; the command must not end as if all were well. They hold rows of
 * this liar, or of an earlier one whom only this one has confirmed. */
static void doubt_done(struct dispatcher *d, uint32_t worker)
{
    bool *before = list_liars(d, worker), *lied = list_liars(d, worker);
    lied[worker] = true;
    for (size_t i = 0; i < d->job_count; i++) {
        const struct render_job *job = d->jobs[i];
        char who[PEER_NAME_BYTES];
        uint32_t liar;
        if (!is_complete(d, job) || render_job_relies_on(job, before, &liar) || !render_job_relies_on(job, lied, &liar))
            continue;
        log_warning("%s: holds rows of %s, and was complete before that was found", job->output_path,
                    describe(d, liar, who));
        if (d->doubtful.text[0] == '\0')
            error_set(&d->doubtful, STATUS_FAILED,
                      "%s: holds rows of %s, which returned wrong ones later; render it again", job->output_path, who);
    }
    free(before);
    free(lied);
}

/* In the journals at once, so that no later run believes what this one has not yet taken back. */
static void disown(struct dispatcher *d, uint32_t worker)
{
    for (size_t i = 0; i < d->job_count; i++) {
        struct render_job *job = d->jobs[i];
        struct error error;
        if (!render_job_is_open(job) || is_complete(d, job))
            continue;
        enum status status = render_job_disown(job, worker, &error);
        if (status != STATUS_OK)
            dispatcher_fail_job(d, job, status, &error);
    }
}

/* Nothing is to be believed that a worker has said. */
static void leave_out(struct dispatcher *d, uint32_t worker)
{
    if (worker > 0)
        dispatcher_peer(d, worker)->lied = true;
    else
        d->earlier_lied = true;
    doubt_done(d, worker);
    disown(d, worker);
    dispatcher_tell(d, &(struct event){.kind = EVENT_LIAR, .worker = worker}, NULL);
}

/* With a liar goes its machine: it may have joined more than once, and what made one process compute wrong bytes is
 * likely to do the same to the next. Rows that an earlier run had may be of it too: nobody knows whose they are. */
static void leave_out_machine(struct dispatcher *d, uint32_t worker)
{
    uint32_t machine = dispatcher_peer(d, worker)->machine;
    machines_find(&d->machines, machine)->lied = true;
    for (size_t i = 0; i < d->peer_count; i++) {
        const struct peer *peer = &d->peers[i];
        if (!peer->lied && !peer->address.own && peer->machine == machine)
            leave_out(d, peer->number);
    }
    for (size_t i = 0; i < d->job_count; i++)
        if (d->jobs[i]->kept_count > 0) {
            leave_out(d, 0);
            return;
        }
}

static void expose(struct dispatcher *d, uint32_t worker, const struct action *audit)
{
    const struct render_job *job = d->jobs[audit->job];
    const struct peer *peer = worker > 0 ? dispatcher_peer(d, worker) : NULL;
    char who[PEER_NAME_BYTES], rows[ROWS_NAME_BYTES];
    if (peer && peer->lied) /* it is known for that */
        return;
    log_warning("%s returned wrong bytes for %s of %s; %s", describe(d, worker, who),
                render_job_rows_name(audit->pass, audit->first_row, audit->rows, rows), job->scene_path,
                peer ? "its machine is left out, and what it returned is rendered again" : "all is rendered anew");
    if (peer)
        leave_out_machine(d, worker);
    else
        leave_out(d, 0);
}

/* Two workers of this machine do not agree: then nobody can be believed. */
static void give_up(struct dispatcher *d, const struct action *audit)
{
    struct error error, ignored;
    render_job_restart(d->jobs[audit->job], &ignored); /* so that the next run believes nothing of it */
    error_set(&error, STATUS_FAILED,
              "%s: workers %u and %u, both of this machine, returned different bytes for rows %u to %u%s; its memory "
              "or processor may be faulty", d->jobs[audit->job]->scene_path, audit->about, audit->worker,
              audit->first_row, audit->first_row + audit->rows - 1,
              audit->pass == PASS_SURVEY ? " of the survey" : "");
    dispatcher_fail_job(d, d->jobs[audit->job], STATUS_FAILED, &error);
}

/* --- comparing -------------------------------------------------------------------------------------------- */

/* What a second worker returned differs from what was accepted. */
static void judge_two(struct dispatcher *d, const struct action *audit, const uint8_t *result, size_t size)
{
    bool first = is_trusted(d, audit->about), second = is_trusted(d, audit->worker);
    if (first && second) {
        give_up(d, audit);
    } else if (second) {
        expose(d, audit->about, audit);
    } else if (first) {
        expose(d, audit->worker, audit);
        settle(d, audit, audit->about);
    } else {
        const struct doubt doubt = {.job = audit->job, .pass = audit->pass, .first_row = audit->first_row,
                                    .second = audit->worker};
        audit_keep(&d->audit, &doubt, result, size);
        dispatcher_tell(d, &(struct event){.kind = EVENT_JUDGE, .job = audit->job, .pass = audit->pass,
                                           .first_row = audit->first_row}, NULL);
    }
}

/* Now a trusted worker has returned what is right: each of the two may have lied. */
static void judge_by_third(struct dispatcher *d, const struct action *audit, const struct doubt *doubt,
                           bool first_is_right, const uint8_t *result)
{
    uint32_t second = doubt->second;
    bool second_is_right = memcmp(doubt->result.data, result, doubt->result.size) == 0;
    if (!second_is_right)
        expose(d, second, audit);
    if (first_is_right)
        settle(d, audit, audit->worker);
    else
        expose(d, audit->about, audit); /* that settles it too: the band is undone */
}

void dispatcher_audit(struct dispatcher *d, const struct action *audit, const uint8_t *result)
{
    const struct render_job *job = d->jobs[audit->job];
    const struct doubt *doubt = audit_find(&d->audit, audit->job, audit->pass, audit->first_row);
    struct error error;
    bool same;
    peer_answer_band(dispatcher_peer(d, audit->worker), audit->job, audit->pass, audit->first_row, d->now_ms);
    enum status status = render_job_compare(job, audit->pass, audit->first_row, result, &same, &error);
    if (status != STATUS_OK) {
        dispatcher_fail_job(d, d->jobs[audit->job], status, &error);
        return;
    }
    d->jobs[audit->job]->audited += !doubt;
    if (doubt)
        judge_by_third(d, audit, doubt, same, result);
    else if (same)
        settle(d, audit, audit->worker);
    else
        judge_two(d, audit, result, render_job_result_bytes(job, audit->pass, audit->rows));
}

/* --- taking back ------------------------------------------------------------------------------------------ */

void dispatcher_undo(struct dispatcher *d, const struct action *action)
{
    struct render_job *job = d->jobs[action->job];
    struct error error;
    audit_drop(&d->audit, action->job, action->pass, action->first_row);
    enum status status = render_job_undo(job, action->first_row, &error); /* the journal knows */
    if (status != STATUS_OK)
        dispatcher_fail_job(d, job, status, &error);
    d->undoing = true;
}

void dispatcher_end_undoing(struct dispatcher *d)
{
    for (size_t i = 0; d->undoing && i < d->job_count; i++) {
        if (!d->jobs[i]->undone)
            continue;
        render_job_end_undoing(d->jobs[i]);
        dispatcher_begin_forecast(d, (uint32_t)i);
    }
    d->undoing = false;
}

void dispatcher_restart(struct dispatcher *d, const struct action *action)
{
    struct render_job *job = d->jobs[action->job];
    struct error error;
    audit_drop_job(&d->audit, action->job);
    job->state = JOB_WAITING;
    enum status status = render_job_restart(job, &error);
    if (status != STATUS_OK)
        dispatcher_fail_job(d, job, status, &error);
}
