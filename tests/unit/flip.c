/*
 * FLIP against its definition (Andersson et al., HPG 2020), written down here a second time in long double: plain sums
 * over two dimensions, colours by the primaries and the white, nothing cut into tiles.
 */
#include "image/flip.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/memory.h"
#include "math/colour.h"
#include "tests/random.h"

/* An error is a float, good to 6e-8; and of what rounding leaves of a gradient that is 0, 1e-16, the root is taken:
 * 1e-8, times at most 1/e. */
static const double TOLERANCE = 1e-7;

static const long double PI = 3.14159265358979323846264338327950288L;

/* --- the definition: colours ------------------------------------------------------------------------------ */

struct colour {
    long double c[3];
};

static long double to_xyz[3][3]; /* linear red, green, blue to X, Y, Z divided by white's */

static long double determinant(const long double a[3], const long double b[3], const long double c[3])
{
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* Cramer's rule gives the weights with which the three primaries add up to white. */
static int find_matrix(void **state)
{
    (void)state;
    const long double x[4] = {0.64L, 0.30L, 0.15L, 0.31271L}, y[4] = {0.33L, 0.60L, 0.06L, 0.32902L};
    long double v[4][3];
    for (int i = 0; i < 4; i++) {
        v[i][0] = x[i] / y[i];
        v[i][1] = 1;
        v[i][2] = (1 - x[i] - y[i]) / y[i];
    }
    long double all = determinant(v[0], v[1], v[2]);
    long double weights[3] = {determinant(v[3], v[1], v[2]) / all, determinant(v[0], v[3], v[2]) / all,
                              determinant(v[0], v[1], v[3]) / all};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            to_xyz[k][i] = weights[i] * v[i][k] / v[3][k];
    return 0;
}

static struct colour xyz_of(struct colour rgb)
{
    struct colour xyz;
    for (int k = 0; k < 3; k++)
        xyz.c[k] = to_xyz[k][0] * rgb.c[0] + to_xyz[k][1] * rgb.c[1] + to_xyz[k][2] * rgb.c[2];
    return xyz;
}

static long double cut(long double value)
{
    return value < 0 ? 0 : value > 1 ? 1 : value;
}

/* Cramer's rule again: determinants of the primaries' X, Y, Z. */
static struct colour rgb_of(struct colour xyz)
{
    struct colour red = xyz_of((struct colour){{1, 0, 0}}), green = xyz_of((struct colour){{0, 1, 0}});
    struct colour blue = xyz_of((struct colour){{0, 0, 1}});
    long double all = determinant(red.c, green.c, blue.c);
    return (struct colour){{determinant(xyz.c, green.c, blue.c) / all, determinant(red.c, xyz.c, blue.c) / all,
                            determinant(red.c, green.c, xyz.c) / all}};
}

static struct colour ycxcz_of(struct colour rgb)
{
    struct colour v = xyz_of(rgb);
    return (struct colour){{116 * v.c[1] - 16, 500 * (v.c[0] - v.c[1]), 200 * (v.c[1] - v.c[2])}};
}

static struct colour rgb_of_ycxcz(struct colour v)
{
    long double y = (v.c[0] + 16) / 116;
    return rgb_of((struct colour){{y + v.c[1] / 500, y, y - v.c[2] / 200}});
}

static struct colour hunt_lab_of(struct colour rgb)
{
    struct colour v = xyz_of(rgb);
    for (int k = 0; k < 3; k++)
        v.c[k] = v.c[k] > 216.0L / 24389 ? cbrtl(v.c[k]) : v.c[k] * 841 / 108 + 4.0L / 29;
    long double lightness = 116 * v.c[1] - 16, chroma = lightness / 100;
    return (struct colour){{lightness, chroma * 500 * (v.c[0] - v.c[1]), chroma * 200 * (v.c[1] - v.c[2])}};
}

static long double hyab(struct colour a, struct colour b)
{
    return fabsl(a.c[0] - b.c[0]) + hypotl(a.c[1] - b.c[1], a.c[2] - b.c[2]);
}

static long double colour_error(struct colour a, struct colour b)
{
    struct colour green = {{0, 1, 0}}, blue = {{0, 0, 1}};
    long double c_max = powl(hyab(hunt_lab_of(green), hunt_lab_of(blue)), 0.7L);
    long double error = powl(hyab(hunt_lab_of(a), hunt_lab_of(b)), 0.7L), knee = 0.4L * c_max;
    return error < knee ? 0.95L / knee * error : 0.95L + (error - knee) / (c_max - knee) * 0.05L;
}

/* --- the definition: filters ------------------------------------------------------------------------------ */

static struct colour pixel_of(const struct image *image, int x, int y)
{
    int right = (int)image->width - 1, bottom = (int)image->height - 1;
    x = x < 0 ? 0 : x > right ? right : x;
    y = y < 0 ? 0 : y > bottom ? bottom : y;
    const float *rgb = image->rgb + 3 * ((size_t)y * image->width + (size_t)x);
    return (struct colour){{cut(rgb[0]), cut(rgb[1]), cut(rgb[2])}};
}

static struct colour filtered_colour(const struct image *image, int x, int y, long double ppd)
{
    static const long double terms[3][4] = {{1, 0.0047L, 0, 1}, {1, 0.0053L, 0, 1}, {34.1L, 0.04L, 13.5L, 0.025L}};
    int radius = (int)ceill(3 * sqrtl(0.04L / (2 * PI * PI)) * ppd);
    struct colour sum = {{0}}, weights = {{0}};
    for (int j = -radius; j <= radius; j++)
        for (int i = -radius; i <= radius; i++) {
            struct colour colour = ycxcz_of(pixel_of(image, x + i, y + j));
            long double square = PI * PI * (i * i + j * j) / (ppd * ppd);
            for (int k = 0; k < 3; k++) {
                const long double *t = terms[k];
                long double weight = t[0] * sqrtl(PI / t[1]) * expl(-square / t[1]) +
                                     t[2] * sqrtl(PI / t[3]) * expl(-square / t[3]);
                sum.c[k] += weight * colour.c[k];
                weights.c[k] += weight;
            }
        }
    for (int k = 0; k < 3; k++)
        sum.c[k] /= weights.c[k];
    struct colour rgb = rgb_of_ycxcz(sum);
    return (struct colour){{cut(rgb.c[0]), cut(rgb.c[1]), cut(rgb.c[2])}};
}

/* The response in one direction: what the positive weights see less what the negative ones see. */
static long double response(const struct image *image, int x, int y, long double deviation, bool points, bool down)
{
    int radius = (int)ceill(3 * deviation);
    long double sums[2] = {0}, weights[2] = {0};
    for (int j = -radius; j <= radius; j++)
        for (int i = -radius; i <= radius; i++) {
            int along = down ? j : i;
            long double weight = points ? along * along / (deviation * deviation) - 1 : -along;
            weight *= expl(-(i * i + j * j) / (2 * deviation * deviation));
            sums[weight < 0] += weight * (ycxcz_of(pixel_of(image, x + i, y + j)).c[0] + 16) / 116;
            weights[weight < 0] += weight;
        }
    return sums[0] / weights[0] - sums[1] / weights[1];
}

static long double feature(const struct image *image, int x, int y, long double ppd, bool points)
{
    long double deviation = 0.082L / 2 * ppd;
    return hypotl(response(image, x, y, deviation, points, false), response(image, x, y, deviation, points, true));
}

static double flip_of(const struct image *a, const struct image *b, int x, int y, double ppd)
{
    long double colour = colour_error(filtered_colour(a, x, y, ppd), filtered_colour(b, x, y, ppd));
    long double edges = fabsl(feature(a, x, y, ppd, false) - feature(b, x, y, ppd, false));
    long double points = fabsl(feature(a, x, y, ppd, true) - feature(b, x, y, ppd, true));
    return (double)powl(colour, 1 - sqrtl(fmaxl(edges, points) / sqrtl(2)));
}

/* --- images ----------------------------------------------------------------------------------------------- */

static struct image make_image(uint32_t width, uint32_t height)
{
    return (struct image){width, height, memory_array((size_t)width * height, 3 * sizeof(float))};
}

static struct image flat_image(uint32_t width, uint32_t height, const float rgb[3])
{
    struct image image = make_image(width, height);
    for (size_t i = 0; i < 3 * (size_t)width * height; i++)
        image.rgb[i] = rgb[i % 3];
    return image;
}

/* Noise, of which some is out of range, a disc and a field of lines, so that there is something to find. */
static struct image busy_image(uint32_t width, uint32_t height, uint32_t draw)
{
    struct image image = make_image(width, height);
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            uint32_t at = 3 * (y * width + x), from_centre = (x - 40) * (x - 40) + (y - 30) * (y - 30);
            bool bright = from_centre < 300 || (x > 90 && (x + draw) % 7 < 2);
            for (uint32_t c = 0; c < 3; c++)
                image.rgb[at + c] = (float)random_between(at + c, draw, -0.1, bright ? 1.2 : 0.3 + 0.2 * c);
        }
    return image;
}

