#include "trace/intersect.h"

#include <math.h>

/* An interval of the ray's parameter, empty if low > high. */
struct interval {
    double low, high;
};

static const struct interval everything = {-INFINITY, INFINITY};
static const struct interval nothing = {INFINITY, -INFINITY};

static struct span span_of(struct interval interval, uint8_t enter_part, uint8_t leave_part)
{
    uint8_t roots = interval.low <= interval.high ? SPAN_ENTER | SPAN_LEAVE : 0;
    return (struct span){interval.low, interval.high, roots, enter_part, leave_part};
}

struct span sphere_span(const struct sphere *sphere, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = vec3_sub(origin, sphere->center);
    double middle = -vec3_dot(o, direction);
    struct vec3 nearest = vec3_add_scaled(o, direction, middle);
    double discriminant = sphere->radius * sphere->radius - vec3_dot(nearest, nearest);
    if (!(discriminant >= 0))
        return span_of(nothing, 0, 0);
    double half_chord = sqrt(discriminant);
    return span_of((struct interval){middle - half_chord, middle + half_chord}, 0, 0);
}

/* The two roots of a t² + 2 b t + c for a ≠ 0, in order, from the discriminant b² − ac >= 0. The smaller root comes
 * from c / q, so nothing cancels; but for a ray that starts where it touches the surface, q and c are both rounding
 * errors, and their quotient must not exceed the larger root. */
static struct interval quadratic_roots(double a, double b, double c, double discriminant)
{
    double q = -(b + copysign(sqrt(discriminant), b));
    if (q == 0)
        return (struct interval){0, 0};
    double r0 = c / q, r1 = q / a;
    if (fabs(r0) > fabs(r1))
        r0 = copysign(r1, r0);
    return r0 < r1 ? (struct interval){r0, r1} : (struct interval){r1, r0};
}

struct span ellipsoid_span(const struct ellipsoid *ellipsoid, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = mat3_apply(&ellipsoid->frame, vec3_sub(origin, ellipsoid->center));
    struct vec3 d = mat3_apply(&ellipsoid->frame, direction);
    struct vec3 moment = vec3_cross(o, d);
    double a = vec3_dot(d, d);
    double discriminant = a - vec3_dot(moment, moment);
    if (!(discriminant >= 0))
        return span_of(nothing, 0, 0);
    return span_of(quadratic_roots(a, vec3_dot(o, d), vec3_dot(o, o) - 1, discriminant), 0, 0);
}

/* One root: entering at the front, leaving at the back, none along the plane or beyond all numbers. */
static struct span flat_span(double t, double cosine)
{
    bool met = cosine != 0 && isfinite(t);
    uint8_t roots = !met ? 0 : cosine < 0 ? SPAN_ENTER : SPAN_LEAVE;
    return (struct span){.enter = t, .leave = t, .roots = roots};
}

struct span plane_span(const struct plane *plane, struct vec3 origin, struct vec3 direction)
{
    double cosine = vec3_dot(plane->normal, direction);
    return flat_span((plane->offset - vec3_dot(plane->normal, origin)) / cosine, cosine);
}

struct span disc_span(const struct disc *disc, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = vec3_sub(origin, disc->center);
    double cosine = vec3_dot(disc->plane.normal, direction);
    struct span span = flat_span(-vec3_dot(disc->plane.normal, o) / cosine, cosine);
    struct vec3 p = vec3_add_scaled(o, direction, span.enter);
    double u = vec3_dot(disc->u, p), v = vec3_dot(disc->v, p);
    if (!(u * u + v * v <= 1))
        span.roots = 0;
    return span;
}

/* Where low <= o + t d <= high. */
static struct interval slab(double o, double d, double low, double high)
{
    if (d == 0)
        return o >= low && o <= high ? everything : nothing;
    double t0 = (low - o) / d, t1 = (high - o) / d;
    return d > 0 ? (struct interval){t0, t1} : (struct interval){t1, t0};
}

/* Where a ray is within the infinite cone or cylinder x² + y² <= (ρ + δ t)² on the nappe where ρ + δ t >= 0. With
 * the form ⟨p, q⟩ = px qx + py qy − pρ qρ: a = ⟨d, d⟩, b = ⟨o, d⟩, c = ⟨o, o⟩. The start must be near the solid (approach):
 * then no large numbers cancel. */
