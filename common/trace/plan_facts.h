/*
 * What a plan holds and what it could do without: figures for people.
 */
#ifndef WEFT_TRACE_PLAN_FACTS_H
#define WEFT_TRACE_PLAN_FACTS_H

#include "trace/plan.h"

enum { TEXTURE_KINDS = TEXTURE_IMAGE + 1, LIGHT_KINDS = LIGHT_SPOT + 1 };

struct plan_facts {
    size_t objects, primitives, primitives_of[PRIMITIVE_KINDS]; /* primitives: with each instance's triangles */
    size_t shared_meshes, shared_triangles, shared_bytes; /* what instances are of; bytes: of what is kept beside the
                                                           * scene */
    size_t tree_nodes, tree_bytes; /* 0: there is no tree */
    size_t loose;                  /* primitives beside the tree */

    /* Objects. textured: by the kind of their texture; constant: those of one colour, of which `folded` have a pattern
     * whose colours are equal. */
    size_t textured[TEXTURE_KINDS], folded;
    size_t highlights, mirrors, transparent, dielectric, absorbing, smooth;
    size_t around_camera; /* dielectrics that the camera is inside of */
    bool footprints;      /* what rays cover of textures is followed */
    bool touching;        /* dielectrics may touch */

    size_t images, image_bytes, images_unworn;                 /* bytes: with their halvings */
    size_t lights, lights_of[LIGHT_KINDS], black_lights, idle_lights; /* idle: reach nothing, though not black */
};

/* Of a plan that was made of that scene. */
struct plan_facts plan_facts_of(const struct plan *plan, const struct scene *scene);

#endif