static float *errors_of(const struct image *a, const struct image *b, double ppd, int threads)
{
    float *errors = memory_array((size_t)a->width * a->height, sizeof *errors);
    flip_errors(a, b, ppd, threads, errors);
    return errors;
}

/* --- tests ------------------------------------------------------------------------------------------------ */

static void equal_images_have_no_error(void **state)
{
    (void)state;
    struct image a = busy_image(140, 70, 1);
    float *errors = errors_of(&a, &a, FLIP_PPD_DEFAULT, 1);
    for (size_t i = 0; i < 140 * 70; i++)
        assert_true(errors[i] == 0);
    assert_true(flip_mean(errors, 140, 70) == 0);
    free(errors);
    image_finish(&a);
}

/* Without features the error is that of the colours alone. Where an expected value is given, it was
 * calculated by a separate program: those check the definition above. */
static void flat_images_differ_by_their_colours(void **state)
{
    (void)state;
    static const struct {
        float a[3], b[3];
        double expected; /* 0: not known otherwise */
    } rows[] = {
        {{1, 1, 1}, {0, 0, 0}, 0.967380},
        {{0, 1, 0}, {0, 0, 1}, 1},
        {{1, 0, 0}, {0, 1, 0}, 0.986662},
        {{0.5f, 0.5f, 0.5f}, {0.25f, 0.25f, 0.25f}, 0.451850},
        {{0.2f, 0.3f, 0.4f}, {0.2f, 0.3f, 0.4001f}, 0},
        {{0.001f, 0.002f, 0}, {0.002f, 0.001f, 0.003f}, 0},
        {{7, -1, 0.5f}, {1, 0.1f, 0.4f}, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct image a = flat_image(131, 67, rows[i].a), b = flat_image(131, 67, rows[i].b);
        float *errors = errors_of(&a, &b, FLIP_PPD_DEFAULT, 1);
        double expected = (double)colour_error(pixel_of(&a, 0, 0), pixel_of(&b, 0, 0));
        for (size_t k = 0; k < 131 * 67; k++)
            assert_float_equal(errors[k], expected, TOLERANCE);
        if (rows[i].expected > 0)
            assert_float_equal(expected, rows[i].expected, 1e-6);
        assert_float_equal(flip_mean(errors, 131, 67), expected, TOLERANCE);
        free(errors);
        image_finish(&a);
        image_finish(&b);
    }
}

static void check_definition(const struct image *a, const struct image *b, double ppd)
{
    float *errors = errors_of(a, b, ppd, 1);
    const int last_x = (int)a->width - 1, last_y = (int)a->height - 1;
    const int columns[] = {0, 1, 30, 59, 94, 127, 128, last_x - 1, last_x}, rows[] = {0, 5, 30, 63, 64, last_y};
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++)
        for (size_t j = 0; j < sizeof rows / sizeof *rows; j++) {
            int x = columns[i] < last_x ? columns[i] : last_x, y = rows[j] < last_y ? rows[j] : last_y;
            double expected = flip_of(a, b, x, y, ppd), found = errors[y * (last_x + 1) + x];
            if (!(fabs(found - expected) <= TOLERANCE))
                fail_msg("seed %d, %g pixels per degree, pixel (%d, %d): %.9g instead of %.9g", TEST_SEED, ppd, x, y,
                         found, expected);
        }
    free(errors);
}

