/*
 * Affine maps and the out-of-line parts of vec3.
 */
#include "math/transform.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/hash.h"

enum { SEED = 20240613, SAMPLES = 20000 };

/* The value number `draw` of sample `i`, −1..1. */
static double random_value(uint32_t i, uint32_t draw)
{
    return (double)(int32_t)hash_u32(hash_u32(SEED + draw) ^ i) * 0x1p-31;
}

static struct vec3 random_vector(uint32_t i, uint32_t draw)
{
    return vec3_make(random_value(i, draw), random_value(i, draw + 1), random_value(i, draw + 2));
}

static struct affine random_rotation(uint32_t i, uint32_t draw)
{
    return affine_rotation(vec3_normalize(random_vector(i, draw)), 720 * random_value(i, draw + 3));
}

static double distance(struct vec3 a, struct vec3 b)
{
    return vec3_max_abs(vec3_sub(a, b));
}

static double matrix_distance(const struct mat3 *a, const struct mat3 *b)
{
    return vec3_max_abs(vec3_make(distance(a->x, b->x), distance(a->y, b->y), distance(a->z, b->z)));
}

static bool same_vector(struct vec3 a, struct vec3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

static void normalize_takes_any_magnitude(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < SAMPLES; i++) {
        struct vec3 direction = random_vector(i, 0),
                    expected = vec3_scale(direction, 1 / vec3_length(direction));
        int exponent =
            (int)(i % 2047) - 1022; /* the whole normal range, as the direction is mostly above 2^-20 */
        struct vec3 v =
            vec3_make(ldexp(direction.x, exponent), ldexp(direction.y, exponent), ldexp(direction.z, exponent));
        /* A component below the normal range has lost bits: an absolute 2^-1075 of a length 2^exponent. */
        double tolerance = 4 * DBL_EPSILON + ldexp(8, -1075 - exponent) / vec3_max_abs(direction);
        if (!(distance(vec3_normalize(v), expected) <= tolerance))
            fail_msg("seed %d, sample %u: exponent %d", SEED, i, exponent);
    }
    struct vec3 axis = vec3_make(0, 0, -1);
    assert_true(same_vector(vec3_normalize(vec3_make(0, 0, -0x1p-1074)), axis));
    assert_true(same_vector(vec3_normalize(vec3_make(0, 0, -DBL_MAX)), axis));
    double third = 1 / sqrt(3.0);
    assert_true(distance(vec3_normalize(vec3_make(DBL_MAX, DBL_MAX, DBL_MAX)),
                         vec3_make(third, third, third)) <= DBL_EPSILON);
    assert_true(distance(vec3_normalize(vec3_make(0x1p-1074, 0x1p-1074, 0x1p-1074)),
                         vec3_make(third, third, third)) <= DBL_EPSILON);
}

static void check_frame(struct vec3 n)
{
    struct vec3 t, b;
    vec3_frame(n, &t, &b);
    double worst = vec3_max_abs(vec3_make(vec3_dot(t, n), vec3_dot(b, n), vec3_dot(t, b)));
    worst = fmax(worst, fmax(fabs(vec3_length(t) - 1), fabs(vec3_length(b) - 1)));
    worst = fmax(worst, distance(vec3_cross(t, b), n));
    if (!(worst <= 8 * DBL_EPSILON))
        fail_msg("seed %d: the frame of (%a, %a, %a) is off by %g", SEED, n.x, n.y, n.z, worst);
}

static void frame_is_orthonormal_and_right_handed(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < SAMPLES; i++) {
        struct vec3 n = random_vector(i, 0);
        check_frame(vec3_normalize(n));
        check_frame(vec3_normalize(vec3_make(n.x * 1e-9, n.y * 1e-9, n.z))); /* near the poles */
        check_frame(vec3_normalize(vec3_make(n.x, n.y, n.z * 1e-17)));       /* where the sign of z turns */
    }
    check_frame(vec3_make(0, 0, 1));
    check_frame(vec3_make(0, 0, -1));
    check_frame(vec3_make(1, 0, 0.0));
    check_frame(vec3_make(1, 0, -0.0));
}

static void inverse_undoes_a_matrix(void **state)
{
    (void)state;
    struct mat3 identity = mat3_identity();
    for (uint32_t i = 0; i < SAMPLES; i++) {
        struct mat3 m = {random_vector(i, 0), random_vector(i, 3), random_vector(i, 6)};
        double determinant = mat3_determinant(&m);
        if (fabs(determinant) < 0.01)
            continue;
        struct mat3 inverse = mat3_inverse(&m), product = mat3_multiply(&m, &inverse);
        /* The cofactors, at most 2, are off by 2 roundings of it; sums of three such products follow. */
        if (!(matrix_distance(&product, &identity) <= 32 * DBL_EPSILON / fabs(determinant)))
            fail_msg("seed %d, sample %u: determinant %g", SEED, i, determinant);
    }
    struct mat3 scale = affine_scaling(vec3_make(2, -4, 0.5)).linear,
                expected = affine_scaling(vec3_make(0.5, -0.25, 2)).linear;
    struct mat3 inverse = mat3_inverse(&scale);
    assert_true(matrix_distance(&inverse, &expected) == 0);
}

