#include "scene/polygon.h"

#include <assert.h>
#include <stdbool.h>
#include <string.h>

/* A polygon seen along its normal, from where it runs counter-clockwise. While ears are cut off, next and
 * previous link the corners that are left. */
struct outline {
    size_t count;
    double x[POLYGON_CORNERS_MAX], y[POLYGON_CORNERS_MAX];
    uint16_t next[POLYGON_CORNERS_MAX], previous[POLYGON_CORNERS_MAX];
    bool no_ear[POLYGON_CORNERS_MAX]; /* known not to be one */
};

/* Twice the area times the unit normal, by Newell's method (Sutherland, Sproull, Schumacker, 1974). */
static struct vec3 mean_normal(const struct vec3 *points, const uint32_t *corners, size_t count)
{
    struct vec3 normal = {0}, first = points[corners[0]];
    for (size_t i = 0; i + 1 < count; i++) {
        struct vec3 a = vec3_sub(points[corners[i]], first), b = vec3_sub(points[corners[i + 1]], first);
        normal = vec3_add(normal, vec3_cross(a, b));
    }
    return normal;
}

/* Drops the coordinate in which the normal is longest; the other two, swapped if need be, keep the sense. */
static void project(struct outline *o, const struct vec3 *points, const uint32_t *corners, size_t count,
                    struct vec3 normal)
{
    double longest = vec3_max_abs(normal);
    o->count = count;
    for (size_t i = 0; i < count; i++) {
        struct vec3 p = points[corners[i]];
        bool drop_z = fabs(normal.z) == longest, drop_y = !drop_z && fabs(normal.y) == longest;
        double u = drop_z ? p.x : drop_y ? p.z : p.y, v = drop_z ? p.y : drop_y ? p.x : p.z;
        bool swap = (drop_z ? normal.z : drop_y ? normal.y : normal.x) < 0;
        o->x[i] = swap ? v : u;
        o->y[i] = swap ? u : v;
        o->next[i] = (uint16_t)((i + 1) % count);
        o->previous[i] = (uint16_t)((i + count - 1) % count);
        o->no_ear[i] = false;
    }
}

/* Positive if a, b, c turn left. */
static double turn(const struct outline *o, size_t a, size_t b, size_t c)
{
    return (o->x[b] - o->x[a]) * (o->y[c] - o->y[a]) - (o->y[b] - o->y[a]) * (o->x[c] - o->x[a]);
}

/* --- checking --------------------------------------------------------------------------------------------- */

static double extent_of(const struct vec3 *points, size_t count)
{
    double extent = 0;
    for (size_t i = 1; i < count; i++)
        extent = fmax(extent, vec3_max_abs(vec3_sub(points[i], points[0])));
    return extent;
}

static enum status check_flat(const struct vec3 *points, size_t count, struct vec3 normal, struct error *error)
{
    enum { LINE_SHARE_BITS = 40 }; /* area below 2^-40 of the extent's square is rounding */
    double extent = extent_of(points, count);
    if (!(vec3_max_abs(normal) > extent * extent / (double)(1ull << LINE_SHARE_BITS)))
        return error_set(error, STATUS_INPUT, "expected corners that enclose an area, found none enclosed");
    struct vec3 unit = vec3_normalize(normal);
    for (size_t i = 1; i < count; i++) {
        double height = fabs(vec3_dot(unit, vec3_sub(points[i], points[0])));
        if (height > POLYGON_FLATNESS * extent)
            return error_set(error, STATUS_INPUT,
                             "expected corners in one plane (to 1e-6 of the extent), found corner %zu %.3g off",
                             i, height);
    }
    return STATUS_OK;
}

static bool within(double a, double b, double c)
{
    return (a <= c && c <= b) || (b <= c && c <= a);
}

/* c, which is on the line through a and b, lies between them. */
static bool between(const struct outline *o, size_t a, size_t b, size_t c)
{
    return within(o->x[a], o->x[b], o->x[c]) && within(o->y[a], o->y[b], o->y[c]);
}

/* The edges a b and c d have a point in common. */
static bool edges_meet(const struct outline *o, size_t a, size_t b, size_t c, size_t d)
{
    double abc = turn(o, a, b, c), abd = turn(o, a, b, d), cda = turn(o, c, d, a), cdb = turn(o, c, d, b);
    bool split_cd = (abc > 0 && abd < 0) || (abc < 0 && abd > 0);
    bool split_ab = (cda > 0 && cdb < 0) || (cda < 0 && cdb > 0);
    return (split_cd && split_ab) || (abc == 0 && between(o, a, b, c)) || (abd == 0 && between(o, a, b, d)) ||
           (cda == 0 && between(o, c, d, a)) || (cdb == 0 && between(o, c, d, b));
}

/* The edge from b folds back onto the one that led to it. */
static bool folds_back(const struct outline *o, size_t a, size_t b, size_t c)
{
    double along = (o->x[b] - o->x[a]) * (o->x[c] - o->x[b]) + (o->y[b] - o->y[a]) * (o->y[c] - o->y[b]);
    return turn(o, a, b, c) == 0 && along < 0;
}