static struct interval quadric_interval(double ox, double oy, double rho, double dx, double dy, double delta)
{
    double a = dx * dx + dy * dy - delta * delta;
    double b = ox * dx + oy * dy - rho * delta;
    double c = ox * ox + oy * oy - rho * rho;
    if (a == 0 && b == 0)
        return c <= 0 ? everything : nothing;
    if (a == 0) {
        double root = -c / (2 * b);
        return b < 0 ? (struct interval){root, INFINITY} : (struct interval){-INFINITY, root};
    }
    double discriminant = b * b - a * c;
    if (a > 0)
        return discriminant >= 0 ? quadratic_roots(a, b, c, discriminant) : nothing;
    /* a < 0: the ray is steeper than the side, meets each nappe once, and is inside beyond both roots. */
    struct interval roots = quadratic_roots(a, b, c, discriminant > 0 ? discriminant : 0);
    return delta > 0 ? (struct interval){roots.high, INFINITY} : (struct interval){-INFINITY, roots.low};
}

/* The side alone: each end of the quadric's interval that lies between the end planes. */
static struct span open_span(struct interval side, struct interval ends)
{
    struct span span = {.enter = side.low, .leave = side.high};
    if (side.low <= side.high && side.low >= ends.low && side.low <= ends.high)
        span.roots |= SPAN_ENTER;
    if (side.low <= side.high && side.high >= ends.low && side.high <= ends.high)
        span.roots |= SPAN_LEAVE;
    if (isinf(side.low))
        span.roots &= (uint8_t)~SPAN_ENTER;
    if (isinf(side.high))
        span.roots &= (uint8_t)~SPAN_LEAVE;
    return span;
}

/* From far away, a, b and c are small differences of large numbers, whose errors grow as the square of the distance. So
 * the ray is first taken to where it comes nearest to the narrow end, lengths along the axis counted in units in which
 * the solid is as long as it is wide: a ray that meets the solid is then at most about a radius from the axis, and all
 * that is lost is one rounding of the distance. Returns the parameter of that point, which *o becomes. */
static double approach(const struct frustum *frustum, struct vec3 *o, struct vec3 d)
{
    double shorten = frustum->radius / frustum->height + frustum->slope;
    struct vec3 balance = {1, 1, shorten * shorten};
    struct vec3 weighted = vec3_mul(d, balance);
    double start = -vec3_dot(*o, weighted) / vec3_dot(d, weighted);
    *o = vec3_add_scaled(*o, d, start);
    return start;
}

static struct interval shifted(struct interval interval, double by)
{
    return (struct interval){interval.low + by, interval.high + by};
}

struct span frustum_span(const struct frustum *frustum, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = mat3_apply(&frustum->frame, vec3_sub(origin, frustum->origin));
    struct vec3 d = mat3_apply(&frustum->frame, direction);
    double start = approach(frustum, &o, d);
    struct interval ends = shifted(slab(o.z, d.z, 0, frustum->height), start);
    if (!(ends.low <= ends.high))
        return span_of(nothing, 0, 0);
    struct interval side = quadric_interval(o.x, o.y, frustum->radius + frustum->slope * o.z, d.x, d.y,
                                            frustum->slope * d.z);
    side = shifted(side, start);
    if (frustum->open)
        return open_span(side, ends);
    uint8_t first_cap = d.z > 0 ? PART_NARROW_CAP : PART_WIDE_CAP;
    uint8_t last_cap = d.z > 0 ? PART_WIDE_CAP : PART_NARROW_CAP;
    bool enter_side = side.low > ends.low, leave_side = side.high < ends.high;
    struct interval both = {enter_side ? side.low : ends.low, leave_side ? side.high : ends.high};
    return span_of(both, enter_side ? PART_SIDE : first_cap, leave_side ? PART_SIDE : last_cap);
}

