/*
 * Signatures: digests of bits that every compiler, option, kernel and CPU must reproduce, of the elementary functions,
 * of the models that the scene reader makes, and of small renders of the proof scene and of every scene in scenes/ and
 * scenes/hard/.
 *
 * Prints TAP by itself and needs only the rooms base to trace, so that it can be built for machines without the test
 * libraries. Runs in the project's root, in the locale that the environment names. BLESS=1 rewrites the file of
 * recorded digests; a changed one means changed pictures, and the commit says why.
 */
#include <glob.h>
#include <locale.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/memory.h"
#include "math/colour.h"
#include "math/elementary.h"
#include "scene/load.h"
#include "tests/isa/scene_bits.h"
#include "tests/random.h"
#include "trace/proof.h"
#include "trace/tracer.h"

#define RECORDED_FILE "tests/isa/SIGNATURES"

enum { WIDTH = 32, HEIGHT = 18, SAMPLES = 2, ARGUMENTS = 4096 };

/* --- recorded digests ------------------------------------------------------------------------------------- */

struct signature {
    char name[128]; /* without spaces */
    char hex[DIGEST_HEX_BYTES];
    bool seen;
};

/* What is recorded, and what has been reported. */
struct record {
    struct signature *signatures;
    size_t count, capacity;
    bool bless; /* names that are not recorded are added */
    int tests, failed;
};

static struct signature *record_add(struct record *record, const char *name, const char *hex)
{
    record->signatures =
        memory_grow(record->signatures, &record->capacity, record->count + 1, sizeof *record->signatures);
    struct signature *added = &record->signatures[record->count++];
    *added = (struct signature){0};
    snprintf(added->name, sizeof added->name, "%s", name);
    snprintf(added->hex, sizeof added->hex, "%s", hex);
    return added;
}

static struct signature *record_find(struct record *record, const char *name)
{
    for (size_t i = 0; i < record->count; i++)
        if (strcmp(record->signatures[i].name, name) == 0)
            return &record->signatures[i];
    return NULL;
}

static void record_read(struct record *record)
{
    FILE *file = fopen(RECORDED_FILE, "r");
    char name[128], hex[DIGEST_HEX_BYTES];
    while (file && fscanf(file, "%127s %64s", name, hex) == 2)
        record_add(record, name, hex);
    if (file)
        fclose(file);
}

/* True if the file was written. */
static bool record_write(const struct record *record)
{
    FILE *file = fopen(RECORDED_FILE, "w");
    if (!file)
        return false;
    for (size_t i = 0; i < record->count; i++)
        fprintf(file, "%-28s %s\n", record->signatures[i].name, record->signatures[i].hex);
    return fclose(file) == 0;
}

/* --- results ---------------------------------------------------------------------------------------------- */

static void report(struct record *record, bool good, const char *name, const char *kernel)
{
    record->tests++;
    record->failed += !good;
    printf("%s %d - %s%s%s\n", good ? "ok" : "not ok", record->tests, name, kernel ? ", kernel " : "",
           kernel ? kernel : "");
}

/* kernel may be NULL: none had a part in it. */
static void compare(struct record *record, const char *name, const char *kernel, const struct digest *digest)
{
    char hex[DIGEST_HEX_BYTES];
    digest_hex(digest, hex);
    struct signature *recorded = record_find(record, name);
    if (!recorded && record->bless)
        recorded = record_add(record, name, hex);
    if (recorded)
        recorded->seen = true;
    bool equal = recorded && strcmp(recorded->hex, hex) == 0;
    report(record, equal, name, kernel);
    if (!equal)
        printf("# expected: %s\n# found:    %s\n", recorded ? recorded->hex : "nothing recorded", hex);
}

static void report_the_unseen(struct record *record)
{
    for (size_t i = 0; i < record->count; i++)
        if (!record->signatures[i].seen) {
            report(record, false, record->signatures[i].name, NULL);
            printf("# recorded, but there is no such thing any more\n");
        }
}

