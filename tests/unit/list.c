/* Lists whose links are members of what is listed. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "coordinator/list.h"

struct thing {
    int number;
    struct list in_list;
};

static void check(struct list *list, const int *numbers, size_t count)
{
    size_t found = 0;
    list_each(link, list) {
        assert_true(found < count);
        assert_int_equal(list_owner(link, struct thing, in_list)->number, numbers[found++]);
        assert_ptr_equal(link->next->previous, link);
    }
    assert_int_equal(found, count);
    assert_int_equal(list_is_empty(list), count == 0);
}

static void test_coming_and_going(void **state)
{
    (void)state;
    struct list list, other;
    struct thing things[3] = {{.number = 1}, {.number = 2}, {.number = 3}};
    list_empty(&list);
    list_empty(&other);
    check(&list, NULL, 0);
    list_leave(&things[0].in_list); /* it is in none */
    for (int i = 0; i < 3; i++)
        list_append(&list, &things[i].in_list);
    check(&list, (int[]){1, 2, 3}, 3);
    list_append(&list, &things[0].in_list); /* again: to the end */
    check(&list, (int[]){2, 3, 1}, 3);
    list_append(&other, &things[1].in_list);
    check(&list, (int[]){3, 1}, 2);
    check(&other, (int[]){2}, 1);
    list_leave(&things[1].in_list);
    assert_false(list_is_in(&things[1].in_list));
    assert_true(list_is_in(&things[2].in_list));
    check(&other, NULL, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_coming_and_going)};
    return cmocka_run_group_tests_name("lists", tests, NULL, NULL);
}
