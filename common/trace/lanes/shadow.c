/* What stands between points and lights, packet by packet. */
#include "trace/lanes/exports.h"
#include "trace/lanes/instance.h"
#include "trace/lanes/walk.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

static inline void take_roots(struct packet *p, int i, struct roots roots, enum wall wall, const struct taken *taken)
{
    struct window window = packet_window(p, i);
    roots.leave += leave_delay(taken->delay, roots.leave, window.reach);
    window.t_max = p->t[i];
    struct roots ahead = roots_ahead(roots, &window, taken->id, wall);
    p->enter[i] = ahead.enter;
    p->leave[i] = ahead.leave;
}

static void push_crossing(struct packet *p, int i, double t, double id, enum side side)
{
    struct crossing crossing = {t, p->first_ray + (uint32_t)i, (uint32_t)id, (uint8_t)side};
    crossing_list_push(p->crossings, &crossing);
}

static void push_crossings(struct packet *p, int base, int end, double id)
{
    for (int i = base; i < end; i++) {
        if (p->enter[i] < INFINITY)
            push_crossing(p, i, p->enter[i], id, SIDE_ENTER);
        if (p->leave[i] < INFINITY)
            push_crossing(p, i, p->leave[i], id, SIDE_LEAVE);
    }
}

/* Rays that meet what blocks light are of no more interest. What lets light through leaves its roots behind. */
static inline void take_found(struct packet *p, int base, int end, const struct taken *taken)
{
    if (!taken->blocks_light) {
        push_crossings(p, base, end, taken->id);
        return;
    }
    LANES_LOOP
    for (int i = base; i < end; i++) {
        double nearest = p->enter[i] < p->leave[i] ? p->enter[i] : p->leave[i];
        p->t[i] = nearest < INFINITY ? -INFINITY : p->t[i];
    }
}

void LANES_NAME(shadow)(const struct plan *plan, const struct ray_batch *rays, uint8_t *blocked,
                        struct crossing_list *crossings)
{
    _Alignas(64) double t[PACKET_RAYS], key[PACKET_RAYS];
    struct packet packet;
    packet.crossings = crossings;
    for (size_t first = 0; first < rays->count; first += PACKET_RAYS) {
        int count = rays->count - first < PACKET_RAYS ? (int)(rays->count - first) : PACKET_RAYS;
        packet_start(&packet, plan, rays, first, count, t, key);
        packet_walk_scene(&packet, plan, count);
        for (int i = 0; i < count; i++)
            blocked[first + (size_t)i] = t[i] == -INFINITY;
    }
}
