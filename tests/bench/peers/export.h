/*
 * Scenes in the languages of other ray tracers, so that weft can be timed against them on the same work: the same
 * camera, shapes, lights, depth, and surfaces as near as each language comes. What it cannot say is either written
 * differently, which the comment at the head of each written file states, or refused.
 */
#ifndef WEFT_BENCH_EXPORT_H
#define WEFT_BENCH_EXPORT_H

#include <stdio.h>

#include "base/error.h"
#include "scene/model.h"

struct export {
    FILE *to;
    const struct scene *scene;
    const char *scene_folder;  /* where the scene's images are; absolute, ends in '/' */
    const char *output_folder; /* where images for the other program go; ends in '/', or "" */
    uint32_t width, height;    /* of the image to be rendered, pixels */
};

/* Write the whole scene. STATUS_INPUT for what cannot be said, STATUS_OUTPUT for a file that cannot be written. */
enum status export_pov(const struct export *out, struct error *error);
enum status export_tachyon(const struct export *out, struct error *error);

/* --- for both --------------------------------------------------------------------------------------------- */

/* The camera's axes, of length 1, and half the image's height at distance 1. */
struct export_view {
    struct vec3 forward, right, up;
    double half_height;
};

struct export_view export_view_of(const struct camera *camera);

/* STATUS_INPUT unless all lights are point lights without falloff. */
enum status export_check_lights(const struct scene *scene, struct error *error);

/* The light's colour, its constant divisor taken in. */
struct vec3 export_light_color(const struct light *light);

/* The mean of the channels: for languages that have one number where weft has three. */
double export_mean(struct vec3 color);

/* The share of the light that meets the coloured surface, 0..1, mean of the channels; 0 for a dielectric. */
double export_surface_share(const struct material *material);

/* How an image lies on a face: it spans `right` to the right and `up` upwards from its lower left `corner`. */
struct export_face {
    struct vec3 corner, right, up;
};

/* Face 0..BOX_FACES − 1 of a box with box-mapped images, as texture.h numbers them. */
struct export_face export_box_face(const struct shape *box, int face);

/* The frame of a planar map. */
struct export_face export_planar_face(const struct texture *texture);

#endif
