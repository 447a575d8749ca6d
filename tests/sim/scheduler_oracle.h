/*
 * What the scheduler promised: a model, which knows nothing of how it works, takes every action and says what is wrong.
 */
#ifndef WEFT_TESTS_SCHEDULER_ORACLE_H
#define WEFT_TESTS_SCHEDULER_ORACLE_H

#include "tests/sim/scheduler_world.h"

static void drop_worker(uint32_t number, bool by_fault)
{
    struct worker *w = &world.workers[number];
    w->present = false;
    w->held = 0;
    for (uint64_t i = 1; i <= world.lease_count; i++) {
        struct lease *lease = &world.leases[i];
        if (lease->worker != number || lease->state != OPEN)
            continue;
        lease->state = LOST;
        struct job *job = &world.jobs[lease->job];
        for (uint32_t row = lease->first_row; row < lease->first_row + lease->rows; row++) {
            job->losses[row] += by_fault;
            job->lost[lease->audits][row].count += by_fault;
            job->lost[lease->audits][row].workers |= (uint64_t)by_fault << number;
        }
    }
}

/* Whether losses of the two count as one. */
static bool count_as_one(uint32_t a, uint32_t b)
{
    const struct worker *one = &world.workers[a], *other = &world.workers[b];
    return a == b || (!one->trusted && !other->trusted && one->machine > 0 && one->machine == other->machine);
}

/* The band, or audit, was lost so often that others are to try it than this worker and those who count as the same. */
static bool is_dreaded_by(const struct job *job, bool audits, uint32_t row, uint32_t worker)
{
    bool has_lost = false;
    for (uint32_t i = 1; i <= world.worker_count; i++)
        has_lost |= (job->lost[audits][row].workers >> i & 1) && count_as_one(i, worker);
    return has_lost && job->lost[audits][row].count >= SCHEDULER_LOSSES_MAX;
}

static uint32_t count_losers(uint64_t workers)
{
    uint32_t count = 0;
    for (uint32_t i = 1; i <= world.worker_count; i++) {
        bool is_first = workers >> i & 1;
        for (uint32_t k = 1; k < i; k++)
            is_first &= !(workers >> k & 1) || !count_as_one(i, k);
        count += is_first;
    }
    return count;
}

/* The bands of open leases are either the same or have no row in common. */
static void check_overlap(const struct action *a)
{
    for (uint64_t i = 1; i <= world.lease_count; i++) {
        const struct lease *lease = &world.leases[i];
        if (lease->state != OPEN || lease->job != a->job)
            continue;
        bool same = lease->first_row == a->first_row && lease->rows == a->rows;
        bool apart = lease->first_row + lease->rows <= a->first_row || a->first_row + a->rows <= lease->first_row;
        require(same || apart, "lease %llu cuts through a band", (unsigned long long)a->lease);
        require(!same || lease->worker != a->worker, "worker %u got a band twice", a->worker);
    }
}

static void check_announce(const struct action *a)
{
    struct worker *w = &world.workers[a->worker];
    require(w->present && !w->draining, "announced to worker %u, which is not there", a->worker);
    require(!w->announced[a->job] && !world.jobs[a->job].over, "job %u announced again or too late", a->job);
    w->announced[a->job] = true;
}

/* The worker is of the same machine as who rendered the audited band. */
static bool is_near(const struct job *job, uint32_t first_row, uint32_t worker)
{
    uint32_t machine = world.workers[worker].machine;
    return machine > 0 && world.workers[job->band_worker[first_row]].machine == machine;
}

/* The audit there waits or is leased, and the worker may render it: a trusted one perhaps even if it is near. */
static bool is_audit_for(const struct job *job, uint32_t first_row, uint32_t worker)
{
    const struct audit *audit = &job->audits[first_row];
    bool has_rendered = audit->renderers >> worker & 1, is_trusted = world.workers[worker].trusted;
    return audit->open && !audit->unsettled && !has_rendered && (is_trusted || !audit->judges) &&
           (is_trusted || !is_near(job, first_row, worker));
}

static bool is_audited(const void *context, uint32_t job, enum render_pass pass, uint32_t first_row)
{
    (void)context;
    return hash_u32(history.seed + 1000 * first_row + 10 * job + pass) % 100 < world.audited;
}

