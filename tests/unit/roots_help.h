/* Which roots a ray has with a primitive: for the tests of intersections. */
#ifndef WEFT_TESTS_ROOTS_HELP_H
#define WEFT_TESTS_ROOTS_HELP_H

#include "trace/intersect_flat.h"
#include "trace/intersect_round.h"

enum { ENTERS = 1, LEAVES = 2 };

static inline int which(struct roots roots)
{
    if (roots.enter > roots.leave)
        return 0;
    return (isfinite(roots.enter) ? ENTERS : 0) | (isfinite(roots.leave) ? LEAVES : 0);
}

#endif
