/*
 * What kernels read and write, as tables of arrays, and two kernels' results array by array: which item is the first
 * that differs, if any does.
 *
 * Equal means bit by bit, but for the sign and payload of NaN, which are the compiler's and the CPU's affair.
 */
#ifndef WEFT_TESTS_COMPARED_ARRAYS_H
#define WEFT_TESTS_COMPARED_ARRAYS_H

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "trace/kernel.h"

/* What is tried now, and what came of it. A kernel's calls take no context, so this is global. */
static struct {
    const struct kernel *kernel;
    const char *spoiled;  /* NULL, or the stage whose first result is changed by one bit before it is compared */
    bool differs;
    char difference[256]; /* the first */
} trial;

/* --- arrays ----------------------------------------------------------------------------------------------- */

/* One of a structure's arrays. */
struct array {
    const char *name;
    size_t place; /* of the pointer in the structure, bytes */
    size_t item;  /* bytes: 8 for doubles, 4 for uint32_t */
};

struct table {
    const struct array *arrays;
    size_t count;
};

#define DOUBLES(type, member) {#member, offsetof(struct type, member), sizeof(double)}
#define NUMBERS(type, member) {#member, offsetof(struct type, member), sizeof(uint32_t)}
#define VECTORS(type, member) DOUBLES(type, member[0]), DOUBLES(type, member[1]), DOUBLES(type, member[2])
#define TABLE(name) ((struct table){name, sizeof name / sizeof *name})

static const struct array ray_arrays[] = {
    VECTORS(ray_batch, origin), VECTORS(ray_batch, direction), DOUBLES(ray_batch, t_min),  DOUBLES(ray_batch, t_max),
    DOUBLES(ray_batch, key_min), DOUBLES(ray_batch, from),     DOUBLES(ray_batch, inward),
};
static const struct array hit_arrays[] = {DOUBLES(hit_batch, t), DOUBLES(hit_batch, key)};
static const struct array throughput_arrays[] = {VECTORS(path_batch, throughput)};
static const struct array footprint_arrays[] = {
    VECTORS(path_batch, footprint[0]), VECTORS(path_batch, footprint[1]), VECTORS(path_batch, footprint[2]),
    VECTORS(path_batch, footprint[3]), DOUBLES(path_batch, shift[0]), DOUBLES(path_batch, shift[1])};
static const struct array found_arrays[] = {VECTORS(path_batch, found)};
static const struct array origin_arrays[] = {NUMBERS(path_batch, sample), NUMBERS(path_batch, medium)};
static const struct array camera_arrays[] = {DOUBLES(camera_rays, x), DOUBLES(camera_rays, y)};
static const struct array surface_arrays[] = {
    NUMBERS(surfaces, index),           NUMBERS(surfaces, material),       NUMBERS(surfaces, texture),
    DOUBLES(surfaces, lanes.t),         DOUBLES(surfaces, lanes.side),     DOUBLES(surfaces, lanes.id),
    DOUBLES(surfaces, lanes.leave_share), DOUBLES(surfaces, lanes.extent), DOUBLES(surfaces, lanes.part),
    VECTORS(surfaces, lanes.direction), VECTORS(surfaces, lanes.throughput), VECTORS(surfaces, lanes.position),
    DOUBLES(surfaces, lanes.error),     VECTORS(surfaces, lanes.normal),   VECTORS(surfaces, lanes.facing),
    VECTORS(surfaces, lanes.shading_normal), VECTORS(surfaces, lanes.middle), VECTORS(surfaces, lanes.spread[0]),
    VECTORS(surfaces, lanes.spread[1]), VECTORS(surfaces, lanes.spread[2]), VECTORS(surfaces, lanes.spread[3]),
    VECTORS(surfaces, lanes.color),
    VECTORS(surfaces, lanes.own),       VECTORS(surfaces, lanes.local),
};
static const struct array share_arrays[] = {DOUBLES(patterned, share)};
static const struct array point_arrays[] = {
    DOUBLES(imaged, face),     DOUBLES(imaged, point[0]), DOUBLES(imaged, point[1]), DOUBLES(imaged, point[2]),
    DOUBLES(imaged, point[3]), DOUBLES(imaged, point[4]), DOUBLES(imaged, point[5]),
};
static const struct array lighting_arrays[] = {
    VECTORS(lighting, direction), DOUBLES(lighting, t_min), DOUBLES(lighting, t_max), VECTORS(lighting, radiance),
    DOUBLES(lighting, lit),
};
static const struct array transmitted_arrays[] = {VECTORS(transmitted, share), DOUBLES(transmitted, reflectance)};

static void *array_get(const void *of, const struct array *array)
{
    void *items;
    memcpy(&items, (const char *)of + array->place, sizeof items);
    return items;
}

static void array_set(void *of, const struct array *array, void *items)
{
    memcpy((char *)of + array->place, &items, sizeof items);
}

/* Gives the structure arrays of its own, with the same in them; `capacity` is a multiple of PACKET_RAYS. */
static void copy_arrays(void *of, struct table table, size_t capacity)
{
    for (size_t i = 0; i < table.count && capacity > 0; i++) {
        size_t bytes = capacity * table.arrays[i].item;
        void *copy = memory_aligned(bytes / PACKET_RAYS, PACKET_RAYS, 64);
        memcpy(copy, array_get(of, &table.arrays[i]), bytes);
        array_set(of, &table.arrays[i], copy);
    }
}

static void free_arrays(const void *of, struct table table)
{
    for (size_t i = 0; i < table.count; i++)
        free(array_get(of, &table.arrays[i]));
}

/* --- comparing -------------------------------------------------------------------------------------------- */

static void note_difference(const char *stage, const char *array, size_t lane, const char *values)
{
    if (trial.differs)
        return;
    trial.differs = true;
    snprintf(trial.difference, sizeof trial.difference, "stage %s, kernel %s, array %s, lane %zu: %s", stage,
             trial.kernel->name, array, lane, values);
}

static void compare_items(const char *stage, const struct array *array, const char *expected, const char *found,
                          size_t lane)
{
    double a = 0, b = 0;
    uint32_t m = 0, n = 0;
    char values[96];
    if (memcmp(expected, found, array->item) == 0)
        return;
    if (array->item == sizeof a) {
        memcpy(&a, expected, sizeof a);
        memcpy(&b, found, sizeof b);
        snprintf(values, sizeof values, "expected %a, found %a", a, b);
    } else {
        memcpy(&m, expected, sizeof m);
        memcpy(&n, found, sizeof n);
        snprintf(values, sizeof values, "expected %u, found %u", m, n);
    }
    if (!(isnan(a) && isnan(b)))
        note_difference(stage, array->name, lane, values);
}

/* The last of `count` items of the first array changes by a bit if this stage is to be spoiled. */
static void spoil(const char *stage, char *items, size_t item, size_t count)
{
    if (trial.spoiled && strcmp(stage, trial.spoiled) == 0 && count > 0)
        items[(count - 1) * item] ^= 1;
}

static void compare_arrays(const char *stage, const void *expected, const void *found, struct table table, size_t count)
{
    spoil(stage, array_get(found, &table.arrays[0]), table.arrays[0].item, count);
    for (size_t k = 0; k < table.count; k++) {
        const struct array *array = &table.arrays[k];
        const char *a = array_get(expected, array), *b = array_get(found, array);
        if (count == 0 || memcmp(a, b, count * array->item) == 0)
            continue;
        for (size_t i = 0; i < count; i++)
            compare_items(stage, array, a + i * array->item, b + i * array->item, i);
    }
}

#endif