/* The scheduler accepts the band, or has kept it (worker 0). */
static void note_band(uint32_t number, uint32_t first_row, uint32_t rows, uint32_t worker, bool lies)
{
    struct job *job = &world.jobs[number];
    job->band_rows[first_row] = rows;
    job->band_worker[first_row] = worker;
    job->accepted_rows += rows;
    for (uint32_t row = first_row; row < first_row + rows; row++)
        job->accepted[row] = true;
    job->lost[true][first_row].count = 0; /* its audit is a new one */
    job->lost[true][first_row].workers = 0;
    job->audits[first_row] = (struct audit){.open = is_audited(NULL, number, job->pass, first_row),
                                            .renderers = UINT64_C(1) << worker,
                                            .liars = (uint64_t)lies << worker,
                                            .turn = job->audits[first_row].turn};
}

static uint32_t allowance(const struct worker *w)
{
    uint32_t most = w->threads < world.newcomer_bands ? w->threads : world.newcomer_bands;
    bool limited = world.newcomer_bands > 0 && !w->proven && !w->trusted;
    return limited && most < w->credit ? most : w->credit;
}

static void check_grant(const struct action *a)
{
    struct worker *w = &world.workers[a->worker];
    struct job *job = &world.jobs[a->job];
    require(a->lease == world.lease_count + 1 && a->lease < LEASES_MAX, "lease %llu", (unsigned long long)a->lease);
    require(w->present && !w->draining && w->ready[a->job], "worker %u cannot take a band", a->worker);
    require(w->held < allowance(w), "worker %u got more than it may hold", a->worker);
    require(a->pass == job->pass, "job %u is not at pass %d", a->job, (int)a->pass);
    require(!job->over && a->rows >= 1 && a->first_row + a->rows <= job->rows[a->pass], "rows outside of an open job");
    bool audits = job->accepted[a->first_row];
    require(!audits || is_audit_for(job, a->first_row, a->worker), "row %u handed out again", a->first_row);
    require(!audits || job->band_rows[a->first_row] == a->rows, "row %u: other rows are audited", a->first_row);
    for (uint32_t row = a->first_row; row < a->first_row + a->rows; row++)
        require(job->accepted[row] == audits, "row %u handed out again", row);
    require(!is_dreaded_by(job, audits, a->first_row, a->worker), "worker %u is to try row %u once more", a->worker,
            a->first_row);
    check_overlap(a);
    w->held++;
    world.leases[++world.lease_count] = (struct lease){.worker = a->worker, .job = a->job, .pass = a->pass,
                                                       .first_row = a->first_row, .rows = a->rows, .audits = audits,
                                                       .lies = chance(w->lies)};
}

static void check_accept(const struct action *a, const struct event *event)
{
    struct lease *lease = &world.leases[event->lease];
    struct job *job = &world.jobs[a->job];
    require(a->worker == event->worker && a->lease_ms >= 0, "accepted from another worker");
    require(event->kind == EVENT_RESULT && lease->state == OPEN && lease->worker == event->worker && !lease->audits,
            "accepted what is not an answer");
    require(lease->job == a->job && lease->pass == a->pass && a->pass == job->pass, "accepted for another pass");
    require(lease->first_row == a->first_row && lease->rows == a->rows,
            "accepted other rows than were answered");
    for (uint32_t row = a->first_row; row < a->first_row + a->rows; row++)
        require(!job->accepted[row], "row %u accepted twice", row);
    note_band(a->job, a->first_row, a->rows, a->worker, lease->lies);
    job->surveyors |= a->pass == PASS_SURVEY ? UINT64_C(1) << a->worker : 0;
    lease->state = ANSWERED;
    world.workers[lease->worker].held--;
}

