#include "math/transform.h"

#include <float.h>

#include "math/elementary.h"

struct mat3 mat3_identity(void)
{
    return (struct mat3){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
}

struct mat3 mat3_transpose(const struct mat3 *m)
{
    return (struct mat3){{m->x.x, m->y.x, m->z.x}, {m->x.y, m->y.y, m->z.y}, {m->x.z, m->y.z, m->z.z}};
}

struct mat3 mat3_multiply(const struct mat3 *a, const struct mat3 *b)
{
    struct mat3 columns = mat3_transpose(b);
    struct mat3 product = {mat3_apply(a, columns.x), mat3_apply(a, columns.y), mat3_apply(a, columns.z)};
    return mat3_transpose(&product);
}

double mat3_determinant(const struct mat3 *m)
{
    return vec3_dot(m->x, vec3_cross(m->y, m->z));
}

struct mat3 mat3_inverse(const struct mat3 *m)
{
    double determinant = mat3_determinant(m);
    struct mat3 columns = {vec3_cross(m->y, m->z), vec3_cross(m->z, m->x), vec3_cross(m->x, m->y)};
    struct mat3 rows = mat3_transpose(&columns);
    rows.x = vec3_make(rows.x.x / determinant, rows.x.y / determinant, rows.x.z / determinant);
    rows.y = vec3_make(rows.y.x / determinant, rows.y.y / determinant, rows.y.z / determinant);
    rows.z = vec3_make(rows.z.x / determinant, rows.z.y / determinant, rows.z.z / determinant);
    return rows;
}

struct affine affine_identity(void)
{
    return (struct affine){.linear = mat3_identity()};
}

struct affine affine_translation(struct vec3 by)
{
    return (struct affine){.linear = mat3_identity(), .offset = by};
}

struct affine affine_scaling(struct vec3 by)
{
    return (struct affine){.linear = {{by.x, 0, 0}, {0, by.y, 0}, {0, 0, by.z}}};
}

struct affine affine_rotation(struct vec3 k, double degrees)
{
    double s = math_sin_degrees(degrees), c = math_cos_degrees(degrees), v = 1 - c;
    return (struct affine){.linear = {
                               {c + k.x * k.x * v, k.x * k.y * v - k.z * s, k.x * k.z * v + k.y * s},
                               {k.y * k.x * v + k.z * s, c + k.y * k.y * v, k.y * k.z * v - k.x * s},
                               {k.z * k.x * v - k.y * s, k.z * k.y * v + k.x * s, c + k.z * k.z * v},
                           }};
}

struct affine affine_multiply(const struct affine *a, const struct affine *b)
{
    return (struct affine){.linear = mat3_multiply(&a->linear, &b->linear), .offset = affine_point(a, b->offset)};
}

double affine_similarity(const struct affine *m)
{
    struct mat3 columns = mat3_transpose(&m->linear);
    double xx = vec3_dot(columns.x, columns.x), yy = vec3_dot(columns.y, columns.y);
    double zz = vec3_dot(columns.z, columns.z);
    /* Entries of a product of rotations are off by a few DBL_EPSILON; a shear or scale that a scene means
     * is far larger. */
    double slack = 32 * DBL_EPSILON * xx;
    bool same = fabs(xx - yy) <= slack && fabs(xx - zz) <= slack && fabs(vec3_dot(columns.x, columns.y)) <= slack &&
                fabs(vec3_dot(columns.x, columns.z)) <= slack && fabs(vec3_dot(columns.y, columns.z)) <= slack;
    return same ? sqrt(xx) : 0;
}
