/*
 * How much light comes through: coloured shadows.
 */
#ifndef WEFT_TRACE_SHADOW_H
#define WEFT_TRACE_SHADOW_H

#include "trace/kernel.h"

/* Fills transmittance[rays->count], 0..1 a channel, from what a kernel found. Sorts the crossings. A shadow ray goes
 * straight on: each surface that it passes takes its share (transparency × filter, or for a dielectric Fresnel's
 * transmitted share × filter, at the angle the line has to the surface), and each absorbing solid
 * exp(−absorption × length inside). Factors are multiplied in the order of (t, id, side), so that neither the order of
 * the scene file nor the kernel's way of searching can change a bit. */
void shadow_transmittance(const struct plan *plan, const struct ray_batch *rays, const uint8_t *blocked,
                          struct crossing_list *crossings, struct vec3 *transmittance);

#endif