/* The caller will say in a while what it makes of it. */
static void check_audited(const struct action *a, const struct event *event)
{
    struct lease *lease = &world.leases[event->lease];
    struct job *job = &world.jobs[a->job];
    struct audit *audit = &job->audits[a->first_row];
    require(event->kind == EVENT_RESULT && lease->state == OPEN && lease->worker == event->worker && lease->audits,
            "audited what is not an answer");
    require(a->worker == event->worker && lease->job == a->job && lease->first_row == a->first_row &&
            lease->rows == a->rows && a->pass == job->pass && a->about == job->band_worker[a->first_row],
            "audited other rows than were answered");
    require(is_audit_for(job, a->first_row, a->worker), "row %u is not to be audited", a->first_row);
    lease->state = ANSWERED;
    world.workers[lease->worker].held--;
    audit->unsettled = true;
    audit->renderers |= UINT64_C(1) << a->worker;
    audit->last = a->worker;
    audit->liars |= (uint64_t)lease->lies << a->worker;
    struct happening finds = {FINDS, {.job = a->job, .pass = a->pass, .first_row = a->first_row}, ++audit->turn};
    queue_put(&world.happenings, history.now_ms + (chance(50) ? 0 : draw(0, 500)), &finds, sizeof finds);
    tally.audited++;
}

static void check_undo(const struct action *a, const struct event *event)
{
    struct job *job = &world.jobs[a->job];
    require(event->kind == EVENT_LIAR && !job->over && a->pass == job->pass, "row %u is undone", a->first_row);
    require(job->band_rows[a->first_row] == a->rows && job->band_worker[a->first_row] == event->worker,
            "row %u is undone, which worker %u has not rendered", a->first_row, event->worker);
    job->band_rows[a->first_row] = 0;
    job->accepted_rows -= a->rows;
    job->audits[a->first_row] = (struct audit){.turn = job->audits[a->first_row].turn};
    for (uint32_t row = a->first_row; row < a->first_row + a->rows; row++)
        job->accepted[row] = false;
    tally.undone++;
}

static void check_unleased(uint32_t job)
{
    for (uint64_t i = 1; i <= world.lease_count; i++)
        require(world.leases[i].job != job || world.leases[i].state != OPEN, "job %u is leased", job);
}

/* The job as it begins a pass: answers to audits of an earlier one have other numbers. */
static void begin_pass(struct job *job, enum render_pass pass)
{
    struct job begun = {.pass = pass, .surveyors = job->surveyors, .kept = job->kept};
    memcpy(begun.rows, job->rows, sizeof begun.rows);
    for (uint32_t row = 0; row < ROWS_MAX; row++)
        begun.audits[row].turn = job->audits[row].turn;
    *job = begun;
}

static void check_restart(const struct action *a, const struct event *event)
{
    struct job *job = &world.jobs[a->job];
    bool rests = event->worker ? job->surveyors >> event->worker & 1 : job->kept;
    require(event->kind == EVENT_LIAR && !job->over && rests, "job %u begins again", a->job);
    check_unleased(a->job);
    job->surveyors = 0;
    job->kept = false;
    begin_pass(job, job->rows[PASS_SURVEY] ? PASS_SURVEY : PASS_RENDER);
    tally.restarted++;
}

static void check_need(void)
{
    require(!world.asked, "a trusted worker is asked for again");
    world.asked = true;
    require(world.worker_count < WORKERS_MAX + SPARES_MAX, "too many trusted workers are asked for");
    uint32_t number = ++world.worker_count;
    world.workers[number] = (struct worker){.trusted = true, .machine = 1, .threads = draw(1, 4), .credit = draw(1, 4),
                                            .ms_a_row = draw(1, 300)};
    happen(JOINS, history.now_ms + draw(0, 5000), (struct event){.worker = number});
    tally.asked++;
}

/* After a lie has come out, nothing of open jobs rests on it. */
static void check_liar(uint32_t liar)
{
    require(!world.workers[liar].present, "worker %u lied and is there", liar);
    for (uint32_t i = 0; i < world.jobs_begun; i++) {
        const struct job *job = &world.jobs[i];
        bool rests = !job->over && (liar ? job->surveyors >> liar & 1 : job->kept);
        for (uint32_t row = 0; row < ROWS_MAX; row++)
            rests |= !job->over && job->band_rows[row] > 0 && job->band_worker[row] == liar;
        require(!rests, "job %u rests on worker %u, who lied", i, liar);
    }
}

static void check_revoke(const struct action *a)
{
    struct lease *lease = &world.leases[a->lease];
    require(a->lease <= world.lease_count && lease->state == OPEN && lease->worker == a->worker,
            "revoked what is not a lease of worker %u", a->worker);
    lease->state = REVOKED;
    world.workers[a->worker].held--;
    tally.revoked++;
}

