/* Remaining time on recorded renders, whose rows differ in cost up to a hundredfold: what is forecast on the way is
 * compared with what comes to pass (tests/unit/recorded.h).
 *
 * `forecast_recorded.t FILE WORKERS` prints the figures of one file. */
#include "tests/unit/recorded.h"

/* Near the end, a fifth of what is left is less than a band, and nothing tells what that one will take. So errors of
 * less than that share of the whole time are none. */
#define GRAIN 0.03

/* How far off, as a share of the truth, remaining time is at worst, from the second tenth on and as soon as anything is
 * said. */
struct verdict {
    double worst, worst_at; /* when: a share of the whole time, */
    double said_at;         /* and so is this: when something was first said */
};

static double whole_time(const struct recorded *recorded, int workers)
{
    static struct replay replay;
    replay_begin(&replay, recorded, workers);
    replay_until(&replay, INFINITY);
    replay_end(&replay);
    return replay.now;
}

static struct verdict judge(const struct recorded *recorded, int workers)
{
    enum { LOOKS = 200 };
    static struct replay replay;
    struct verdict verdict = {.said_at = 1};
    double whole = whole_time(recorded, workers);
    replay_begin(&replay, recorded, workers);
    for (int i = 0; i < LOOKS; i++) {
        double share = (i + 0.5) / LOOKS, left = (1 - share) * whole;
        replay_until(&replay, share * whole);
        double said = replay_remaining(&replay), off = fabs(said - left);
        verdict.said_at = said >= 0 ? fmin(verdict.said_at, share) : verdict.said_at;
        if (share < 0.1 || said < 0 || off < GRAIN * whole || off / left <= verdict.worst)
            continue;
        verdict.worst = off / left;
        verdict.worst_at = share;
    }
    replay_end(&replay);
    return verdict;
}

/* --- the tests -------------------------------------------------------------------------------------------- */

static const int farms[] = {1, 2, 4}; /* workers */
enum { FARMS = sizeof farms / sizeof *farms };

/* What is not within 20 %, and how far off it is: glass, at whose rim rows cost thirty times what they did; right after
 * the survey nobody knows yet what lies between the soundings. */
struct exception {
    const char *scene;
    double worst;
};

static double allowed(const struct exception *exceptions, const char *scene)
{
    for (; exceptions->scene; exceptions++)
        if (strstr(scene, exceptions->scene))
            return exceptions->worst;
    return 0.2;
}

static void check_all(const char *path, size_t count, const struct exception *exceptions)
{
    static struct recorded recorded;
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    size_t scenes = 0;
    for (; recorded_read(file, &recorded); scenes++)
        for (size_t i = 0; i < FARMS; i++) {
            struct verdict verdict = judge(&recorded, farms[i]);
            if (verdict.worst > allowed(exceptions, recorded.name))
                fail_msg("%s, %d workers: off by %.0f %% at %.0f %%", recorded.name, farms[i], 100 * verdict.worst,
                         100 * verdict.worst_at);
            /* A survey has to end before, which itself takes up to a fifth of these small renders. */
            if (verdict.said_at > (recorded.cells > 0 ? 0.28 : 0.1))
                fail_msg("%s, %d workers: nothing said until %.0f %%", recorded.name, farms[i], 100 * verdict.said_at);
        }
    assert_int_equal(scenes, count);
    fclose(file);
}

static void test_fixed_samples(void **state)
{
    (void)state;
    check_all("tests/unit/recordings/fixed.txt", 48, (struct exception[]){{NULL, 0}});
}

static void test_adaptive_samples(void **state)
{
    (void)state;
    static const struct exception exceptions[] = {
        {"/nested-glass.json", 0.67}, {"/glass.json", 0.24}, {NULL, 0}};
    check_all("tests/unit/recordings/adaptive.txt", 48, exceptions);
}

/* Of a file: the figures of every scene. */
static int print_figures(const char *path, int workers)
{
    static struct recorded recorded;
    FILE *file = fopen(path, "r");
    if (!file)
        return 1;
    while (recorded_read(file, &recorded)) {
        struct verdict verdict = judge(&recorded, workers);
        printf("%-36s off by %3.0f %% at %3.0f %%, said from %3.0f %% on\n", recorded.name, 100 * verdict.worst,
               100 * verdict.worst_at, 100 * verdict.said_at);
    }
    fclose(file);
    return 0;
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fixed_samples),
        cmocka_unit_test(test_adaptive_samples),
    };
    if (argc > 2)
        return print_figures(argv[1], atoi(argv[2]));
    return cmocka_run_group_tests(tests, NULL, NULL);
}