/* Pixels at the borders of the image and of tiles, and between them. */
static void busy_images_agree_with_the_definition(void **state)
{
    (void)state;
    struct image a = busy_image(150, 70, 1), b = busy_image(150, 70, 2);
    check_definition(&a, &b, FLIP_PPD_DEFAULT);
    check_definition(&a, &b, 31.5);
    check_definition(&a, &b, FLIP_PPD_MIN);
    image_finish(&a);
    image_finish(&b);
    a = busy_image(3, 2, 1), b = busy_image(3, 2, 2);
    check_definition(&a, &b, FLIP_PPD_DEFAULT);
    check_definition(&a, &b, 200);
    image_finish(&a);
    image_finish(&b);
}

/* The widest filters there are: all that they see is the border pixels. */
static void filters_may_be_wider_than_the_image(void **state)
{
    (void)state;
    struct image a = flat_image(3, 2, (const float[]){0.2f, 0.3f, 0.4f});
    struct image b = flat_image(3, 2, (const float[]){0, 1, 0});
    float *errors = errors_of(&a, &b, FLIP_PPD_MAX, 1);
    for (size_t i = 0; i < 6; i++)
        assert_float_equal(errors[i], (double)colour_error(pixel_of(&a, 0, 0), pixel_of(&b, 0, 0)), TOLERANCE);
    free(errors);
    image_finish(&a);
    image_finish(&b);
}