static enum status check_simple(const struct outline *o, struct error *error)
{
    for (size_t i = 0; i < o->count; i++) {
        if (folds_back(o, i, o->next[i], o->next[o->next[i]]))
            return error_set(error, STATUS_INPUT,
                             "expected edges that meet only at corners, found that %zu-%u is folded back on", i,
                             o->next[i]);
        for (size_t j = i + 2; j < o->count; j++)
            if (o->next[j] != i && edges_meet(o, i, o->next[i], j, o->next[j]))
                return error_set(error, STATUS_INPUT,
                                 "expected edges that meet only at corners, found that %zu-%u and %zu-%u meet",
                                 i, o->next[i], j, o->next[j]);
    }
    return STATUS_OK;
}

enum status polygon_check(const struct vec3 *points, size_t count, struct error *error)
{
    uint32_t corners[POLYGON_CORNERS_MAX];
    assert(count >= 3 && count <= POLYGON_CORNERS_MAX);
    for (size_t i = 0; i < count; i++) {
        corners[i] = (uint32_t)i;
        if (vec3_is_zero(vec3_sub(points[i], points[(i + 1) % count])))
            return error_set(error, STATUS_INPUT,
                             "expected neighbouring corners apart, found %zu and %zu in one place", i,
                             (i + 1) % count);
    }
    struct vec3 normal = mean_normal(points, corners, count);
    enum status status = check_flat(points, count, normal, error);
    if (status != STATUS_OK)
        return status;
    struct outline outline;
    project(&outline, points, corners, count, normal);
    return check_simple(&outline, error);
}

/* --- cutting ---------------------------------------------------------------------------------------------- */

/* Seen along the mean normal, the corners appear one after the other, counter-clockwise, to somebody at the
 * first one, and all on the left of the first edge, so within half a turn. */
bool polygon_is_fan(const struct vec3 *points, const uint32_t *corners, size_t count)
{
    struct vec3 normal = mean_normal(points, corners, count), first = points[corners[0]];
    struct vec3 edge = vec3_sub(points[corners[1]], first), last = edge;
    for (size_t i = 2; i < count; i++) {
        struct vec3 next = vec3_sub(points[corners[i]], first);
        if (!(vec3_dot(normal, vec3_cross(last, next)) > 0 && vec3_dot(normal, vec3_cross(edge, next)) > 0))
            return false;
        last = next;
    }
    return true;
}

/* The corner turns left, and the triangle with its neighbours holds no other corner, not even on its edge. */
static bool is_ear(const struct outline *o, size_t b)
{
    size_t a = o->previous[b], c = o->next[b];
    if (!(turn(o, a, b, c) > 0))
        return false;
    for (size_t i = o->next[c]; i != a; i = o->next[i])
        if (turn(o, a, b, i) >= 0 && turn(o, b, c, i) >= 0 && turn(o, c, a, i) >= 0)
            return false;
    return true;
}

static void cut_off(struct outline *o, size_t b)
{
    size_t a = o->previous[b], c = o->next[b];
    o->next[a] = (uint16_t)c;
    o->previous[c] = (uint16_t)a;
    o->no_ear[a] = o->no_ear[c] = false; /* only the neighbours can become ears */
}

/* The next corner from `from` on that can be cut off, of `left`. */
static size_t next_ear(struct outline *o, size_t from, size_t left)
{
    size_t corner = from;
    for (size_t tried = 0; tried < left; tried++, corner = o->next[corner]) {
        if (!o->no_ear[corner] && is_ear(o, corner))
            return corner;
        o->no_ear[corner] = true;
    }
    return from; /* no polygon: cut anywhere */
}

/* Brings the triangle that has the edge 0 1 to the front, beginning with that edge. */
static void put_first_edge_first(uint32_t *triangles, size_t count)
{
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < 3; k++) {
            uint32_t *t = triangles + 3 * i;
            if (t[k] != 0 || t[(k + 1) % 3] != 1)
                continue;
            uint32_t front[3] = {0, 1, t[(k + 2) % 3]};
            memcpy(t, triangles, sizeof front);
            memcpy(triangles, front, sizeof front);
            return;
        }
}

void polygon_triangulate(const struct vec3 *points, const uint32_t *corners, size_t count, uint32_t *triangles)
{
    assert(count >= 3 && count <= POLYGON_CORNERS_MAX);
    struct outline outline;
    project(&outline, points, corners, count, mean_normal(points, corners, count));
    size_t corner = count - 1;
    for (size_t left = count, made = 0; left >= 3; left--, made++) {
        corner = next_ear(&outline, corner, left);
        size_t a = outline.previous[corner], c = outline.next[corner];
        uint32_t *t = triangles + 3 * made;
        t[0] = (uint32_t)a;
        t[1] = (uint32_t)corner;
        t[2] = (uint32_t)c;
        cut_off(&outline, corner);
        corner = a;
    }
    put_first_edge_first(triangles, count - 2);
    for (size_t i = 0; i < 3 * (count - 2); i++)
        triangles[i] = corners[triangles[i]];
}
