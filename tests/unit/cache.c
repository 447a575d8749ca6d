/* The worker's asset cache: by digest, each once, oldest dropped first. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "worker/cache.h"

static struct digest add(struct cache *cache, const char *text, size_t size)
{
    struct bytes bytes = {0};
    bytes_put(&bytes, text, size);
    cache_add(cache, &bytes);
    assert_null(bytes.data); /* moved */
    return digest_of(text, size);
}

static void test_found_by_digest(void **state)
{
    (void)state;
    struct cache cache = {0};
    struct digest one = add(&cache, "one", 3), two = add(&cache, "two", 3), empty = add(&cache, "", 0);
    struct digest other = digest_of("other", 5);
    assert_memory_equal(cache_find(&cache, &one)->data, "one", 3);
    assert_memory_equal(cache_find(&cache, &two)->data, "two", 3);
    assert_int_equal(cache_find(&cache, &empty)->size, 0);
    assert_null(cache_find(&cache, &other));
    add(&cache, "one", 3);
    assert_int_equal(cache.count, 3); /* not twice */
    cache_finish(&cache);
    assert_null(cache_find(&cache, &one));
}

static void test_oldest_goes_first(void **state)
{
    (void)state;
    struct cache cache = {0};
    struct digest first = add(&cache, "aaaa", 4), second = add(&cache, "bbbb", 4), third = add(&cache, "cccc", 4);
    cache_trim(&cache, 12);
    assert_non_null(cache_find(&cache, &first));
    cache_trim(&cache, 11);
    assert_null(cache_find(&cache, &first));
    assert_non_null(cache_find(&cache, &second));
    cache_trim(&cache, 4);
    assert_null(cache_find(&cache, &second));
    assert_non_null(cache_find(&cache, &third));
    cache_trim(&cache, 0);
    assert_int_equal(cache.count, 0);
    cache_finish(&cache);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_found_by_digest),
        cmocka_unit_test(test_oldest_goes_first),
    };
    return cmocka_run_group_tests_name("cache", tests, NULL, NULL);
}
