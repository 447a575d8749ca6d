/* The scalar kernel: every ray against every primitive. Plain on purpose: the others are measured against it. */
#include <math.h>

#include "trace/kernel.h"

/* Whether what goes into it must come out of it again. */
static bool is_solid(const struct plan *plan, const struct primitive *primitive)
{
    switch ((enum primitive_kind)primitive->kind) {
    case PRIMITIVE_SPHERE:
    case PRIMITIVE_ELLIPSOID:
    case PRIMITIVE_BOX:
        return true;
    case PRIMITIVE_FRUSTUM:
        return !plan->frustums[primitive->index].open;
    default:
        return false;
    }
}

/* In the order of (t, key), after where the ray begins. */
static bool is_beyond(const struct ray *ray, double t, uint32_t id, enum side side)
{
    return t > ray->t_min || (t == ray->t_min && hit_key(id, side) > ray->key_min);
}

/* The roots of the primitive that the ray itself starts on: none, or its far wall if the ray goes in. What goes into a
 * solid comes out, also where rounding puts the far wall behind the ray's start or has the ray miss altogether. */
static struct span own_roots(const struct plan *plan, const struct ray *ray, uint32_t id, struct span span)
{
    const struct primitive *primitive = &plan->primitives[id];
    bool solid = is_solid(plan, primitive);
    if (ray->departure == DEPART_OUTWARD || (!solid && primitive->kind != PRIMITIVE_FRUSTUM))
        span.roots = 0;
    else
        span.roots = solid ? SPAN_LEAVE : span.roots & SPAN_LEAVE;
    if (ray->key_min == KEY_NONE)
        span.leave = span.leave > 0 ? span.leave : 0;
    else if (!is_beyond(ray, span.leave, id, SIDE_LEAVE))
        span.roots = 0;
    return span;
}

/* The roots at which the ray can hit the primitive. */
static struct span roots_ahead(const struct plan *plan, const struct ray *ray, const struct shear *shear, uint32_t id)
{
    struct span span = plan_span(plan, id, ray->origin, ray->direction, shear);
    if (id == ray->from) {
        span = own_roots(plan, ray, id, span);
    } else {
        if (!is_beyond(ray, span.enter, id, SIDE_ENTER))
            span.roots &= (uint8_t)~SPAN_ENTER;
        if (!is_beyond(ray, span.leave, id, SIDE_LEAVE))
            span.roots &= (uint8_t)~SPAN_LEAVE;
    }
    if (!(span.enter < ray->t_max))
        span.roots &= (uint8_t)~SPAN_ENTER;
    if (!(span.leave < ray->t_max))
        span.roots &= (uint8_t)~SPAN_LEAVE;
    return span;
}

static void ref_closest(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits)
{
    for (size_t i = 0; i < rays->count; i++) {
        struct ray ray = ray_batch_get(rays, i);
        struct shear shear = shear_of(ray.direction);
        hits->id[i] = PRIMITIVE_NONE;
        hits->t[i] = INFINITY;
        for (uint32_t id = 0; id < plan->primitive_count; id++) { /* rising: at equal t the lowest id stays */
            struct span span = roots_ahead(plan, &ray, &shear, id);
            bool enters = (span.roots & SPAN_ENTER) && span.enter < hits->t[i];
            bool leaves = !enters && (span.roots & SPAN_LEAVE) && span.leave < hits->t[i];
            if (!enters && !leaves)
                continue;
            hits->t[i] = enters ? span.enter : span.leave;
            hits->id[i] = id;
            hits->side[i] = enters ? SIDE_ENTER : SIDE_LEAVE;
            hits->part[i] = enters ? span.enter_part : span.leave_part;
        }
    }
}

static void push_crossings(struct crossing_list *crossings, size_t ray, uint32_t id, const struct span *span)
{
    if (span->roots & SPAN_ENTER)
        crossing_list_push(crossings, &(struct crossing){span->enter, (uint32_t)ray, id, SIDE_ENTER, span->enter_part});
    if (span->roots & SPAN_LEAVE)
        crossing_list_push(crossings, &(struct crossing){span->leave, (uint32_t)ray, id, SIDE_LEAVE, span->leave_part});
}

static void ref_shadow(const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked,
                       struct crossing_list *crossings)
{
    for (size_t i = 0; i < rays->count; i++) {
        struct ray ray = ray_batch_get(rays, i);
        struct shear shear = shear_of(ray.direction);
        blocked[i] = 0;
        for (uint32_t id = 0; id < plan->primitive_count && !blocked[i]; id++) {
            struct span span = roots_ahead(plan, &ray, &shear, id);
            if (plan->primitives[id].blocks_light)
                blocked[i] = span.roots != 0;
            else
                push_crossings(crossings, i, id, &span);
        }
    }
}

const struct kernel kernel_ref = {"ref", ref_closest, ref_shadow};