struct span box_span(const struct box *box, struct vec3 origin, struct vec3 direction)
{
    struct vec3 o = mat3_apply(&box->frame, origin);
    struct vec3 d = mat3_apply(&box->frame, direction);
    const double os[3] = {o.x, o.y, o.z}, ds[3] = {d.x, d.y, d.z};
    const double lows[3] = {box->low.x, box->low.y, box->low.z}, highs[3] = {box->high.x, box->high.y, box->high.z};
    struct interval inside = everything;
    uint8_t enter_part = 0, leave_part = 0;
    for (uint8_t axis = 0; axis < 3; axis++) {
        struct interval between = slab(os[axis], ds[axis], lows[axis], highs[axis]);
        uint8_t positive = (uint8_t)(2 * axis), negative = (uint8_t)(2 * axis + 1);
        if (between.low > inside.low) {
            inside.low = between.low;
            enter_part = ds[axis] > 0 ? negative : positive;
        }
        if (between.high < inside.high) {
            inside.high = between.high;
            leave_part = ds[axis] > 0 ? positive : negative;
        }
    }
    return span_of(inside, enter_part, leave_part);
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

struct shear shear_of(struct vec3 direction)
{
    const double d[3] = {direction.x, direction.y, direction.z};
    uint8_t z = fabs(d[0]) > fabs(d[1]) ? (fabs(d[0]) > fabs(d[2]) ? 0 : 2) : (fabs(d[1]) > fabs(d[2]) ? 1 : 2);
    uint8_t x = (uint8_t)((z + 1) % 3), y = (uint8_t)((z + 2) % 3);
    if (d[z] < 0) { /* keeps the winding */
        uint8_t swap = x;
        x = y;
        y = swap;
    }
    return (struct shear){x, y, z, d[x] / d[z], d[y] / d[z], 1 / d[z]};
}

/* A vertex as seen along the ray: x and y across it, z along it (before scaling by sz). */
static struct vec3 sheared(struct vec3 vertex, struct vec3 origin, const struct shear *shear)
{
    const double v[3] = {vertex.x - origin.x, vertex.y - origin.y, vertex.z - origin.z};
    double z = v[shear->z];
    return vec3_make(v[shear->x] - shear->sx * z, v[shear->y] - shear->sy * z, z);
}

/* Twice the signed areas that the ray spans with the edges opposite a, b and c. The sign of each is exact or
 * zero: a rounded difference of rounded products cannot turn it. */
static struct vec3 edge_areas(struct vec3 a, struct vec3 b, struct vec3 c)
{
    return vec3_make(c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
}

/* On which side of the edge from p to q the ray passes, given their area. A ray through the edge itself is taken to
 * pass beside it by an infinitesimal step along x and a yet smaller one along y (Edelsbrunner and Mücke, "Simulation
 * of Simplicity", ACM TOG 9(1), 1990): so it meets exactly one of the triangles around an edge or a vertex. */
static bool passes_left(struct vec3 p, struct vec3 q, double area)
{
    return area > 0 || (area == 0 && (p.y > q.y || (p.y == q.y && p.x < q.x)));
}

struct span triangle_span(const struct triangle *triangle, struct vec3 origin, struct vec3 direction,
                          const struct shear *shear)
{
    struct vec3 a = sheared(triangle->a, origin, shear);
    struct vec3 b = sheared(triangle->b, origin, shear);
    struct vec3 c = sheared(triangle->c, origin, shear);
    struct vec3 area = edge_areas(a, b, c);
    bool left = passes_left(c, b, area.x);
    double total = area.x + area.y + area.z;
    if (passes_left(a, c, area.y) != left || passes_left(b, a, area.z) != left || total == 0)
        return (struct span){0};
    const struct plane *plane = &triangle->plane;
    double t = (plane->offset - vec3_dot(plane->normal, origin)) / vec3_dot(plane->normal, direction);
    return flat_span(t, -total); /* counter-clockwise, so seen from the front, makes the areas positive */
}

struct vec3 triangle_weights(const struct triangle *triangle, struct vec3 origin, const struct shear *shear)
{
    struct vec3 area = edge_areas(sheared(triangle->a, origin, shear), sheared(triangle->b, origin, shear),
                                  sheared(triangle->c, origin, shear));
    double total = area.x + area.y + area.z;
    return vec3_make(area.x / total, area.y / total, area.z / total);
}