/* --- elementary functions --------------------------------------------------------------------------------- */

struct function {
    const char *name;
    double (*of_one)(double);
    double (*of_two)(double, double); /* either this or of_one */
};

static const struct function functions[] = {
    {"math/sin", math_sin, NULL},
    {"math/cos", math_cos, NULL},
    {"math/sin_degrees", math_sin_degrees, NULL},
    {"math/cos_degrees", math_cos_degrees, NULL},
    {"math/atan2", NULL, math_atan2},
    {"math/exp", math_exp, NULL},
    {"math/log", math_log, NULL},
    {"math/pow", NULL, math_pow},
    {"math/encode_srgb", colour_encode_srgb, NULL},
    {"math/decode_srgb", colour_decode_srgb, NULL},
};

/* A third each: any pattern of bits, moderate numbers, and numbers within 0..1. */
static double argument(uint32_t index, uint32_t draw)
{
    uint64_t bits = (uint64_t)hash_u32(hash_u32(draw) ^ index) << 32 | hash_u32(hash_u32(draw + 1) ^ index);
    double any;
    memcpy(&any, &bits, sizeof any);
    return index % 3 == 0 ? any : index % 3 == 1 ? random_between(index, draw, -700, 700)
                                                 : random_between(index, draw, 0, 1);
}

static struct digest digest_function(const struct function *f)
{
    struct bytes results = {0};
    for (uint32_t i = 0; i < ARGUMENTS; i++) {
        double x = argument(i, 0), y = argument(i, 2);
        double result = f->of_one ? f->of_one(x) : f->of_two(f->of_two == math_pow && i % 8 ? fabs(x) : x, y);
        bytes_put_f64(&results, isnan(result) ? 0.5 : result); /* a NaN's sign and payload are the CPU's affair */
    }
    struct digest digest = digest_of(results.data, results.size);
    bytes_finish(&results);
    return digest;
}

/* --- scenes ----------------------------------------------------------------------------------------------- */

static struct digest digest_picture(const struct plan *plan, const struct kernel *kernel,
                                    const struct sampling *sampling)
{
    struct bytes bits = {0};
    struct tracer *tracer = tracer_create(plan, kernel);
    for (uint32_t y = 0; y < HEIGHT; y++) {
        struct pixel row[WIDTH];
        struct ray_counts counts = {0};
        tracer_area(tracer, sampling, &(struct pixel_area){0, WIDTH, y, y + 1}, row, &counts);
        for (size_t x = 0; x < WIDTH; x++) {
            bits_put_vec3(&bits, row[x].light);
            bytes_put_f64(&bits, row[x].error);
            bytes_put_u32(&bits, row[x].samples);
        }
    }
    tracer_destroy(&tracer);
    struct digest digest = digest_of(bits.data, bits.size);
    bytes_finish(&bits);
    return digest;
}

static void compare_model(struct record *record, const char *name, const struct scene *scene)
{
    char label[128];
    snprintf(label, sizeof label, "model/%s", name);
    struct digest digest = scene_bits_digest(scene);
    compare(record, label, NULL, &digest);
}

/* By a fixed number of samples, and by as many as the pixels need. */
static void compare_pictures(struct record *record, const char *name, const struct scene *scene)
{
    static const struct sampling samplings[] = {{SAMPLES, SAMPLES, 0}, {1, 32, 70}};
    static const char *const labels[] = {"pixels", "adaptive"};
    const struct trace_settings settings = {.width = WIDTH, .height = HEIGHT, .filter = scene->filter};
    struct plan *plan = plan_create(scene, &settings, 1);
    for (size_t sampling = 0; sampling < 2; sampling++) {
        char label[128];
        snprintf(label, sizeof label, "%s/%s", labels[sampling], name);
        for (size_t i = 0; kernel_at(i); i++) {
            struct digest digest = digest_picture(plan, kernel_at(i), &samplings[sampling]);
            compare(record, label, kernel_at(i)->name, &digest);
        }
    }
    plan_destroy(&plan);
}

