#include "math/vec3.h"

void vec3_frame(struct vec3 n, struct vec3 *t, struct vec3 *b)
{
    double sign = copysign(1.0, n.z);
    double a = -1.0 / (sign + n.z);
    double c = n.x * n.y * a;
    *t = vec3_make(1.0 + sign * n.x * n.x * a, sign * c, -sign * n.x);
    *b = vec3_make(c, sign + n.y * n.y * a, -n.y);
}
