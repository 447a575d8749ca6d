#include "trace/intersect.h"

#include "math/twofold.h"
#include "trace/intersect_flat.h"
#include "trace/intersect_round.h"

struct frustum frustum_make(struct mat3 frame, struct vec3 narrow, struct vec3 wide, double radius, double slope,
                            double height, bool open)
{
    double shorten = radius / height + slope;
    struct vec3 axis = vec3_normalize(frame.z);
    return (struct frustum){
        .frame = frame,
        .origin = narrow,
        .radius = radius,
        .slope = slope,
        .height = height,
        .balance = shorten * shorten,
        .axis = axis,
        .low = vec3_dot(axis, narrow),
        .high = vec3_dot(axis, wide),
        .open = open,
    };
}

/* --- triangles -------------------------------------------------------------------------------------------- */

/* a b − c d, to about one rounding however much cancels. */
static double difference_of_products(double a, double b, double c, double d)
{
    struct twofold ab = twofold_product(a, b), cd = twofold_product(c, d);
    return (ab.high - cd.high) + (ab.low - cd.low);
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