static void neither_order_nor_threads_matter(void **state)
{
    (void)state;
    struct image a = busy_image(260, 200, 1), b = busy_image(260, 200, 2);
    float *expected = errors_of(&a, &b, FLIP_PPD_DEFAULT, 1);
    float *swapped = errors_of(&b, &a, FLIP_PPD_DEFAULT, 1), *shared = errors_of(&a, &b, FLIP_PPD_DEFAULT, 3);
    assert_memory_equal(swapped, expected, 260 * 200 * sizeof *expected);
    assert_memory_equal(shared, expected, 260 * 200 * sizeof *expected);
    free(expected);
    free(swapped);
    free(shared);
    image_finish(&a);
    image_finish(&b);
}

/* Sharp black and white against their negative and against nothing: no error is beyond 1. */
static void errors_stay_within_range(void **state)
{
    (void)state;
    struct image a = make_image(64, 64), b = make_image(64, 64);
    for (uint32_t i = 0; i < 64 * 64; i++)
        for (uint32_t c = 0; c < 3; c++) {
            a.rgb[3 * i + c] = (float)(random_signed(i, 5) > 0);
            b.rgb[3 * i + c] = i % 64 < 32 && i / 64 < 32 ? 1 - a.rgb[3 * i + c] : 0;
        }
    const double ppd[] = {FLIP_PPD_MIN, 20, FLIP_PPD_DEFAULT};
    for (size_t k = 0; k < sizeof ppd / sizeof *ppd; k++) {
        float *errors = errors_of(&a, &b, ppd[k], 1);
        for (size_t i = 0; i < 64 * 64; i++)
            assert_true(errors[i] >= 0 && errors[i] <= 1);
        free(errors);
    }
    image_finish(&a);
    image_finish(&b);
}

static void colours_grow_brighter(void **state)
{
    (void)state;
    uint8_t codes[3];
    flip_colour(0, codes);
    assert_memory_equal(codes, ((uint8_t[]){0, 0, 4}), 3);
    flip_colour(1, codes);
    assert_memory_equal(codes, ((uint8_t[]){252, 253, 191}), 3);
    flip_colour(0.5f, codes);
    assert_memory_equal(codes, ((uint8_t[]){183, 55, 121}), 3);
    double before = -1;
    for (int i = 0; i <= 64; i++) {
        flip_colour((float)i / 64, codes);
        double luminance = 0.2126 * colour_from_srgb8(codes[0]) + 0.7152 * colour_from_srgb8(codes[1]) +
                           0.0722 * colour_from_srgb8(codes[2]);
        assert_true(luminance > before);
        before = luminance;
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_images_have_no_error),
        cmocka_unit_test(flat_images_differ_by_their_colours),
        cmocka_unit_test(busy_images_agree_with_the_definition),
        cmocka_unit_test(filters_may_be_wider_than_the_image),
        cmocka_unit_test(neither_order_nor_threads_matter),
        cmocka_unit_test(errors_stay_within_range),
        cmocka_unit_test(colours_grow_brighter),
    };
    return cmocka_run_group_tests_name("flip", tests, find_matrix, NULL);
}