static void multiplying_is_applying_one_after_the_other(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < SAMPLES; i++) {
        struct affine a = {{random_vector(i, 0), random_vector(i, 3), random_vector(i, 6)},
                           random_vector(i, 9)};
        struct affine b = {{random_vector(i, 12), random_vector(i, 15), random_vector(i, 18)},
                           random_vector(i, 21)};
        struct affine ab = affine_multiply(&a, &b);
        struct vec3 p = random_vector(i, 24), one_by_one = affine_point(&a, affine_point(&b, p));
        assert_true(distance(affine_point(&ab, p), one_by_one) <= 32 * DBL_EPSILON);
        struct mat3 transposed = mat3_transpose(&a.linear);
        assert_true(same_vector(mat3_apply_transposed(&a.linear, p), mat3_apply(&transposed, p)));
    }
}

static void quarter_turns_are_exact(void **state)
{
    (void)state;
    struct vec3 x = vec3_make(1, 0, 0), y = vec3_make(0, 1, 0), z = vec3_make(0, 0, 1);
    for (int turns = -3; turns <= 3; turns++) {
        double degrees = 90 + 360.0 * turns;
        struct affine about_x = affine_rotation(x, degrees), about_y = affine_rotation(y, degrees);
        struct affine about_z = affine_rotation(z, degrees), half = affine_rotation(z, 2 * degrees);
        assert_true(same_vector(affine_point(&about_x, y), z) &&
                    same_vector(affine_point(&about_x, z), vec3_neg(y)));
        assert_true(same_vector(affine_point(&about_y, z), x) &&
                    same_vector(affine_point(&about_y, x), vec3_neg(z)));
        assert_true(same_vector(affine_point(&about_z, x), y) &&
                    same_vector(affine_point(&about_z, y), vec3_neg(x)));
        assert_true(same_vector(affine_point(&half, x), vec3_neg(x)) && same_vector(affine_point(&half, z), z));
    }
}

/* A third of a turn about the diagonal moves x to y, y to z and z to x. */
static void rotation_about_any_axis(void **state)
{
    (void)state;
    double third = 1 / sqrt(3.0);
    struct affine diagonal = affine_rotation(vec3_make(third, third, third), 120);
    assert_true(distance(affine_point(&diagonal, vec3_make(1, 2, 3)), vec3_make(3, 1, 2)) <= 8 * DBL_EPSILON);
    struct mat3 identity = mat3_identity();
    for (uint32_t i = 0; i < SAMPLES; i++) {
        struct mat3 m = random_rotation(i, 0).linear, back = mat3_transpose(&m),
                    product = mat3_multiply(&m, &back);
        assert_true(matrix_distance(&product, &identity) <= 16 * DBL_EPSILON);
        assert_true(fabs(mat3_determinant(&m) - 1) <= 16 * DBL_EPSILON);
        struct vec3 axis = vec3_normalize(random_vector(i, 0));
        assert_true(distance(mat3_apply(&m, axis), axis) <= 8 * DBL_EPSILON);
    }
}

static void similarity_is_told_from_shear_and_stretch(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < SAMPLES; i++) {
        double factor = ldexp(1.5 + 0.5 * random_value(i, 0), (int)(i % 40) - 20);
        struct affine a = random_rotation(i, 1), b = random_rotation(i, 5);
        struct affine scale = affine_scaling(vec3_make(factor, i % 2 ? factor : -factor, factor));
        struct affine m = affine_multiply(&a, &scale);
        m = affine_multiply(&m, &b);
        assert_true(fabs(affine_similarity(&m) - factor) <= 16 * DBL_EPSILON * factor);
        struct affine stretch = affine_scaling(vec3_make(factor, factor, factor * (1 + 1e-12)));
        m = affine_multiply(&a, &stretch);
        assert_true(affine_similarity(&m) == 0);
    }
    struct affine shear = affine_identity();
    shear.linear.x.y = 1e-12;
    assert_true(affine_similarity(&shear) == 0);
    assert_true(affine_similarity(&(struct affine){.linear = {{3, 0, 0}, {0, 3, 0}, {0, 0, 3}}}) == 3);
}

static void a_relative_point_loses_nothing_far_away(void **state)
{
    (void)state;
    struct affine far = affine_translation(vec3_make(1e15, -1e15, 1e15));
    struct vec3 p = vec3_make(1e-9, 0.1, -1e-9),
                relative = affine_point_relative(&far, p, vec3_make(1e15 - 1, -1e15, 1e15));
    assert_true(same_vector(relative, vec3_make(1 + 1e-9, 0.1, -1e-9)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(normalize_takes_any_magnitude),
        cmocka_unit_test(frame_is_orthonormal_and_right_handed),
        cmocka_unit_test(inverse_undoes_a_matrix),
        cmocka_unit_test(multiplying_is_applying_one_after_the_other),
        cmocka_unit_test(quarter_turns_are_exact),
        cmocka_unit_test(rotation_about_any_axis),
        cmocka_unit_test(similarity_is_told_from_shear_and_stretch),
        cmocka_unit_test(a_relative_point_loses_nothing_far_away),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
