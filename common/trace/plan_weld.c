/*
 * Faces of different objects that lie in one plane get one record of it, so that rays meet them at equal t and the
 * lowest id wins. Without this, each keeps the last bits that its own kind and place gave it, and where a turned
 * box stands on a floor every pixel decides anew.
 *
 * Faces that may belong together are found by sorting: by three coordinates of the normal, then by the offset, each
 * time split where neighbours are farther apart than rounding explains. Most runs end after the first sort, with
 * faces of one object. A normal counts as parallel to its opposite: so its coordinates are taken as magnitudes, along
 * axes that no scene is symmetric about.
 */
#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "trace/instance.h"
#include "trace/plan_parts.h"

/* How far rounding turns a face's normal, and moves its points as a share of the size of the coordinates that they were
 * made from. Over chains of up to six transforms, two ways to one plane came out at most 5 DBL_EPSILON apart in the
 * normal and 2.6 in the offset, as a share of both faces' sizes together. */
static const double rounding = 4 * DBL_EPSILON;

/* Triangles whose normals rounding may turn farther are too thin or too small to say in which plane they lie. */
static const double tilt_max = 0x1p-30;

/* Each of length 1 or so, and no two of them at right angles. */
static const struct vec3 axes[] = {{0.83, 0.49, 0.27}, {-0.31, 0.87, 0.39}, {0.43, -0.23, 0.87}};
enum { OFFSET_LEVEL = sizeof axes / sizeof *axes };

/* A face by its primitive and, of a solid, its piece; and the range of the key by which faces are being sorted. */
struct entry {
    double low, high;
    uint32_t id;
    uint8_t part;
};

struct weld {
    struct plan *plan;
    const struct scene *scene;
    size_t welded_capacity;
    struct vec3 normal; /* of the parallel faces whose offsets are being sorted */
};

/* --- faces ------------------------------------------------------------------------------------------------ */

static const struct primitive *primitive_of(const struct weld *weld, const struct entry *entry)
{
    return plan_primitive(weld->plan, entry->id);
}

/* Where the face's plane is kept: sign × normal shows outwards, or to the front. The two faces at either end of a solid
 * share a normal. */
struct record {
    struct vec3 *normal;
    double *offset, sign;
};

static struct record box_record(struct box *box, uint8_t face)
{
    struct vec3 *const rows[3] = {&box->frame.x, &box->frame.y, &box->frame.z};
    double *const lows[3] = {&box->low.x, &box->low.y, &box->low.z};
    double *const highs[3] = {&box->high.x, &box->high.y, &box->high.z};
    return (struct record){rows[face / 2], face % 2 ? lows[face / 2] : highs[face / 2], face % 2 ? -1 : 1};
}

static struct record plane_record(struct plane *plane)
{
    return (struct record){&plane->normal, &plane->offset, 1};
}

static struct record frustum_record(struct frustum *frustum, uint8_t part)
{
    return part == PART_WIDE_CAP ? (struct record){&frustum->axis, &frustum->high, 1}
                                 : (struct record){&frustum->axis, &frustum->low, -1};
}

static struct record record_of(const struct weld *weld, const struct entry *entry)
{
    const struct plan *plan = weld->plan;
    const struct primitive *primitive = primitive_of(weld, entry);
    switch ((enum primitive_kind)primitive->kind) {
    case PRIMITIVE_BOX:
        return box_record(&plan->boxes[primitive->index], entry->part);
    case PRIMITIVE_FRUSTUM:
        return frustum_record(&plan->frustums[primitive->index], entry->part);
    case PRIMITIVE_DISC:
        return plane_record(&plan->discs[primitive->index].plane);
    case PRIMITIVE_PLANE:
        return plane_record(&plan->planes[primitive->index]);
    default:
        return plane_record(&plan->triangles[primitive->index].plane);
    }
}

static struct triangle triangle_of(const struct weld *weld, const struct entry *entry)
{
    return plan_triangle(weld->plan, entry->id);
}

static struct plane get_face(const struct weld *weld, const struct entry *entry)
{
    if (primitive_of(weld, entry)->kind == PRIMITIVE_INSTANCE)
        return triangle_of(weld, entry).plane;
    struct record record = record_of(weld, entry);
    return (struct plane){vec3_scale(*record.normal, record.sign), *record.offset * record.sign};
}

