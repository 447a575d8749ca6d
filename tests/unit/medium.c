/*
 * Stacks of media: pushing, removing from the top and from the middle, and that stacks never change.
 */
#include "trace/medium.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/hash.h"

/* Checks a stack's objects from the top down. */
static void check_stack(const struct medium_pool *pool, uint32_t stack, const uint32_t *expected, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        assert_int_not_equal(stack, MEDIUM_SPACE);
        assert_int_equal(medium_top(pool, stack), expected[i]);
        stack = pool->nodes[stack - 1].below;
    }
    assert_int_equal(stack, MEDIUM_SPACE);
}

static void nested_solids_are_left_in_any_order(void **state)
{
    (void)state;
    struct medium_pool pool = {0};
    uint32_t one = medium_push(&pool, MEDIUM_SPACE, 7), two = medium_push(&pool, one, 8);
    uint32_t three = medium_push(&pool, two, 9);
    check_stack(&pool, three, (uint32_t[]){9, 8, 7}, 3);
    check_stack(&pool, medium_remove(&pool, three, 9), (uint32_t[]){8, 7}, 2);
    check_stack(&pool, medium_remove(&pool, three, 8), (uint32_t[]){9, 7}, 2);
    check_stack(&pool, medium_remove(&pool, three, 7), (uint32_t[]){9, 8}, 2);
    check_stack(&pool, three, (uint32_t[]){9, 8, 7}, 3); /* untouched by all that */
    assert_int_equal(medium_remove(&pool, one, 7), MEDIUM_SPACE);
    medium_pool_finish(&pool);
}

static void leaving_what_one_is_not_in_changes_nothing(void **state)
{
    (void)state;
    struct medium_pool pool = {0};
    uint32_t one = medium_push(&pool, MEDIUM_SPACE, 7);
    assert_int_equal(medium_remove(&pool, one, 8), one);
    assert_int_equal(medium_remove(&pool, MEDIUM_SPACE, 8), MEDIUM_SPACE);
    assert_int_equal(pool.count, 1);
    medium_pool_finish(&pool);
}

static void only_the_topmost_of_equals_goes(void **state)
{
    (void)state;
    struct medium_pool pool = {0};
    uint32_t stack = medium_push(&pool, medium_push(&pool, medium_push(&pool, MEDIUM_SPACE, 7), 8), 7);
    check_stack(&pool, medium_remove(&pool, stack, 7), (uint32_t[]){8, 7}, 2);
    medium_pool_finish(&pool);
}

/* Random pushes and removals beside plain arrays. */
static void stacks_follow_plain_arrays(void **state)
{
    (void)state;
    struct medium_pool pool = {0};
    uint32_t stack = MEDIUM_SPACE, plain[64];
    size_t depth = 0;
    for (uint32_t i = 0; i < 20000; i++) {
        uint32_t object = hash_u32(i) % 12;
        if (depth < 64 && hash_u32(i + 1000000) % 2) {
            stack = medium_push(&pool, stack, object);
            plain[depth++] = object;
        } else {
            stack = medium_remove(&pool, stack, object);
            size_t at = depth;
            while (at > 0 && plain[at - 1] != object)
                at--;
            for (size_t k = at; at > 0 && k < depth; k++)
                plain[k - 1] = plain[k];
            depth -= at > 0;
        }
        uint32_t expected[64];
        for (size_t k = 0; k < depth; k++)
            expected[k] = plain[depth - 1 - k];
        check_stack(&pool, stack, expected, depth);
    }
    medium_pool_clear(&pool);
    assert_int_equal(medium_push(&pool, MEDIUM_SPACE, 3), 1);
    medium_pool_finish(&pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nested_solids_are_left_in_any_order),
        cmocka_unit_test(leaving_what_one_is_not_in_changes_nothing),
        cmocka_unit_test(only_the_topmost_of_equals_goes),
        cmocka_unit_test(stacks_follow_plain_arrays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
