/*
 * Which of a primitive's roots a ray can hit: those beyond (t_min, key_min) and before t_max, and on the primitive that
 * it starts on none, or the far wall. Without branches and in doubles alone, as intersect.h says.
 */
#ifndef WEFT_TRACE_AHEAD_H
#define WEFT_TRACE_AHEAD_H

#include "trace/intersect.h"
#include "trace/ray.h"

/* What bounds a ray's hits; keys and ids are exact in a double. */
struct window {
    double t_min, t_max;
    double key_min; /* LANE_KEY_NONE for KEY_NONE */
    double from;
    double inward; /* 1 if the ray departs inwards, else 0 */
    double reach;  /* the origin's largest coordinate, of which leave_delay takes its share */
};

static inline struct window window_of(const struct ray *ray)
{
    return (struct window){ray->t_min, ray->t_max, (double)ray->key_min,
                           ray->from == PRIMITIVE_NONE ? LANE_FROM_NONE : ray->from,
                           ray->departure == DEPART_INWARD, vec3_max_abs(ray->origin)};
}

/* What a primitive has behind its surface. */
enum wall {
    WALL_NONE, /* flat: nothing */
    WALL_OPEN, /* a far wall, perhaps */
    WALL_SOLID /* a far wall: what goes in comes out */
};

/* What rounding does to a primitive's roots grows with the ray's distance, times the flatness of what is flat: a cone
 * 2^20 times as wide as high, seen from 64 extents away, is moved by some 2^-24 of the extent across, which is within
 * what the boxes of a tree are grown by. From yet farther away the ray is intersected from where it comes near the eye,
 * around which the tree is. */
#define DISTANT 64

/* `extent` is the tree's, 0 without one. */
static inline bool is_distant(struct vec3 point, double extent)
{
    return extent > 0 && vec3_max_abs(point) > DISTANT * extent;
}

/* How far along its way a ray is taken before it is intersected: 0 unless it is distant. What it hits is still told by
 * t from its own origin. If it is distant then, too, it meets nothing of the tree. */
static inline double ray_shift(struct vec3 origin, struct vec3 direction, double extent)
{
    double shift = -vec3_dot(origin, direction) - 2 * extent;
    return is_distant(origin, extent) && shift > 0 && shift < INFINITY ? shift : 0;
}

/* More than what is rounded off where the shift is added to roots or taken from bounds on t. */
static inline double shift_slop(double shift)
{
    return 0x1p-50 * shift;
}

/* The roots of a ray that was shifted, from its own origin. */
static inline struct roots roots_unshifted(struct roots roots, double shift)
{
    return shift > 0 ? (struct roots){roots.enter + shift, roots.leave + shift} : roots;
}

/* Moves a leaving root at t farther along by that share of |t| + reach. */
static inline double leave_delay(double share, double t, double reach)
{
    return share * (fabs(t) + reach);
}

/* t if it lies beyond (t_min, key_min) for a root of that key, else INFINITY. */
static inline double root_beyond(double t, double key, const struct window *ray)
{
    double tied = key > ray->key_min ? t : INFINITY;
    double later = t > ray->t_min ? t : INFINITY;
    return t == ray->t_min ? tied : later;
}

/* The roots of primitive `id` at which the ray can hit it; INFINITY for the others.
 *
 * What goes into a solid comes out, also where rounding puts the far wall behind the ray's start or has the ray miss
 * altogether. (Choices between doubles, not logic with truth values: gcc 12 does not vectorise that reliably.) */
static inline struct roots roots_ahead(struct roots roots, const struct window *ray, double id, enum wall wall)
{
    double enter = root_beyond(roots.enter, 2 * id, ray), leave = root_beyond(roots.leave, 2 * id + 1, ray);
    double none = wall == WALL_SOLID ? 0 : INFINITY, out = roots.leave > 0 ? roots.leave : 0;
    double wall_ahead = roots.leave == roots.leave ? out : none;
    double departing = ray->key_min == LANE_KEY_NONE ? wall_ahead : leave;
    double own = ray->inward != 0 ? departing : INFINITY;
    double met = wall == WALL_SOLID ? (roots.enter > roots.leave ? INFINITY : leave) : leave;
    enter = id == ray->from ? INFINITY : enter;
    leave = id == ray->from ? (wall == WALL_NONE ? INFINITY : own) : met;
    return (struct roots){enter < ray->t_max ? enter : INFINITY, leave < ray->t_max ? leave : INFINITY};
}

/* The nearer of two roots ahead, INFINITY if there is none. Never −0 (which the sum makes 0): it ties with 0, and which
 * of the two were kept would depend on the order of the search. */
static inline double roots_nearest(struct roots ahead)
{
    return (ahead.enter < INFINITY ? ahead.enter : ahead.leave) + 0.0;
}

/* The key of a root of primitive `id`: of the nearer one. */
static inline double roots_nearest_key(struct roots ahead, double id)
{
    return ahead.enter < INFINITY ? 2 * id : 2 * id + 1;
}

#endif
