#include "math/vec3.h"

#include <stdint.h>
#include <string.h>

/* 2^-e for the binary exponent e of a finite x > 0, as far as that is a normal number: x times it is within 1..4 or,
 * for a subnormal x, within 2^-51..2. */
static double power_of_two_near_reciprocal(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    uint64_t exponent = bits >> 52 & 0x7ff;
    uint64_t reciprocal = exponent >= 2046 ? 1 : 2046 - exponent;
    if (reciprocal > 2046)
        reciprocal = 2046;
    bits = reciprocal << 52;
    double scale;
    memcpy(&scale, &bits, sizeof scale);
    return scale;
}

struct vec3 vec3_normalize(struct vec3 a)
{
    a = vec3_scale(a, power_of_two_near_reciprocal(vec3_max_abs(a)));
    double length = vec3_length(a);
    return vec3_make(a.x / length, a.y / length, a.z / length);
}

void vec3_frame(struct vec3 n, struct vec3 *t, struct vec3 *b)
{
    double sign = copysign(1.0, n.z);
    double a = -1.0 / (sign + n.z);
    double c = n.x * n.y * a;
    *t = vec3_make(1.0 + sign * n.x * n.x * a, sign * c, -sign * n.x);
    *b = vec3_make(c, sign + n.y * n.y * a, -n.y);
}
