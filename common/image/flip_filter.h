/*
 * The filters of FLIP: what the eye resolves of colours, and where it finds edges and points. Equations and constants
 * are those of the paper that flip.h names.
 */
#ifndef WEFT_IMAGE_FLIP_FILTER_H
#define WEFT_IMAGE_FLIP_FILTER_H

#include <stddef.h>
#include <stdint.h>

#include "image/flip.h"
#include "image/image.h"
#include "math/transform.h"

enum flip_kernel {
    FLIP_ACHROMATIC,
    FLIP_RED_GREEN,
    FLIP_BLUE_YELLOW_WIDE,
    FLIP_BLUE_YELLOW_NARROW,
    FLIP_SMOOTH,
    FLIP_EDGE,
    FLIP_POINT,
    FLIP_KERNELS,
};

enum { FLIP_TAPS_MAX = 2 * 136 + 1 }; /* at FLIP_PPD_MAX */

/* Linear red, green, blue to y, x − y, y − z, where white is x = y = z = 1; and back. */
struct flip_colours {
    struct mat3 to_opponent, from_opponent;
};

/* Every filter is a product of two of these kernels, one along rows and one along columns, or a sum of such. */
struct flip_filters {
    size_t radius, taps; /* taps = 2 radius + 1, of every kernel; the narrower ones end in zeros */
    double kernels[FLIP_KERNELS][FLIP_TAPS_MAX];
    struct flip_colours colours;
};

void flip_filters_init(struct flip_filters *filters, double pixels_per_degree);

/* What is filtered of one image: the opponent colours and the gradients of y. */
enum flip_plane {
    FLIP_Y,
    FLIP_X_Y, /* x − y: red against green */
    FLIP_Y_Z, /* y − z: blue against yellow */
    FLIP_EDGE_ALONG,
    FLIP_EDGE_ACROSS,
    FLIP_POINT_ALONG,
    FLIP_POINT_ACROSS,
    FLIP_PLANES,
};

enum { FLIP_TILE_WIDTH = 128, FLIP_TILE_HEIGHT = 64, FLIP_TILE_PIXELS = FLIP_TILE_WIDTH * FLIP_TILE_HEIGHT };

/* A part of an image, filtered; rows are FLIP_TILE_WIDTH apart. */
struct flip_tile {
    double planes[FLIP_PLANES][FLIP_TILE_PIXELS];
};

/* Room for what flip_filter_tile works on. */
struct flip_workspace {
    size_t patch_width, patch_height; /* of a tile and all around it that the filters reach */
    double *patch[3];                 /* its opponent colours */
    double *rows;                     /* patch_height rows of a tile's width, filtered along the row */
};

void flip_workspace_init(struct flip_workspace *workspace, const struct flip_filters *filters);
void flip_workspace_finish(struct flip_workspace *workspace);

/* Filters the pixels x0 <= x < x0 + width, y0 <= y < y0 + height, at most a tile, of an image whose border pixels go on
 * beyond its borders. */
void flip_filter_tile(const struct flip_filters *filters, const struct image *image, uint32_t x0, uint32_t y0,
                      uint32_t width, uint32_t height, struct flip_workspace *workspace, struct flip_tile *tile);

/* Within 0..1. */
static inline double flip_clamp(double value)
{
    return value > 0 ? (value < 1 ? value : 1) : 0;
}

#endif
