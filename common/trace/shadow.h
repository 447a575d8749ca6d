/*
 * Shadow rays, and how much light comes through: coloured shadows.
 */
#ifndef WEFT_TRACE_SHADOW_H
#define WEFT_TRACE_SHADOW_H

#include "trace/kernel.h"
#include "trace/medium.h"

/* Shadow rays from lit points to lights, with what the light would add: radiance[i] to hit owner[i], an index of the
 * caller's. medium[i] is what the lit point is in. All zero is empty. */
struct shadow_batch {
    struct ray_batch rays;
    size_t capacity;
    struct vec3 *radiance;
    uint32_t *owner, *medium;
};

void shadow_batch_finish(struct shadow_batch *batch);
void shadow_batch_reserve(struct shadow_batch *batch, size_t capacity);
void shadow_batch_push(struct shadow_batch *batch, const struct ray *ray, struct vec3 radiance, uint32_t owner,
                       uint32_t medium);

/* Fills transmittance[shadows->rays.count], 0..1 a channel, from what a kernel found. Sorts the crossings. A shadow ray
 * goes straight on: each surface that it passes takes its share (transparency × filter, or for a dielectric Fresnel's
 * transmitted share × filter, at the angle the line has to the surface), and each absorbing solid
 * exp(−absorption × length inside). Factors are multiplied in the order of (t, id, side), so that neither the order of
 * the scene file nor the kernel's way of searching can change a bit. */
void shadow_transmittance(const struct plan *plan, const struct medium_pool *media, const struct shadow_batch *shadows,
                          const uint8_t *blocked, struct crossing_list *crossings, struct vec3 *transmittance);

#endif
