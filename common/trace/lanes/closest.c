/* The nearest hits of rays, packet by packet. */
#include "trace/lanes/exports.h"
#include "trace/lanes/instance.h"
#include "trace/lanes/walk.h"

LANES_DECLARE_THESE(LANES_SUFFIX);

/* Keeps a hit if it is nearer than the best so far, or as near with a lower key. */
static inline void take_roots(struct packet *p, int i, struct roots roots, enum wall wall,
                              const struct taken *taken)
{
    struct window window = packet_window(p, i);
    roots.leave += leave_delay(taken->delay, roots.leave, window.reach);
    struct roots ahead = roots_ahead(roots, &window, taken->id, wall);
    double t = roots_nearest(ahead), key = roots_nearest_key(ahead, taken->id);
    double tied = key < p->key[i] ? key : p->key[i];
    double kept = t == p->t[i] ? tied : p->key[i];
    p->key[i] = t < p->t[i] ? key : kept;
    p->t[i] = t < p->t[i] ? t : p->t[i];
}

static inline void take_found(struct packet *p, int base, int end, const struct taken *taken)
{
    (void)p, (void)base, (void)end, (void)taken;
}

void LANES_NAME(closest)(const struct plan *plan, const struct ray_batch *rays, struct hit_batch *hits)
{
    struct packet packet;
    for (size_t first = 0; first < rays->count; first += PACKET_RAYS) {
        int count = rays->count - first < PACKET_RAYS ? (int)(rays->count - first) : PACKET_RAYS;
        packet_start(&packet, plan, rays, first, count, hits->t + first, hits->key + first);
        packet_walk_scene(&packet, plan, count);
    }
}
