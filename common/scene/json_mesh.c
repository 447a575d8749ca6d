#include "base/memory.h"
#include "scene/json_scene.h"
#include "scene/mesh.h"
#include "scene/polygon.h"

/* --- vertices --------------------------------------------------------------------------------------------- */

/* The required "points": min..max of them. */
static void read_points(const struct json_at *object, size_t min, size_t max, struct mesh *mesh)
{
    struct json_at points = json_need(object, "points");
    mesh->vertex_count = json_array(points, min, max, "points");
    mesh->points = memory_array(mesh->vertex_count, sizeof *mesh->points);
    for (struct json_at item = json_first(&points); item.value; json_next(&item))
        json_point(item, &mesh->points[item.index]);
}

/* The optional "normals" and "uv": one a point. */
static void read_attributes(const struct json_at *object, struct mesh *mesh)
{
    struct json_at normals = json_get(object, "normals"), uv = json_get(object, "uv");
    if (json_array(normals, mesh->vertex_count, mesh->vertex_count, "normals (one a point)") > 0)
        mesh->normals = memory_array(mesh->vertex_count, sizeof *mesh->normals);
    for (struct json_at item = json_first(&normals); item.value; json_next(&item))
        json_direction(item, &mesh->normals[item.index]);
    if (json_array(uv, mesh->vertex_count, mesh->vertex_count, "pairs (one a point)") > 0)
        mesh->uv = memory_array(mesh->vertex_count, 2 * sizeof *mesh->uv);
    for (struct json_at item = json_first(&uv); item.value; json_next(&item))
        json_numbers(item, &json_any, 2, mesh->uv + 2 * item.index);
}

/* --- single faces ----------------------------------------------------------------------------------------- */

/* One face of all points in their order. */
static void read_outline(const struct json_at *object, size_t max, struct mesh *mesh)
{
    uint32_t corners[POLYGON_CORNERS_MAX];
    read_points(object, 3, max, mesh);
    if (object->reader->status != STATUS_OK)
        return;
    struct json_at points = json_get(object, "points");
    enum status status = polygon_check(mesh->points, mesh->vertex_count, object->reader->error);
    if (status != STATUS_OK) {
        json_forward(&points, status);
        return;
    }
    for (size_t i = 0; i < mesh->vertex_count; i++)
        corners[i] = (uint32_t)i;
    size_t capacity = 0;
    mesh_add_face(mesh, &capacity, corners, mesh->vertex_count);
}

void json_triangle(const struct json_at *object, struct shape *shape)
{
    shape->kind = SHAPE_MESH;
    read_outline(object, 3, &shape->mesh);
    read_attributes(object, &shape->mesh);
}

void json_polygon(const struct json_at *object, struct shape *shape)
{
    shape->kind = SHAPE_MESH;
    read_outline(object, POLYGON_CORNERS_MAX, &shape->mesh);
}

/* --- solids ----------------------------------------------------------------------------------------------- */

void json_tetrahedron(const struct json_at *object, struct shape *shape)
{
    static const uint32_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    struct mesh *mesh = &shape->mesh;
    shape->kind = SHAPE_MESH;
    read_points(object, 4, 4, mesh);
    if (object->reader->status != STATUS_OK)
        return;
    struct vec3 a = vec3_sub(mesh->points[1], mesh->points[0]), b = vec3_sub(mesh->points[2], mesh->points[0]);
    struct vec3 c = vec3_sub(mesh->points[3], mesh->points[0]);
    double extent = fmax(vec3_max_abs(a), fmax(vec3_max_abs(b), vec3_max_abs(c)));
    double volume = fabs(vec3_dot(a, vec3_cross(b, c)));
    if (!(volume > 1e-12 * extent * extent * extent)) { /* less than that is rounding */
        struct json_at points = json_get(object, "points");
        json_refuse(&points, "expected four points that enclose a volume, found them in one plane");
        return;
    }
    size_t capacity = 0;
    for (size_t i = 0; i < 4; i++)
        mesh_add_face(mesh, &capacity, faces[i], 3);
    mesh_close(mesh);
}

/* Fills corners with the face's indices, which must be different ones. */
static void read_corners(const struct json_at *face, size_t vertex_count, uint32_t *corners)
{
    for (struct json_at item = json_first(face); item.value; json_next(&item)) {
        json_whole(item, 0, (uint32_t)vertex_count - 1, &corners[item.index]);
        for (size_t i = 0; i < item.index; i++)
            if (corners[i] == corners[item.index])
                json_expected(&item, "every point of the face once");
    }
}

static void read_faces(const struct json_at *object, struct mesh *mesh)
{
    struct json_at faces = json_need(object, "faces");
    size_t capacity = 0;
    json_array(faces, 1, UINT32_MAX, "faces");
    for (struct json_at face = json_first(&faces); face.value; json_next(&face)) {
        uint32_t corners[POLYGON_CORNERS_MAX] = {0};
        size_t count = json_array(face, 3, POLYGON_CORNERS_MAX, "indices of points");
        read_corners(&face, mesh->vertex_count, corners);
        if (face.reader->status == STATUS_OK)
            mesh_add_face(mesh, &capacity, corners, count);
    }
}

void json_mesh(const struct json_at *object, struct shape *shape)
{
    struct mesh *mesh = &shape->mesh;
    shape->kind = SHAPE_MESH;
    read_points(object, 3, UINT32_MAX, mesh);
    read_attributes(object, mesh);
    read_faces(object, mesh);
    if (object->reader->status == STATUS_OK)
        mesh_close(mesh);
}
