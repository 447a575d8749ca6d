#include "scene/json_scene.h"

static const char *const common_keys[] = {"type", "name", "material", "transform", NULL};

static void read_sphere(const struct json_at *object, struct shape *shape)
{
    shape->kind = SHAPE_SPHERE;
    json_point(json_get(object, "center"), &shape->sphere.center);
    json_number(json_need(object, "radius"), &json_positive, &shape->sphere.radius);
}

static void read_plane(const struct json_at *object, struct shape *shape)
{
    shape->kind = SHAPE_PLANE;
    json_point(json_need(object, "point"), &shape->plane.point);
    json_direction(json_need(object, "normal"), &shape->plane.normal);
}

static void read_disc(const struct json_at *object, struct shape *shape)
{
    shape->kind = SHAPE_DISC;
    json_point(json_need(object, "center"), &shape->disc.center);
    json_direction(json_need(object, "normal"), &shape->disc.normal);
    json_number(json_need(object, "radius"), &json_positive, &shape->disc.radius);
}

/* The ends of a cylinder, cone or frustum; the upper one is called `top`. */
static void read_axis(const struct json_at *object, const char *top, struct shape *shape)
{
    shape->kind = SHAPE_FRUSTUM;
    json_point(json_need(object, "base"), &shape->frustum.base);
    json_point(json_need(object, top), &shape->frustum.top);
    json_flag(json_get(object, "open"), &shape->frustum.open);
    if (vec3_max_abs(vec3_sub(shape->frustum.base, shape->frustum.top)) < SCENE_SMALLEST)
        json_refuse(object, "expected base and %s apart, found both in one place", top);
}

static void read_cylinder(const struct json_at *object, struct shape *shape)
{
    read_axis(object, "top", shape);
    json_number(json_need(object, "radius"), &json_positive, &shape->frustum.base_radius);
    shape->frustum.top_radius = shape->frustum.base_radius;
}

static void read_cone(const struct json_at *object, struct shape *shape)
{
    read_axis(object, "apex", shape);
    json_number(json_need(object, "radius"), &json_positive, &shape->frustum.base_radius);
}

static void read_frustum(const struct json_at *object, struct shape *shape)
{
    read_axis(object, "top", shape);
    json_number(json_need(object, "base_radius"), &json_not_negative, &shape->frustum.base_radius);
    json_number(json_need(object, "top_radius"), &json_not_negative, &shape->frustum.top_radius);
    if (fmax(shape->frustum.base_radius, shape->frustum.top_radius) < SCENE_SMALLEST)
        json_refuse(object, "expected base_radius or top_radius above 0, found both 0");
}

static void read_box(const struct json_at *object, struct shape *shape)
{
    shape->kind = SHAPE_BOX;
    json_point(json_need(object, "min"), &shape->box.min);
    json_point(json_need(object, "max"), &shape->box.max);
    struct vec3 size = vec3_sub(shape->box.max, shape->box.min);
    if (fmin(size.x, fmin(size.y, size.z)) < SCENE_SMALLEST)
        json_refuse(object, "expected min below max in x, y and z, found a size of %g × %g × %g", size.x,
                    size.y, size.z);
}

struct shape_reader {
    void (*read)(const struct json_at *object, struct shape *shape);
    const char *const keys[8]; /* its own, ended by NULL */
};

enum { SHAPE_NAMES = 11 };

static const char *const names[SHAPE_NAMES] = {
    "sphere", "plane",    "disc",        "cylinder", "cone", "frustum",
    "box",    "triangle", "tetrahedron", "polygon",  "mesh",
};

static const struct shape_reader readers[SHAPE_NAMES] = {
    {read_sphere, {"center", "radius"}},
    {read_plane, {"point", "normal"}},
    {read_disc, {"center", "normal", "radius"}},
    {read_cylinder, {"base", "top", "radius", "open"}},
    {read_cone, {"base", "apex", "radius", "open"}},
    {read_frustum, {"base", "top", "base_radius", "top_radius", "open"}},
    {read_box, {"min", "max"}},
    {json_triangle, {"points", "normals", "uv"}},
    {json_tetrahedron, {"points"}},
    {json_polygon, {"points"}},
    {json_mesh, {"points", "faces", "normals", "uv", "file"}}, /* with "file": json_mesh_file */
};

void json_shape(struct json_at object, struct shape *shape)
{
    size_t kind = 0;
    if (!cJSON_IsObject(object.value)) {
        json_expected(&object, "an object");
        return;
    }
    json_choice(json_need(&object, "type"), names, SHAPE_NAMES, &kind);
    json_keys(object, common_keys, readers[kind].keys);
    if (object.reader->status == STATUS_OK)
        readers[kind].read(&object, shape);
}