static void set_face(struct weld *weld, const struct entry *entry, struct plane plane)
{
    struct plan *plan = weld->plan;
    if (primitive_of(weld, entry)->kind == PRIMITIVE_INSTANCE) {
        plan->welded = memory_grow(plan->welded, &weld->welded_capacity, plan->welded_count + 1, sizeof *plan->welded);
        plan->welded[plan->welded_count++] = (struct welded){entry->id, plane};
        return;
    }
    struct record record = record_of(weld, entry);
    *record.normal = vec3_scale(plane.normal, record.sign);
    *record.offset = plane.offset * record.sign;
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static double box_reach(const struct box *box)
{
    return larger(vec3_max_abs(box->low), vec3_max_abs(box->high));
}

static double triangle_reach(struct triangle triangle)
{
    return larger(vec3_max_abs(triangle.a), larger(vec3_max_abs(triangle.b), vec3_max_abs(triangle.c)));
}

/* The size of the coordinates that the face was made from, relative to the eye. */
static double reach_of(const struct weld *weld, const struct entry *entry)
{
    const struct plan *plan = weld->plan;
    const struct primitive *primitive = primitive_of(weld, entry);
    const struct object *object = &weld->scene->objects[primitive->object];
    switch ((enum primitive_kind)primitive->kind) {
    case PRIMITIVE_PLANE:
        return vec3_max_abs(affine_point_relative(&object->transform, object->shape.plane.point, plan->eye));
    case PRIMITIVE_DISC:
        return vec3_max_abs(plan->discs[primitive->index].center);
    case PRIMITIVE_FRUSTUM:
        return vec3_max_abs(plan->frustums[primitive->index].origin) + plan->objects[primitive->object].extent;
    case PRIMITIVE_BOX:
        return box_reach(&plan->boxes[primitive->index]);
    default:
        return triangle_reach(triangle_of(weld, entry));
    }
}

/* How far rounding may have moved the face's points; and beyond that its plane, as far out as they are. */
static double shift_of(const struct weld *weld, const struct entry *entry)
{
    const struct primitive *primitive = primitive_of(weld, entry);
    struct vec3 offset = weld->scene->objects[primitive->object].transform.offset;
    double home = vec3_max_abs(offset) + vec3_max_abs(weld->plan->eye);
    return rounding * (home + 2 * reach_of(weld, entry));
}

static double triangle_height(const struct triangle *triangle)
{
    struct vec3 ab = vec3_sub(triangle->b, triangle->a), bc = vec3_sub(triangle->c, triangle->b);
    struct vec3 ca = vec3_sub(triangle->a, triangle->c);
    double longest = larger(vec3_dot(ab, ab), larger(vec3_dot(bc, bc), vec3_dot(ca, ca)));
    return vec3_length(vec3_cross(ab, bc)) / sqrt(longest);
}

/* How far rounding may have moved each component of the face's normal. */
static double tilt_of(const struct weld *weld, const struct entry *entry)
{
    if (!primitive_is_of_mesh(primitive_of(weld, entry)))
        return rounding;
    struct triangle triangle = triangle_of(weld, entry);
    double height = triangle_height(&triangle);
    return height > 0 ? rounding + 2 * shift_of(weld, entry) / height : INFINITY;
}

/* --- keys ------------------------------------------------------------------------------------------------- */

static void set_range(struct entry *entry, double key, double slack)
{
    entry->low = key - slack;
    entry->high = key + slack;
}

static void set_normal_range(struct entry *entry, unsigned level, struct vec3 normal, double tilt)
{
    set_range(entry, fabs(vec3_dot(axes[level], normal)), 2 * tilt);
}

/* Its sign is +1 if the face looks along weld->normal, −1 if the other way. */
static double sense_of(const struct weld *weld, const struct entry *entry)
{
    return copysign(1, vec3_dot(weld->normal, get_face(weld, entry).normal));
}

/* Of a face that is parallel to weld->normal, along that. */
static double offset_of(const struct weld *weld, const struct entry *entry)
{
    return primitive_is_of_mesh(primitive_of(weld, entry))
               ? vec3_dot(weld->normal, triangle_of(weld, entry).a)
               : sense_of(weld, entry) * get_face(weld, entry).offset;
}

/* Whether weld->normal is the face's, up to its sign. Of a triangle, the corners say that better than its normal. */
static bool is_parallel(const struct weld *weld, const struct entry *entry)
{
    if (!primitive_is_of_mesh(primitive_of(weld, entry))) {
        struct vec3 normal = get_face(weld, entry).normal;
        return vec3_max_abs(vec3_add_scaled(normal, weld->normal, -sense_of(weld, entry))) <= 2 * rounding;
    }
    struct triangle triangle = triangle_of(weld, entry);
    double a = vec3_dot(weld->normal, triangle.a), b = vec3_dot(weld->normal, triangle.b);
    double c = vec3_dot(weld->normal, triangle.c), slack = 2 * shift_of(weld, entry);
    return fabs(b - a) <= slack && fabs(c - a) <= slack;
}

/* A total order, so that every machine sorts alike. */
static int compare_entries(const void *left, const void *right)
{
    const struct entry *a = left, *b = right;
    if (a->low != b->low)
        return a->low < b->low ? -1 : 1;
    if (a->id != b->id)
        return a->id < b->id ? -1 : 1;
    return a->part < b->part ? -1 : a->part > b->part;
}

/* --- welding ---------------------------------------------------------------------------------------------- */

/* The face that the others follow: the most exact one, which is any but a triangle; of equals that of the lowest id. */
static const struct entry *leader_of(const struct weld *weld, const struct entry *entries, size_t count)
{
    const struct entry *leader = entries;
    double least = tilt_of(weld, leader);
    for (size_t i = 1; i < count; i++) {
        const struct entry *entry = &entries[i];
        double tilt = tilt_of(weld, entry);
        bool first = entry->id < leader->id || (entry->id == leader->id && entry->part < leader->part);
        if (tilt < least || (tilt == least && first)) {
            leader = entry;
            least = tilt;
        }
    }
    return leader;
}

static void weld_plane(struct weld *weld, const struct entry *entries, size_t count)
{
    const struct entry *leader = leader_of(weld, entries, count);
    double offset = offset_of(weld, leader);
    for (size_t i = 0; i < count; i++) {
        double sense = sense_of(weld, &entries[i]);
        set_face(weld, &entries[i], (struct plane){vec3_scale(weld->normal, sense), sense * offset});
    }
}

static bool is_of_one_object(const struct weld *weld, const struct entry *entries, size_t count)
{
    for (size_t i = 1; i < count; i++)
        if (primitive_of(weld, &entries[i])->object != primitive_of(weld, entries)->object)
            return false;
    return true;
}

/* Sets the ranges of the level's key. Returns how many faces are left, which come first: for the last level those that
 * are parallel to their leader. */
static size_t set_ranges(struct weld *weld, struct entry *entries, size_t count, unsigned level)
{
    size_t kept = 0;
    if (level < OFFSET_LEVEL) {
        for (size_t i = 0; i < count; i++)
            set_normal_range(&entries[i], level, get_face(weld, &entries[i]).normal, tilt_of(weld, &entries[i]));
        return count;
    }
    weld->normal = get_face(weld, leader_of(weld, entries, count)).normal;
    for (size_t i = 0; i < count; i++) {
        if (!is_parallel(weld, &entries[i]))
            continue;
        entries[kept] = entries[i];
        set_range(&entries[kept++], offset_of(weld, &entries[i]), shift_of(weld, &entries[i]));
    }
    return kept;
}

/* Welds what lies in one plane among faces that are alike in the keys of all levels before this. */
static void split(struct weld *weld, struct entry *entries, size_t count, unsigned level)
{
    qsort(entries, count, sizeof *entries, compare_entries);
    for (size_t start = 0, end; start < count; start = end) {
        double high = entries[start].high;
        for (end = start + 1; end < count && entries[end].low <= high; end++)
            high = larger(high, entries[end].high);
        if (is_of_one_object(weld, &entries[start], end - start))
            continue;
        if (level == OFFSET_LEVEL)
            weld_plane(weld, &entries[start], end - start);
        else
            split(weld, &entries[start], set_ranges(weld, &entries[start], end - start, level + 1), level + 1);
    }
}

/* --- gathering -------------------------------------------------------------------------------------------- */

/* The faces of a primitive into entries, which has room for six, with the ranges of the first key. Returns how many. */
static size_t add_faces(const struct weld *weld, uint32_t id, struct entry *entries)
{
    static const uint8_t first[PRIMITIVE_KINDS] = {[PRIMITIVE_FRUSTUM] = PART_NARROW_CAP};
    static const uint8_t faces[PRIMITIVE_KINDS] = {[PRIMITIVE_PLANE] = 1, [PRIMITIVE_DISC] = 1, [PRIMITIVE_FRUSTUM] = 2,
                                                   [PRIMITIVE_BOX] = 6, [PRIMITIVE_TRIANGLE] = 1,
                                                   [PRIMITIVE_INSTANCE] = 1};
    uint8_t kind = plan_primitive(weld->plan, id)->kind;
    size_t count = 0;
    for (uint8_t i = 0; i < faces[kind]; i++) {
        struct entry *entry = &entries[count];
        *entry = (struct entry){.id = id, .part = (uint8_t)(first[kind] + i)};
        double tilt = tilt_of(weld, entry);
        set_normal_range(entry, 0, get_face(weld, entry).normal, tilt);
        count += tilt <= tilt_max;
    }
    return count;
}

enum { CELLS_MAX = 1 << 24 };

/* Before all faces are sorted by the first key, its values are cut into cells, and faces are dropped in whose cells
 * there is only one object: of one large mesh above a floor, nearly all. Ranges are far smaller than cells, but may
 * reach over to the next one. */
struct cells {
    size_t count;
    uint32_t *object; /* its number plus one; 0 for none, UINT32_MAX for several */
};

static size_t cell_of(const struct cells *cells, double key)
{
    double at = key > 0 ? 0.5 * key * (double)cells->count : 0; /* keys are below 2 */
    return (size_t)at;
}

static void mark(struct cells *cells, double key, uint32_t object)
{
    uint32_t *cell = &cells->object[cell_of(cells, key)];
    *cell = *cell == 0 || *cell == object + 1 ? object + 1 : UINT32_MAX;
}

static size_t drop_lonely(const struct weld *weld, struct entry *entries, size_t count)
{
    struct cells cells = {.count = count < CELLS_MAX / 8 ? 8 * count + 1 : CELLS_MAX};
    cells.object = memory_array(cells.count, sizeof *cells.object);
    for (size_t i = 0; i < count; i++) {
        mark(&cells, entries[i].low, primitive_of(weld, &entries[i])->object);
        mark(&cells, entries[i].high, primitive_of(weld, &entries[i])->object);
    }
    size_t kept = 0;
    for (size_t i = 0; i < count; i++)
        if (cells.object[cell_of(&cells, entries[i].low)] == UINT32_MAX ||
            cells.object[cell_of(&cells, entries[i].high)] == UINT32_MAX)
            entries[kept++] = entries[i];
    free(cells.object);
    return kept;
}

static int compare_welded(const void *left, const void *right)
{
    const struct welded *a = left, *b = right;
    return a->id < b->id ? -1 : a->id > b->id;
}

/* Gives each instance its part of plan->welded. */
static void distribute_welded(struct plan *plan)
{
    if (plan->welded_count > 0)
        qsort(plan->welded, plan->welded_count, sizeof *plan->welded, compare_welded);
    for (size_t i = 0; i < plan->welded_count; i++) {
        struct instance *instance = &plan->instances[plan_primitive(plan, plan->welded[i].id)->index];
        instance->welded = instance->welded_count++ == 0 ? &plan->welded[i] : instance->welded;
    }
}

void plan_weld(struct plan *plan, const struct scene *scene)
{
    struct weld weld = {.plan = plan, .scene = scene};
    if (plan->object_count < 2)
        return;
    size_t touching_count, count = 0;
    uint32_t *touching = plan_touching(plan, &touching_count);
    size_t room = plan->primitive_count + 5 * plan->count[PRIMITIVE_BOX] + plan->count[PRIMITIVE_FRUSTUM];
    struct entry *entries = memory_array(room + touching_count, sizeof *entries);
    for (size_t i = 0; i < plan->primitive_count; i++)
        if (!plan->objects[plan->primitives[i].object].shares_mesh)
            count += add_faces(&weld, plan->primitives[i].id, &entries[count]);
    for (size_t i = 0; i < touching_count; i++)
        count += add_faces(&weld, touching[i], &entries[count]);
    split(&weld, entries, drop_lonely(&weld, entries, count), 0);
    free(entries);
    free(touching);
    distribute_welded(plan);
}
