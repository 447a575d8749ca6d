/*
 * Flat outlines in space: whether one is a proper polygon, and cutting it into triangles.
 */
#ifndef WEFT_SCENE_POLYGON_H
#define WEFT_SCENE_POLYGON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"
#include "math/vec3.h"

enum { POLYGON_CORNERS_MAX = 1024 }; /* checking and cutting take quadratic time */

/* How far from its plane a corner may be, as a share of the polygon's extent. */
#define POLYGON_FLATNESS 1e-6

/* STATUS_INPUT and "expected …, found …" unless points[count] (3..POLYGON_CORNERS_MAX) are the corners of a
 * polygon: flat, not all on one line, no two neighbours in one place, and no two edges that meet except at
 * a common corner. */
enum status polygon_check(const struct vec3 *points, size_t count, struct error *error);

/* True if the triangles from the first corner to every other edge cut the face points[corners[0]], … (any
 * number of corners from 3 on) as they should: all lie on the same side and beside each other, as those of
 * every convex face do. Takes linear time. */
bool polygon_is_fan(const struct vec3 *points, const uint32_t *corners, size_t count);

/* Cuts the face points[corners[0]], points[corners[1]], … into count - 2 triangles (ear clipping, seen along
 * the face's mean normal) and writes their 3 × (count - 2) indices. Their sense is the face's, and the first
 * one begins with the first edge. A face that polygon_check would refuse is cut too, somehow. */
void polygon_triangulate(const struct vec3 *points, const uint32_t *corners, size_t count, uint32_t *triangles);

#endif
