/* Access control lists: which of them keep a file between its owner and one user. */
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cmocka.h>

#include "wire/access_list.h"
#include "wire/key_file.h"

enum { OWNER = 0x01, USER = 0x02, GROUP_OWNER = 0x04, GROUP = 0x08, MASK = 0x10, OTHER = 0x20, ME = 1234567 };

struct entry {
    uint8_t tag, permissions;
    uint32_t id;
};

/* An attribute's bytes; returns their number. */
static size_t put_list(uint8_t *list, const struct entry *entries, size_t count)
{
    memcpy(list, (uint8_t[]){2, 0, 0, 0}, 4);
    for (size_t i = 0; i < count; i++) {
        const struct entry *e = &entries[i];
        memcpy(list + 4 + 8 * i,
               (uint8_t[]){e->tag, 0, e->permissions, 0, (uint8_t)e->id, (uint8_t)(e->id >> 8),
                           (uint8_t)(e->id >> 16), (uint8_t)(e->id >> 24)}, 8);
    }
    return 4 + 8 * count;
}

static bool is_private(const struct entry *entries, size_t count)
{
    uint8_t list[4 + 8 * 8];
    return access_list_is_private(list, put_list(list, entries, count), ME);
}

/* As systemd leaves it. */
static const struct entry credential[] = {{OWNER, 4, UINT32_MAX}, {USER, 4, ME}, {GROUP_OWNER, 0, UINT32_MAX},
                                          {MASK, 4, UINT32_MAX}, {OTHER, 0, UINT32_MAX}};
enum { COUNT = sizeof credential / sizeof *credential };

static void test_one_user(void **state)
{
    (void)state;
    assert_true(is_private(credential, COUNT));
}

static void test_somebody_else(void **state)
{
    (void)state;
    struct entry entries[COUNT];
    static const struct {
        size_t at;
        struct entry entry;
    } others[] = {{1, {USER, 4, ME + 1}}, {1, {USER, 4, ME + (1 << 24)}}, {1, {GROUP, 4, ME}},
                  {2, {GROUP_OWNER, 4, UINT32_MAX}}, {4, {OTHER, 4, UINT32_MAX}}, {4, {OTHER, 2, UINT32_MAX}},
                  {1, {0x40, 4, ME}}};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        memcpy(entries, credential, sizeof entries);
        entries[others[i].at] = others[i].entry;
        assert_false(is_private(entries, COUNT));
    }
}

static void test_no_list(void **state)
{
    (void)state;
    uint8_t list[4 + 8 * COUNT];
    size_t size = put_list(list, credential, COUNT);
    assert_true(access_list_is_private(list, size, ME));
    for (size_t cut = 0; cut < size; cut++)
        if (cut % 8 != 4 || cut == 4)
            assert_false(access_list_is_private(list, cut, ME));
    list[0] = 3; /* another version */
    assert_false(access_list_is_private(list, size, ME));
}

/* A secret file that has the list, where file systems have lists. */
static void test_key_file(void **state)
{
    (void)state;
    char path[] = "/tmp/weft-list-XXXXXX";
    uint8_t list[4 + 8 * COUNT];
    struct entry entries[COUNT];
    struct error error;
    struct key key;
    int file = mkstemp(path);
    assert_true(file >= 0);
    assert_int_equal(write(file, "JTKVSB%%)wK0E.X)V>+}o?pNmC{O&4W4b!Ni{Lh6", 40), 40);
    memcpy(entries, credential, sizeof entries);
    entries[1].id = geteuid();
    int set = fsetxattr(file, "system.posix_acl_access", list, put_list(list, entries, COUNT), 0);
    bool supported = set == 0 || errno != EOPNOTSUPP;
    if (supported) {
        struct stat info;
        assert_int_equal(set, 0);
        assert_int_equal(fstat(file, &info), 0);
        assert_int_equal(info.st_mode & 07777, 0440);
        assert_int_equal(key_file_read(&key, path, KEY_SECRET, &error), STATUS_OK);
        entries[1].id = geteuid() + 1;
        assert_int_equal(fsetxattr(file, "system.posix_acl_access", list, put_list(list, entries, COUNT), 0), 0);
        assert_int_equal(key_file_read(&key, path, KEY_SECRET, &error), STATUS_INPUT);
    }
    close(file);
    unlink(path);
    if (!supported)
        skip();
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_one_user), cmocka_unit_test(test_somebody_else),
                                       cmocka_unit_test(test_no_list), cmocka_unit_test(test_key_file)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
