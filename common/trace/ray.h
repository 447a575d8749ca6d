/*
 * Rays, and batches of them as structures of arrays.
 *
 * A ray is the half-line origin + t direction, with |direction| = 1 and coordinates relative to the camera.
 * What it may hit is ordered by (t, key), where key = hit_key(id, side): the least (t, key) beyond
 * (t_min, key_min) and with t < t_max is its hit.
 */
#ifndef WEFT_TRACE_RAY_H
#define WEFT_TRACE_RAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "math/vec3.h"

/* Which of a primitive's two roots: where a ray enters a solid (or meets the front of a flat primitive), or
 * where it leaves (or meets the back). Taken from the root's place, never from the sign of d · n, which is
 * wrong for a share of near-tangent rays. */
enum side { SIDE_ENTER = 0, SIDE_LEAVE = 1 };

#define PRIMITIVE_NONE UINT32_MAX
#define KEY_NONE UINT64_MAX

static inline uint64_t hit_key(uint32_t id, enum side side)
{
    return (uint64_t)id << 1 | (uint64_t)side;
}

/* How a ray departs from the primitive `from` that it starts on. It cannot hit that again, except that a
 * ray going into a solid meets the solid's far wall. No distance decides this. */
enum departure { DEPART_OUTWARD, DEPART_INWARD };

struct ray {
    struct vec3 origin, direction;
    double t_min, t_max;
    uint64_t key_min;
    uint32_t from; /* PRIMITIVE_NONE: starts in free space, or on the straight line of its parent */
    uint8_t departure;
};

/* Rays travel through kernels in packets of so many. */
enum { PACKET_RAYS = 64 };

/* Structure of arrays, each 64-byte aligned; `capacity` is a multiple of PACKET_RAYS, and what lies beyond `count` may
 * be read. All is double, so that loops over rays have lanes of one width; ids and keys are exact. All zero is
 * empty. */
struct ray_batch {
    size_t count, capacity;
    double *origin[3], *direction[3];
    double *t_min, *t_max;
    double *key_min; /* LANE_KEY_NONE for KEY_NONE */
    double *from;    /* LANE_FROM_NONE for PRIMITIVE_NONE */
    double *inward;  /* 1 for DEPART_INWARD, else 0 */
};

#define LANE_KEY_NONE 0x1p64
#define LANE_FROM_NONE (-1.0)

void ray_batch_finish(struct ray_batch *batch);
void ray_batch_reserve(struct ray_batch *batch, size_t capacity);
void ray_batch_push(struct ray_batch *batch, const struct ray *ray);
struct ray ray_batch_get(const struct ray_batch *batch, size_t index);

/* What each ray of a batch hit: t and the hit's key, LANE_HIT_NONE if nothing (t is then the ray's t_max). Arrays as in
 * ray_batch. */
struct hit_batch {
    size_t capacity;
    double *t, *key;
};

#define LANE_HIT_NONE (-1.0)

void hit_batch_finish(struct hit_batch *batch);
void hit_batch_reserve(struct hit_batch *batch, size_t capacity);

/* The primitive that ray `index` hit, or PRIMITIVE_NONE, and on which side. */
static inline uint32_t hit_batch_id(const struct hit_batch *hits, size_t index)
{
    return hits->key[index] < 0 ? PRIMITIVE_NONE : (uint32_t)((int64_t)hits->key[index] >> 1);
}

static inline enum side hit_batch_side(const struct hit_batch *hits, size_t index)
{
    return (int64_t)hits->key[index] & 1 ? SIDE_LEAVE : SIDE_ENTER;
}

/* --- paths: camera rays and what becomes of them ---------------------------------------------------------- */

/* One sample's share of a pixel, as differentials of the ray by the image's x and y (Igehy, "Tracing Ray
 * Differentials", SIGGRAPH 1999). It shrinks as samples grow. */
struct footprint {
    struct vec3 origin_x, origin_y;       /* of the origin, per share */
    struct vec3 direction_x, direction_y; /* of the direction, per share */
    double shift_x, shift_y;              /* of the share's middle from the ray, in shares */
};

struct path {
    struct ray ray;
    struct vec3 throughput; /* share of the radiance found that reaches the sample */
    uint32_t sample;        /* index of the camera ray that it comes from */
    uint32_t medium;        /* what it travels in, as in medium.h */
    struct footprint footprint;
};

/* One generation of paths: the mirrored ones, each group in the order of their parents, then the transmitted ones.
 * Arrays as in ray_batch. */
struct path_batch {
    struct ray_batch rays;
    bool has_footprints; /* they are followed; else what `footprint` holds means nothing */
    size_t capacity;
    double *throughput[3];
    double *footprint[4][3]; /* the vectors of struct footprint in turn */
    double *shift[2];
    double *found[3];        /* the radiance that the path brings to its sample, once it is known */
    uint32_t *sample, *medium;
};

void path_batch_finish(struct path_batch *batch);
void path_batch_clear(struct path_batch *batch);
void path_batch_reserve(struct path_batch *batch, size_t capacity);
void path_batch_push(struct path_batch *batch, const struct path *path);
struct path path_batch_get(const struct path_batch *batch, size_t index);

/* --- vectors in lanes ------------------------------------------------------------------------------------- */

static inline struct vec3 lane_get(double *const lanes[3], size_t i)
{
    return vec3_make(lanes[0][i], lanes[1][i], lanes[2][i]);
}

static inline void lane_put(double *const lanes[3], size_t i, struct vec3 v)
{
    lanes[0][i] = v.x;
    lanes[1][i] = v.y;
    lanes[2][i] = v.z;
}

/* Moves the first `kept` values of a 64-byte aligned array to a larger one, whose others are 0. */
void lanes_grow(double **lanes, size_t kept, size_t capacity);

/* The next multiple of PACKET_RAYS. */
size_t lanes_in_packets(size_t count);

#endif
