/* Audits: which bands are chosen, what is kept of those in doubt, and who vouches for a picture. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "coordinator/audit.h"
#include "coordinator/render_job.h"

static struct audit audit;

static uint32_t chosen(double percent, uint32_t bands)
{
    uint32_t count = 0;
    audit_init(&audit, percent);
    for (uint32_t band = 0; band < bands; band++)
        count += audit_chooses(&audit, band % 7, band % 2 ? PASS_RENDER : PASS_SURVEY, band);
    audit_finish(&audit);
    return count;
}

/* The share is met within six standard deviations; all and none are exact. */
static void test_share(void **state)
{
    (void)state;
    enum { BANDS = 100000 };
    assert_int_equal(chosen(0, BANDS), 0);
    assert_int_equal(chosen(100, BANDS), BANDS);
    static const double percents[] = {0.1, 5, 50};
    for (size_t i = 0; i < sizeof percents / sizeof *percents; i++) {
        double share = percents[i] / 100, deviation = sqrt(BANDS * share * (1 - share));
        assert_true(fabs(chosen(percents[i], BANDS) - BANDS * share) < 6 * deviation);
    }
}

/* The same band is chosen or not however often it is asked; another secret chooses others. */
static void test_secret(void **state)
{
    (void)state;
    struct audit other;
    uint32_t differ = 0;
    audit_init(&audit, 50);
    audit_init(&other, 50);
    for (uint32_t row = 0; row < 1000; row++) {
        bool first = audit_chooses(&audit, 1, PASS_RENDER, row);
        assert_int_equal(audit_chooses(&audit, 1, PASS_RENDER, row), first);
        differ += audit_chooses(&other, 1, PASS_RENDER, row) != first;
    }
    assert_true(differ > 300);
    audit_finish(&audit);
    audit_finish(&other);
}

static void test_doubts(void **state)
{
    (void)state;
    audit_init(&audit, 100);
    for (uint32_t row = 0; row < 40; row += 4) {
        struct doubt doubt = {.job = row % 8 / 4, .pass = PASS_RENDER, .first_row = row, .second = row + 1};
        audit_keep(&audit, &doubt, (const uint8_t *)&row, sizeof row);
    }
    assert_null(audit_find(&audit, 0, PASS_SURVEY, 8));
    assert_null(audit_find(&audit, 1, PASS_RENDER, 8));
    const struct doubt *found = audit_find(&audit, 0, PASS_RENDER, 8);
    assert_non_null(found);
    assert_int_equal(found->second, 9);
    assert_int_equal(found->result.size, 4);
    assert_memory_equal(found->result.data, &(uint32_t){8}, 4);
    audit_drop(&audit, 0, PASS_RENDER, 8);
    audit_drop(&audit, 0, PASS_RENDER, 8);
    assert_null(audit_find(&audit, 0, PASS_RENDER, 8));
    audit_drop_job(&audit, 1);
    for (uint32_t row = 0; row < 40; row += 4)
        assert_int_equal(audit_find(&audit, row % 8 / 4, PASS_RENDER, row) != NULL, row % 8 == 0 && row != 8);
    audit_finish(&audit);
}

/* Whether a picture of two bands, rendered by workers 1 and 2 and confirmed by those, relies on liars alone; whose band
 * it is, or 0. */
static uint32_t relies_on(uint32_t first_confirmed_by, uint32_t second_confirmed_by, const bool lied[4])
{
    struct band_account bands[8] = {[0] = {.rows = 4, .worker = 1, .confirmed_by = first_confirmed_by},
                                    [4] = {.first_row = 4, .rows = 4, .worker = 2, .confirmed_by = second_confirmed_by}};
    struct render_job job = {.settings.height = 8, .bands[PASS_RENDER] = bands};
    uint32_t liar;
    return render_job_relies_on(&job, lied, &liar) ? liar : 0;
}

/* What somebody else has found right can be relied on, unless he lied as well. */
static void test_who_vouches(void **state)
{
    (void)state;
    static const bool nobody[4], first[4] = {[1] = true}, second[4] = {[2] = true}, confirmer[4] = {[3] = true},
                      both[4] = {[1] = true, [3] = true};
    assert_int_equal(relies_on(0, 0, nobody), 0);
    assert_int_equal(relies_on(0, 0, first), 1);
    assert_int_equal(relies_on(0, 0, second), 2);
    assert_int_equal(relies_on(3, 0, first), 0);
    assert_int_equal(relies_on(3, 0, confirmer), 0);
    assert_int_equal(relies_on(3, 0, both), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_share),
        cmocka_unit_test(test_secret),
        cmocka_unit_test(test_doubts),
        cmocka_unit_test(test_who_vouches),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
