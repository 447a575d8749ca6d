#include "trace/intersect.h"

#include "trace/intersect_flat.h"
#include "trace/intersect_round.h"

/* --- pieces ----------------------------------------------------------------------------------------------- */

uint8_t box_part(const struct box *box, struct vec3 origin, struct vec3 direction, enum side side)
{
    struct vec3 o = mat3_apply(&box->frame, origin), d = mat3_apply(&box->frame, direction);
    const double os[3] = {o.x, o.y, o.z}, ds[3] = {d.x, d.y, d.z};
    const double lows[3] = {box->low.x, box->low.y, box->low.z}, highs[3] = {box->high.x, box->high.y, box->high.z};
    struct interval inside = {-INFINITY, INFINITY};
    uint8_t part = 0;
    for (uint8_t axis = 0; axis < 3; axis++) {
        struct interval slab = interval_of_slab(os[axis], ds[axis], lows[axis], highs[axis]);
        bool nearer = side == SIDE_ENTER ? slab.low > inside.low : slab.high < inside.high;
        if (nearer)
            part = (uint8_t)(2 * axis + ((ds[axis] > 0) == (side == SIDE_ENTER)));
        inside = interval_cut(inside, slab);
    }
    return part;
}

uint8_t frustum_part(const struct frustum *frustum, struct vec3 origin, struct vec3 direction, enum side side)
{
    struct frustum_cut cut = frustum_cut(frustum, origin, direction);
    bool at_end = side == SIDE_ENTER ? cut.ends.low >= cut.side.low : cut.ends.high <= cut.side.high;
    if (frustum->open || !at_end || !(cut.ends.low <= cut.ends.high))
        return PART_SIDE;
    bool upwards = mat3_apply(&frustum->frame, direction).z > 0;
    return upwards == (side == SIDE_ENTER) ? PART_NARROW_CAP : PART_WIDE_CAP;
}

/* --- triangles -------------------------------------------------------------------------------------------- */

/* The two parts of a product of doubles, exactly: high + low = a b (Dekker 1971, with Veltkamp's splitting). */
static double product_error(double a, double b, double product)
{
    double a_big = 134217729 * a, b_big = 134217729 * b; /* 2^27 + 1 */
    double a_high = a_big - (a_big - a), b_high = b_big - (b_big - b);
    double a_low = a - a_high, b_low = b - b_high;
    return a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low);
}

/* a b − c d, to about one rounding however much cancels. */
static double difference_of_products(double a, double b, double c, double d)
{
    double ab = a * b, cd = c * d;
    return (ab - cd) + (product_error(a, b, ab) - product_error(c, d, cd));
}

struct triangle triangle_make(struct vec3 a, struct vec3 b, struct vec3 c)
{
    struct vec3 u = vec3_sub(b, a), v = vec3_sub(c, a);
    struct vec3 across = {difference_of_products(u.y, v.z, u.z, v.y), difference_of_products(u.z, v.x, u.x, v.z),
                          difference_of_products(u.x, v.y, u.y, v.x)};
    struct triangle triangle = {.a = a, .b = b, .c = c};
    if (!vec3_is_zero(across)) {
        triangle.plane.normal = vec3_normalize(across);
        triangle.plane.offset = vec3_dot(triangle.plane.normal, a);
    }
    return triangle;
}

struct vec3 triangle_weights(const struct triangle *triangle, struct vec3 origin, const struct shear *shear)
{
    struct vec3 area = edge_areas(sheared(triangle->a, origin, shear), sheared(triangle->b, origin, shear),
                                  sheared(triangle->c, origin, shear));
    double total = area.x + area.y + area.z;
    return vec3_make(area.x / total, area.y / total, area.z / total);
}
