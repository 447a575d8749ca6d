#include "trace/ray.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum { ALIGNMENT = 64 };

size_t lanes_in_packets(size_t count)
{
    return (count + PACKET_RAYS - 1) / PACKET_RAYS * PACKET_RAYS;
}

void lanes_grow(double **lanes, size_t kept, size_t capacity)
{
    double *grown = memory_aligned(capacity * sizeof *grown / ALIGNMENT, ALIGNMENT, ALIGNMENT);
    memset(grown, 0, capacity * sizeof *grown);
    if (kept > 0)
        memcpy(grown, *lanes, kept * sizeof *grown);
    free(*lanes);
    *lanes = grown;
}

enum { RAY_ARRAYS = 11 };

static void list_arrays(struct ray_batch *b, double **arrays[RAY_ARRAYS])
{
    double **const all[RAY_ARRAYS] = {&b->origin[0], &b->origin[1], &b->origin[2], &b->direction[0], &b->direction[1],
                                      &b->direction[2], &b->t_min, &b->t_max, &b->key_min, &b->from, &b->inward};
    memcpy(arrays, all, sizeof all);
}

void ray_batch_reserve(struct ray_batch *b, size_t capacity)
{
    if (capacity <= b->capacity)
        return;
    double **arrays[RAY_ARRAYS];
    list_arrays(b, arrays);
    b->capacity = lanes_in_packets(capacity > 2 * b->capacity ? capacity : 2 * b->capacity);
    for (int i = 0; i < RAY_ARRAYS; i++)
        lanes_grow(arrays[i], b->count, b->capacity);
}

void ray_batch_finish(struct ray_batch *b)
{
    double **arrays[RAY_ARRAYS];
    list_arrays(b, arrays);
    for (int i = 0; i < RAY_ARRAYS; i++)
        free(*arrays[i]);
    *b = (struct ray_batch){0};
}

void ray_batch_push(struct ray_batch *b, const struct ray *ray)
{
    ray_batch_reserve(b, b->count + 1);
    size_t i = b->count++;
    b->origin[0][i] = ray->origin.x;
    b->origin[1][i] = ray->origin.y;
    b->origin[2][i] = ray->origin.z;
    b->direction[0][i] = ray->direction.x;
    b->direction[1][i] = ray->direction.y;
    b->direction[2][i] = ray->direction.z;
    b->t_min[i] = ray->t_min;
    b->t_max[i] = ray->t_max;
    b->key_min[i] = (double)ray->key_min;
    b->from[i] = ray->from == PRIMITIVE_NONE ? LANE_FROM_NONE : ray->from;
    b->inward[i] = ray->departure == DEPART_INWARD;
}

struct ray ray_batch_get(const struct ray_batch *b, size_t i)
{
    return (struct ray){
        .origin = {b->origin[0][i], b->origin[1][i], b->origin[2][i]},
        .direction = {b->direction[0][i], b->direction[1][i], b->direction[2][i]},
        .t_min = b->t_min[i],
        .t_max = b->t_max[i],
        .key_min = b->key_min[i] == LANE_KEY_NONE ? KEY_NONE : (uint64_t)b->key_min[i],
        .from = b->from[i] == LANE_FROM_NONE ? PRIMITIVE_NONE : (uint32_t)b->from[i],
        .departure = b->inward[i] != 0 ? DEPART_INWARD : DEPART_OUTWARD,
    };
}

void hit_batch_finish(struct hit_batch *b)
{
    free(b->t);
    free(b->key);
    *b = (struct hit_batch){0};
}

void hit_batch_reserve(struct hit_batch *b, size_t capacity)
{
    if (capacity <= b->capacity)
        return;
    b->capacity = lanes_in_packets(capacity);
    lanes_grow(&b->t, 0, b->capacity);
    lanes_grow(&b->key, 0, b->capacity);
}

void path_batch_finish(struct path_batch *b)
{
    ray_batch_finish(&b->rays);
    for (int axis = 0; axis < 3; axis++) {
        free(b->throughput[axis]);
        free(b->found[axis]);
        for (int part = 0; part < 4; part++)
            free(b->footprint[part][axis]);
    }
    free(b->shift[0]);
    free(b->shift[1]);
    free(b->sample);
    free(b->medium);
    *b = (struct path_batch){0};
}

void path_batch_clear(struct path_batch *b)
{
    b->rays.count = 0;
}

void path_batch_reserve(struct path_batch *b, size_t capacity)
{
    ray_batch_reserve(&b->rays, capacity);
    if (b->capacity >= b->rays.capacity)
        return;
    b->capacity = b->rays.capacity;
    for (int axis = 0; axis < 3; axis++) {
        lanes_grow(&b->throughput[axis], b->rays.count, b->capacity);
        lanes_grow(&b->found[axis], 0, b->capacity);
        for (int part = 0; part < 4; part++)
            lanes_grow(&b->footprint[part][axis], b->rays.count, b->capacity);
    }
    lanes_grow(&b->shift[0], b->rays.count, b->capacity);
    lanes_grow(&b->shift[1], b->rays.count, b->capacity);
    b->sample = memory_resize(b->sample, b->capacity, sizeof *b->sample);
    b->medium = memory_resize(b->medium, b->capacity, sizeof *b->medium);
}

void path_batch_push(struct path_batch *b, const struct path *path)
{
    size_t i = b->rays.count;
    path_batch_reserve(b, i + 1);
    ray_batch_push(&b->rays, &path->ray);
    lane_put(b->throughput, i, path->throughput);
    lane_put(b->footprint[0], i, path->footprint.origin_x);
    lane_put(b->footprint[1], i, path->footprint.origin_y);
    lane_put(b->footprint[2], i, path->footprint.direction_x);
    lane_put(b->footprint[3], i, path->footprint.direction_y);
    b->shift[0][i] = path->footprint.shift_x;
    b->shift[1][i] = path->footprint.shift_y;
    b->sample[i] = path->sample;
    b->medium[i] = path->medium;
}

struct path path_batch_get(const struct path_batch *b, size_t i)
{
    return (struct path){
        .ray = ray_batch_get(&b->rays, i),
        .throughput = lane_get(b->throughput, i),
        .sample = b->sample[i],
        .medium = b->medium[i],
        .footprint = {lane_get(b->footprint[0], i), lane_get(b->footprint[1], i), lane_get(b->footprint[2], i),
                      lane_get(b->footprint[3], i), b->shift[0][i], b->shift[1][i]},
    };
}
