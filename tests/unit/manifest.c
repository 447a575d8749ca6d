/* Manifests: round trips, and that no wrong byte string is taken. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "base/memory.h"
#include "wire/manifest.h"

static struct manifest manifest_of(size_t count)
{
    struct manifest manifest = {.entries = memory_array(count, sizeof(struct manifest_entry)), .count = count};
    for (size_t i = 0; i < count; i++) {
        struct manifest_entry *entry = &manifest.entries[i];
        snprintf(entry->name, sizeof entry->name, "textures/%zu ä.png", i);
        entry->digest = digest_of(&i, sizeof i);
        entry->size = i == 1 ? MANIFEST_ASSET_BYTES_MAX : 7 * i;
    }
    return manifest;
}

static void assert_same(const struct manifest *a, const struct manifest *b)
{
    assert_int_equal(a->count, b->count);
    for (size_t i = 0; i < a->count; i++) {
        assert_string_equal(a->entries[i].name, b->entries[i].name);
        assert_true(digest_equal(&a->entries[i].digest, &b->entries[i].digest));
        assert_int_equal(a->entries[i].size, b->entries[i].size);
    }
}

static void assert_round_trip(struct manifest *manifest)
{
    struct bytes bytes = {0};
    struct manifest back = {0};
    struct error error;
    manifest_encode(manifest, &bytes);
    assert_true(bytes.size <= MANIFEST_BYTES_MAX);
    assert_int_equal(manifest_decode(&back, bytes.data, bytes.size, &error), STATUS_OK);
    assert_same(manifest, &back);
    manifest_finish(&back);
    assert_null(back.entries);
    bytes_finish(&bytes);
    manifest_finish(manifest);
}

static void test_round_trip(void **state)
{
    (void)state;
    struct manifest manifest = manifest_of(3);
    assert_round_trip(&manifest);
}

/* As many entries as there may be, each with the longest name. */
static void test_largest(void **state)
{
    (void)state;
    struct manifest manifest = manifest_of(MANIFEST_COUNT_MAX);
    for (size_t i = 0; i < manifest.count; i++) {
        memset(manifest.entries[i].name, 'n', MANIFEST_NAME_BYTES - 1);
        manifest.entries[i].name[MANIFEST_NAME_BYTES - 1] = '\0';
    }
    assert_round_trip(&manifest);
}

/* Decodes a copy in a block of its own size, so that the sanitizer sees any reading beyond it. */
static void assert_refused(const uint8_t *data, size_t size, const char *says)
{
    uint8_t *exact = memory_array(size, 1);
    memcpy(exact, data, size);
    struct manifest manifest = {0};
    struct error error = {""};
    assert_int_equal(manifest_decode(&manifest, exact, size, &error), STATUS_INPUT);
    if (!strstr(error.text, says))
        fail_msg("expected a sentence with \"%s\", found \"%s\"", says, error.text);
    assert_null(manifest.entries);
    assert_int_equal(manifest.count, 0);
    free(exact);
}

static void test_wrong_length(void **state)
{
    (void)state;
    struct manifest manifest = manifest_of(3);
    struct bytes bytes = {0};
    manifest_encode(&manifest, &bytes);
    for (size_t size = 0; size < bytes.size; size++)
        assert_refused(bytes.data, size, size < 4 ? "1 to 4096 entries, found 0" : "cut short");
    bytes_put_u8(&bytes, 0);
    assert_refused(bytes.data, bytes.size, "bytes, found");
    bytes_finish(&bytes);
    manifest_finish(&manifest);
}

/* One entry with the given parts, behind the given count. */
static void assert_entry_refused(uint32_t count, const char *name, size_t name_bytes, uint64_t size,
                                 const char *says)
{
    struct bytes bytes = {0};
    bytes_put_u32(&bytes, count);
    bytes_put_u16(&bytes, (uint16_t)name_bytes);
    bytes_put(&bytes, name, name_bytes);
    memset(bytes_extend(&bytes, DIGEST_BYTES), 7, DIGEST_BYTES);
    bytes_put_u64(&bytes, size);
    assert_refused(bytes.data, bytes.size, says);
    bytes_finish(&bytes);
}

static void test_wrong_fields(void **state)
{
    (void)state;
    char long_name[MANIFEST_NAME_BYTES];
    memset(long_name, 'n', sizeof long_name);
    assert_entry_refused(0, "a", 1, 0, "found 0");
    assert_entry_refused(2, "a", 1, 0, "entry 1");
    assert_entry_refused(MANIFEST_COUNT_MAX + 1, "a", 1, 0, "found 4097");
    assert_entry_refused(UINT32_MAX, "a", 1, 0, "found 4294967295");
    assert_entry_refused(1, "", 0, 0, "expected a name");
    assert_entry_refused(1, "a\0b", 3, 0, "entry 0");
    assert_entry_refused(1, long_name, sizeof long_name, 0, "1023 bytes");
    assert_entry_refused(1, "a", 1, (uint64_t)MANIFEST_ASSET_BYTES_MAX + 1, "found 1073741825");
    assert_entry_refused(1, "a", 1, UINT64_MAX, "at most");
}

/* Whatever is taken must be exactly what encoding it gives. */
static void test_flipped_bits(void **state)
{
    (void)state;
    struct manifest manifest = manifest_of(4);
    struct bytes bytes = {0};
    manifest_encode(&manifest, &bytes);
    for (int round = 0; round < 20000; round++) {
        size_t bit = (size_t)random() % (8 * bytes.size);
        bytes.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
        struct manifest back = {0};
        struct error error;
        if (manifest_decode(&back, bytes.data, bytes.size, &error) == STATUS_OK) {
            struct bytes again = {0};
            manifest_encode(&back, &again);
            assert_int_equal(again.size, bytes.size);
            assert_memory_equal(again.data, bytes.data, bytes.size);
            bytes_finish(&again);
        } else { /* damage adds up only where it is taken */
            bytes.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
        }
        manifest_finish(&back);
    }
    bytes_finish(&bytes);
    manifest_finish(&manifest);
}

/* `manifest SEED` repeats a run. */
int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_largest),
        cmocka_unit_test(test_wrong_length),
        cmocka_unit_test(test_wrong_fields),
        cmocka_unit_test(test_flipped_bits),
    };
    unsigned seed = argc > 1 ? (unsigned)strtoul(argv[1], NULL, 10) : (unsigned)time(NULL);
    print_message("# seed %u\n", seed);
    srandom(seed);
    return cmocka_run_group_tests_name("manifest", tests, NULL, NULL);
}