static void check_expel(const struct action *a, const struct event *event)
{
    struct worker *w = &world.workers[a->worker];
    require(w->present, "worker %u expelled again", a->worker);
    if (a->liar)
        require(event->kind == EVENT_LIAR && event->worker == a->worker, "worker %u expelled as a liar", a->worker);
    else if (a->stuck)
        require(w->fate == HANGS && w->fated, "worker %u expelled though it got on", a->worker);
    else
        require(history.now_ms - w->heard_ms >= SILENCE_MS, "worker %u expelled though it spoke", a->worker);
    drop_worker(a->worker, !a->stuck && !a->liar);
    *(a->liar ? &tally.liars : a->stuck ? &tally.stuck : &tally.expelled) += 1;
}

static void check_settled(const struct job *job)
{
    for (uint32_t row = 0; row < ROWS_MAX; row++) {
        const struct audit *audit = &job->audits[row];
        require(!audit->open, "a pass ends before its row %u is audited", row);
        bool was_audited = audit->renderers & (audit->renderers - 1); /* more than one has rendered it */
        require(!was_audited || !(audit->liars >> job->band_worker[row] & 1), "a pass ends with a lie at row %u", row);
    }
}

/* Nothing of the survey is missing, and nothing of it is out any more. */
static void check_surveyed(const struct action *a)
{
    struct job *job = &world.jobs[a->job];
    require(!job->over && job->pass == PASS_SURVEY, "job %u is surveyed twice", a->job);
    require(job->accepted_rows == job->rows[PASS_SURVEY], "job %u surveyed with holes", a->job);
    check_unleased(a->job);
    check_settled(job);
    begin_pass(job, PASS_RENDER);
    tally.surveyed++;
}

static void check_over(const struct action *a)
{
    struct job *job = &world.jobs[a->job];
    require(!job->over, "job %u is over twice", a->job);
    job->over = true;
    world.jobs_over++;
    for (uint32_t row = a->first_row; a->kind == ACTION_FAIL && row < a->first_row + a->rows; row++)
        require(count_losers(job->lost[0][row].workers) >= SCHEDULER_LOSSES_MAX ||
                count_losers(job->lost[1][row].workers) >= SCHEDULER_LOSSES_MAX,
                "failed for row %u, lost %u times", row, job->losses[row]);
    require(a->kind == ACTION_FAIL ? a->pass == job->pass
                                   : job->pass == PASS_RENDER && job->accepted_rows == job->rows[PASS_RENDER],
            "job %u done with holes", a->job);
    if (a->kind == ACTION_DONE)
        check_settled(job);
    *(a->kind == ACTION_FAIL ? &tally.failed : &tally.done) += 1;
    for (uint32_t i = 1; i <= world.worker_count; i++) {
        const struct worker *w = &world.workers[i];
        require(!w->present || w->announced[a->job] == w->ended[a->job], "worker %u not told of the end", i);
    }
}

static void check_action(const struct action *a, const struct event *event)
{
    switch (a->kind) {
    case ACTION_ANNOUNCE:
        check_announce(a);
        break;
    case ACTION_GRANT:
        check_grant(a);
        break;
    case ACTION_ACCEPT:
        check_accept(a, event);
        break;
    case ACTION_ACK:
        require(event->kind == EVENT_RESULT && a->worker == event->worker && a->lease == event->lease, "a stray ack");
        break;
    case ACTION_REVOKE:
        check_revoke(a);
        break;
    case ACTION_END:
        require(!world.workers[a->worker].ended[a->job], "ended twice");
        world.workers[a->worker].ended[a->job] = true;
        break;
    case ACTION_EXPEL:
        check_expel(a, event);
        break;
    case ACTION_SURVEYED:
        check_surveyed(a);
        break;
    case ACTION_DONE:
    case ACTION_FAIL:
        check_over(a);
        break;
    case ACTION_AUDITED:
        check_audited(a, event);
        break;
    case ACTION_UNDO:
        check_undo(a, event);
        break;
    case ACTION_RESTART:
        check_restart(a, event);
        break;
    case ACTION_NEED_TRUSTED:
        check_need();
        break;
    }
}

