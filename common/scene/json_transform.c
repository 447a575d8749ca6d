#include "scene/json_scene.h"

/* One factor for all axes, or one each. */
static struct affine read_scale(struct json_at at)
{
    struct vec3 by = {1, 1, 1};
    if (cJSON_IsArray(at.value))
        json_point(at, &by);
    else
        json_number(at, &json_any, &by.x);
    return affine_scaling(cJSON_IsArray(at.value) ? by : vec3_make(by.x, by.x, by.x));
}

/* Angles about x, then y, then z, or one angle about an axis. */
static struct affine read_rotation(struct json_at at)
{
    static const char *const keys[] = {"axis", "angle", NULL};
    struct vec3 axis = {0, 0, 1}, angles = {0};
    if (cJSON_IsObject(at.value)) {
        json_keys(at, keys, NULL);
        json_direction(json_need(&at, "axis"), &axis);
        json_number(json_need(&at, "angle"), &json_any, &angles.z);
        return affine_rotation(axis, angles.z);
    }
    json_point(at, &angles);
    struct affine x = affine_rotation(vec3_make(1, 0, 0), angles.x);
    struct affine y = affine_rotation(vec3_make(0, 1, 0), angles.y);
    struct affine z = affine_rotation(vec3_make(0, 0, 1), angles.z);
    struct affine xy = affine_multiply(&y, &x);
    return affine_multiply(&z, &xy);
}

static struct affine read_translation(struct json_at at)
{
    struct vec3 by = {0};
    json_point(at, &by);
    return affine_translation(by);
}

/* Three rows of four: the linear part, and the offset in the last column. */
static struct affine read_matrix(struct json_at at)
{
    double m[12] = {0};
    json_numbers(at, &json_any, 12, m);
    return (struct affine){
        .linear = {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}},
        .offset = {m[3], m[7], m[11]},
    };
}

static struct affine read_step(struct json_at at)
{
    static const char *const keys[] = {"scale", "rotate", "translate", "matrix", NULL};
    static struct affine (*const readers[])(struct json_at) = {read_scale, read_rotation, read_translation,
                                                               read_matrix};
    json_keys(at, keys, NULL);
    if (at.reader->status == STATUS_OK && cJSON_GetArraySize(at.value) != 1)
        json_refuse(&at, "expected one of the keys scale, rotate, translate and matrix, found %s",
                    at.value->child ? "several" : "none");
    for (size_t i = 0; at.reader->status == STATUS_OK && keys[i]; i++) {
        struct json_at step = json_get(&at, keys[i]);
        if (step.value)
            return readers[i](step);
    }
    return affine_identity();
}

/* The rows' directions must span space: below 1e-12 the inverse would have four digits or fewer. */
static bool is_invertible(const struct mat3 *m)
{
    const double least = 1e-12;
    if (fmin(vec3_max_abs(m->x), fmin(vec3_max_abs(m->y), vec3_max_abs(m->z))) < SCENE_SMALLEST)
        return false;
    struct mat3 rows = {vec3_normalize(m->x), vec3_normalize(m->y), vec3_normalize(m->z)};
    return fabs(mat3_determinant(&rows)) > least;
}

static double largest_entry(const struct affine *m)
{
    double rows = fmax(vec3_max_abs(m->linear.x), fmax(vec3_max_abs(m->linear.y), vec3_max_abs(m->linear.z)));
    return fmax(rows, vec3_max_abs(m->offset));
}

void json_transform(struct json_at at, struct affine *transform)
{
    struct affine all = affine_identity();
    json_array(at, 0, SIZE_MAX, "steps");
    for (struct json_at item = json_first(&at); item.value; json_next(&item)) {
        struct affine step = read_step(item);
        all = affine_multiply(&step, &all);
        if (!(largest_entry(&all) <= SCENE_LARGEST))
            json_refuse(&item, "expected a transform of numbers up to 1e30, found larger ones");
    }
    if (at.value && at.reader->status == STATUS_OK && !is_invertible(&all.linear))
        json_refuse(&at, "expected a transform that can be undone, found one that makes the shape flat");
    *transform = all;
}
