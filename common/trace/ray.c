#include "trace/ray.h"

#include <stdlib.h>

#include "base/memory.h"

static void ray_batch_resize(struct ray_batch *b, size_t capacity)
{
    for (int axis = 0; axis < 3; axis++) {
        b->origin[axis] = memory_resize(b->origin[axis], capacity, sizeof *b->origin[axis]);
        b->direction[axis] = memory_resize(b->direction[axis], capacity, sizeof *b->direction[axis]);
    }
    b->t_min = memory_resize(b->t_min, capacity, sizeof *b->t_min);
    b->t_max = memory_resize(b->t_max, capacity, sizeof *b->t_max);
    b->key_min = memory_resize(b->key_min, capacity, sizeof *b->key_min);
    b->from = memory_resize(b->from, capacity, sizeof *b->from);
    b->departure = memory_resize(b->departure, capacity, sizeof *b->departure);
    b->capacity = capacity;
}

void ray_batch_finish(struct ray_batch *b)
{
    for (int axis = 0; axis < 3; axis++) {
        free(b->origin[axis]);
        free(b->direction[axis]);
    }
    free(b->t_min);
    free(b->t_max);
    free(b->key_min);
    free(b->from);
    free(b->departure);
    *b = (struct ray_batch){0};
}

void ray_batch_push(struct ray_batch *b, const struct ray *ray)
{
    if (b->count == b->capacity)
        ray_batch_resize(b, b->capacity ? 2 * b->capacity : 256);
    size_t i = b->count++;
    b->origin[0][i] = ray->origin.x;
    b->origin[1][i] = ray->origin.y;
    b->origin[2][i] = ray->origin.z;
    b->direction[0][i] = ray->direction.x;
    b->direction[1][i] = ray->direction.y;
    b->direction[2][i] = ray->direction.z;
    b->t_min[i] = ray->t_min;
    b->t_max[i] = ray->t_max;
    b->key_min[i] = ray->key_min;
    b->from[i] = ray->from;
    b->departure[i] = ray->departure;
}

struct ray ray_batch_get(const struct ray_batch *b, size_t i)
{
    return (struct ray){
        .origin = {b->origin[0][i], b->origin[1][i], b->origin[2][i]},
        .direction = {b->direction[0][i], b->direction[1][i], b->direction[2][i]},
        .t_min = b->t_min[i],
        .t_max = b->t_max[i],
        .key_min = b->key_min[i],
        .from = b->from[i],
        .departure = b->departure[i],
    };
}

void hit_batch_finish(struct hit_batch *b)
{
    free(b->t);
    free(b->id);
    free(b->side);
    free(b->part);
    *b = (struct hit_batch){0};
}

void hit_batch_reserve(struct hit_batch *b, size_t capacity)
{
    if (capacity <= b->capacity)
        return;
    b->t = memory_resize(b->t, capacity, sizeof *b->t);
    b->id = memory_resize(b->id, capacity, sizeof *b->id);
    b->side = memory_resize(b->side, capacity, sizeof *b->side);
    b->part = memory_resize(b->part, capacity, sizeof *b->part);
    b->capacity = capacity;
}

void path_batch_finish(struct path_batch *b)
{
    ray_batch_finish(&b->rays);
    free(b->throughput);
    free(b->sample);
    free(b->medium);
    free(b->footprint);
    *b = (struct path_batch){0};
}

void path_batch_clear(struct path_batch *b)
{
    b->rays.count = 0;
}

void path_batch_push(struct path_batch *b, const struct path *path)
{
    size_t i = b->rays.count;
    ray_batch_push(&b->rays, &path->ray);
    if (b->capacity < b->rays.capacity) {
        b->capacity = b->rays.capacity;
        b->throughput = memory_resize(b->throughput, b->capacity, sizeof *b->throughput);
        b->sample = memory_resize(b->sample, b->capacity, sizeof *b->sample);
        b->medium = memory_resize(b->medium, b->capacity, sizeof *b->medium);
        b->footprint = memory_resize(b->footprint, b->capacity, sizeof *b->footprint);
    }
    b->throughput[i] = path->throughput;
    b->sample[i] = path->sample;
    b->medium[i] = path->medium;
    b->footprint[i] = path->footprint;
}

struct path path_batch_get(const struct path_batch *b, size_t i)
{
    return (struct path){
        .ray = ray_batch_get(&b->rays, i),
        .throughput = b->throughput[i],
        .sample = b->sample[i],
        .medium = b->medium[i],
        .footprint = b->footprint[i],
    };
}