/* The scene called `name` in `assets`, which it frees; `label` is what its digests are recorded as. */
static void compare_scene(struct record *record, const char *label, const char *name, struct asset_set *assets)
{
    struct scene scene;
    struct error error;
    if (scene_load(&scene, name, assets, &error) == STATUS_OK) {
        compare_model(record, label, &scene);
        compare_pictures(record, label, &scene);
        scene_finish(&scene);
    } else {
        report(record, false, label, NULL);
        printf("# %s\n", error.text);
    }
    asset_set_finish(assets);
}

/* Numbers that decimal conversions have got wrong: halfway between two doubles or nearly so, the ends of the subnormal
 * range, many digits. */
static void compare_hard_numbers(struct record *record)
{
    static const char text[] =
        "{\"camera\": {\"from\": [0.1, -0.0, 4.35], \"at\": [0, 0, 1e-5], \"fov\": 45.000000000000007}, \"lights\": ["
        "{\"type\": \"point\", \"position\": [2.2250738585072011e-308, 2.2250738585072012e-308, 5e-324]},"
        "{\"type\": \"point\", \"position\": [4.9406564584124654e-324, 2.4703282292062327208e-324,"
        " 2.4703282292062328e-324]},"
        "{\"type\": \"point\", \"position\": [9007199254740993, 9007199254740992.99999, 9.5e-3]},"
        "{\"type\": \"point\", \"position\": [1.00000000000000011102230246251565404,"
        " 1.00000000000000011102230246251565405, 123456789012345678901234567890]},"
        "{\"type\": \"point\", \"position\": [8.41e21, 2.0919495182368195e19, 0.30000000000000004]}]}";
    struct asset_set assets = {0};
    struct bytes bytes = {0};
    bytes_put(&bytes, text, sizeof text);
    bytes.size--; /* the NUL follows the text and is not part of it */
    asset_set_add(&assets, "hard-numbers.json", &bytes);
    compare_scene(record, "numbers", "hard-numbers.json", &assets);
}

static void compare_scenes(struct record *record)
{
    glob_t found;
    if (glob("scenes/{,hard/}*.{json,nff}", GLOB_BRACE, NULL, &found) != 0) {
        report(record, false, "there are scenes", NULL);
        return;
    }
    for (size_t i = 0; i < found.gl_pathc; i++) {
        const char *path = found.gl_pathv[i], *name;
        struct asset_set assets;
        if (strstr(path, ".schema.json"))
            continue;
        asset_set_init_disk(&assets, path, &name);
        compare_scene(record, path + strlen("scenes/"), name, &assets);
    }
    globfree(&found);
}

int main(void)
{
    struct record record = {.bless = getenv("BLESS") != NULL};
    setlocale(LC_ALL, "");
    setlocale(LC_COLLATE, "C"); /* by which glob sorts: the order of results is always the same */
    printf("# locale %s, decimal point %s\n", setlocale(LC_NUMERIC, NULL), localeconv()->decimal_point);
    if (!record.bless)
        record_read(&record);
    for (size_t i = 0; i < sizeof functions / sizeof *functions; i++) {
        struct digest digest = digest_function(&functions[i]);
        compare(&record, functions[i].name, NULL, &digest);
    }
    for (size_t i = 0; kernel_at(i); i++) {
        struct digest digest = proof_render(kernel_at(i));
        compare(&record, "pixels/proof", kernel_at(i)->name, &digest);
    }
    compare_hard_numbers(&record);
    compare_scenes(&record);
    report_the_unseen(&record);
    if (record.bless && !record_write(&record))
        report(&record, false, RECORDED_FILE " can be written", NULL);
    printf("1..%d\n", record.tests);
    free(record.signatures);
    return record.failed > 0;
}