/* Rows of open leases; `mark` gets them, one flag each. */
static uint32_t leased_rows(uint32_t job, bool mark[ROWS_MAX])
{
    uint32_t count = 0;
    memset(mark, 0, ROWS_MAX * sizeof *mark);
    for (uint64_t i = 1; i <= world.lease_count; i++) {
        const struct lease *lease = &world.leases[i];
        if (lease->state != OPEN || lease->job != job || lease->audits || mark[lease->first_row])
            continue;
        memset(mark + lease->first_row, true, lease->rows * sizeof *mark);
        count += lease->rows;
    }
    return count;
}

/* No audit waits for a worker that has room and may render it. */
static void check_audits_wait(uint32_t number)
{
    const struct job *job = &world.jobs[number];
    bool leased[ROWS_MAX] = {false};
    for (uint64_t i = 1; i <= world.lease_count; i++)
        if (world.leases[i].state == OPEN && world.leases[i].job == number)
            leased[world.leases[i].first_row] = true;
    for (uint32_t row = 0; !job->over && row < ROWS_MAX; row++)
        for (uint32_t i = 1; job->audits[row].open && !leased[row] && i <= world.worker_count; i++) {
            const struct worker *w = &world.workers[i];
            bool room = w->present && !w->draining && w->ready[number] && w->held < allowance(w);
            bool may = is_audit_for(job, row, i) && (job->audits[row].judges || !is_near(job, row, i)) &&
                       !is_dreaded_by(job, true, row, i);
            require(!room || !may, "the audit of row %u waits though worker %u has room", row, i);
        }
}

static bool has_room(const struct worker *w, uint32_t job)
{
    return w->present && !w->draining && w->ready[job] && w->held < allowance(w) && w->held < w->threads;
}

/* Rows that nobody has, because only those have room who have lost them too often. */
static uint32_t dreaded_rows(uint32_t number, const bool leased[ROWS_MAX])
{
    const struct job *job = &world.jobs[number];
    uint32_t count = 0;
    for (uint32_t row = 0; row < job->rows[job->pass]; row++) {
        bool dreaded = !job->accepted[row] && !leased[row];
        for (uint32_t i = 1; i <= world.worker_count; i++)
            dreaded &= !has_room(&world.workers[i], number) || is_dreaded_by(job, false, row, i);
        count += dreaded;
    }
    return count;
}

/* Between events: both sides count alike, nobody silent is left, and no row waits for a worker that has room (for the
 * last rows: a thread without a band). */
static void check_rest(const struct event *event)
{
    bool mark[ROWS_MAX], room[JOBS_MAX] = {false};
    for (uint32_t i = 1; i <= world.worker_count; i++) {
        const struct worker *w = &world.workers[i];
        require(!w->present || history.now_ms - w->heard_ms < SILENCE_MS, "worker %u is silent and still there", i);
        for (uint32_t job = 0; job < world.jobs_begun; job++)
            room[job] |= has_room(w, job);
    }
    for (uint32_t job = 0; job < world.jobs_begun; job++) {
        uint32_t leased = leased_rows(job, mark);
        const struct job *j = &world.jobs[job];
        require(leased == scheduler_rows_leased(world.scheduler, job), "job %u: other rows are leased", job);
        require(!j->over || leased == 0, "job %u is over and leased", job);
        require(j->over || !room[job] || j->accepted_rows + leased == j->rows[j->pass] ||
                j->accepted_rows + leased + dreaded_rows(job, mark) == j->rows[j->pass], "rows of job %u wait", job);
    }
    for (uint64_t i = 1; i <= world.lease_count; i++) {
        const struct lease *lease = &world.leases[i];
        bool held = scheduler_lease(world.scheduler, lease->worker, i, &(struct action){.kind = ACTION_GRANT});
        require(held == (lease->state == OPEN), "lease %llu is not in its state", (unsigned long long)i);
    }
    for (uint32_t job = 0; job < world.jobs_begun; job++)
        check_audits_wait(job);
    bool due = scheduler_deadline(world.scheduler) <= history.now_ms;
    require(!due || event->kind != EVENT_TICK, "the deadline is past");
}

#endif
