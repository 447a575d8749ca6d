/*
 * Where a pixel's samples lie: the first two dimensions of Sobol's sequence (a (0,2)-sequence), Owen-scrambled with
 * seeds hashed from the pixel, and spread as its filter is. A function of pixel, index, count and filter alone. The
 * only sample of a pixel with one is its centre.
 *
 * A pixel's samples are its own and count equally; where the filter weighs more, they are denser (Ernst, Stamminger and
 * Greiner, "Filter Importance Sampling", IEEE Symposium on Interactive Ray Tracing 2006). So a filter that is wider
 * than a pixel takes nothing from its neighbours, which may be in another band.
 *
 * The smoother filter is the tent, the B-spline next to the box. Tents of all pixels add up to one everywhere, as boxes
 * do, and they are nowhere negative, so that samples can count equally. Its distribution is inverted by square roots
 * alone, coordinate by coordinate, which keeps the samples a (0,2)-net by the filter's measure. The next B-spline, 1.5
 * times as wide, would need the roots of a cubic.
 *
 * For one sample and for lanes of samples: inline functions without branches.
 */
#ifndef WEFT_TRACE_SAMPLE_H
#define WEFT_TRACE_SAMPLE_H

#include <math.h>
#include <stdint.h>

#include "base/hash.h"
#include "math/elementary.h"
#include "scene/model.h"

/* In pixels from the pixel's top left corner: 0 <= x < 1 by the box, −1/2 <= x < 3/2 by the tent. */
struct sample_position {
    double x, y;
};

/* Coordinates of a sample before scrambling, the first binary digit in the lowest bit. */
struct sample_digits {
    uint32_t x, y;
};

/* Those of the index-th sample. */
struct sample_digits sample_digits(uint32_t index);

static inline uint32_t sample_reversed(uint32_t x)
{
    x = (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
    x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
    x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
    x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
    return x >> 16 | x << 16;
}

/* Owen's nested uniform scrambling by hashing (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020): each
 * digit is flipped by a function of those before it. */
static inline uint32_t sample_scrambled(uint32_t digits, uint32_t seed)
{
    digits += seed;
    digits ^= digits * 0x6c50b47cu;
    digits ^= digits * 0xb82f1e52u;
    digits ^= digits * 0xc7afe638u;
    digits ^= digits * 0x8d22f6e6u;
    return digits;
}

/* The number whose binary digits those are: 0 <= x < 1, exactly. (Machines convert signed integers faster.) */
static inline double sample_coordinate(uint32_t digits)
{
    int32_t centered = (int32_t)(sample_reversed(digits) ^ 0x80000000u);
    return (centered + 0x1p31) * 0x1p-32;
}

/* Where the share 0 <= u < 1 of a filter lies before. The tent's share before x is (x + 1/2)² / 2 in the first half; in
 * the second it is the same from behind. */
static inline double sample_spread(double u, enum pixel_filter filter)
{
    double root = sqrt(u < 0.5 ? 2 * u : 2 - 2 * u);
    double tent = u < 0.5 ? root - 0.5 : 1.5 - root;
    return filter == FILTER_TENT ? tent : u;
}

/* The shares of a filter in one coordinate before a sample of pixel (x, y) whose digits these are, before spreading.
 * Each `salt` (0: the usual one) gives samples of its own. */
static inline struct sample_position sample_shares(uint32_t x, uint32_t y, struct sample_digits digits, uint32_t salt)
{
    uint32_t seed = hash_u32(x + hash_u32(y + 0x9e3779b9u + salt));
    return (struct sample_position){sample_coordinate(sample_scrambled(digits.x, seed)),
                                    sample_coordinate(sample_scrambled(digits.y, hash_u32(seed)))};
}

/* --- what a sample stands for ----------------------------------------------------------------------------- */

/* A share of the pixel's filter, in one coordinate. */
struct sample_cell {
    double middle, width; /* pixels; the middle from the pixel's edge */
};

/* Where the share 0 <= u < 1 of stairs that stand for the tent lies before: boxes as wide as a stair, 1/steps, and spread
 * as the stairs are add up to the tent. Stair j of 1 .. steps, up to the middle, is j high in proportion, and j (j + 1) / 2
 * lie before its end; the other half is the same from behind. */
static inline double sample_on_stairs(double u, double steps)
{
    double before = (u < 0.5 ? u : 1 - u) * steps * steps;
    double climbed = math_floor(0.5 * (sqrt(8 * before + 1) - 1));
    double x = -0.5 + (0.5 + climbed + (before - 0.5 * climbed * (climbed + 1)) / (climbed + 1)) / steps;
    return u < 0.5 ? x : 1 - x;
}

/* What a sample stands for where a pixel's samples are a net: each 2^k samples from a multiple of 2^k on are, one in each
 * of the cells that cut the filter into 2^a shares across and 2^b down, a + b = k. By the box, it stands for its cell: so
 * what is averaged over cells (a texture) is averaged over the pixel without a gap or an overlap, wherever in their cells
 * the samples lie. By the tent, whose cells are of unequal width, it stands for a box of their mean width, which lies so
 * that on average it is the tent that is averaged over. */
static inline struct sample_cell sample_cell(double share, double cells, enum pixel_filter filter)
{
    double steps = cells > 1 ? 0.5 * cells : 1; /* the tent is two pixels wide */
    if (filter == FILTER_TENT)
        return (struct sample_cell){sample_on_stairs(share, steps), 1 / steps};
    return (struct sample_cell){(math_floor(share * cells) + 0.5) / cells, 1 / cells};
}

/* How wide a sample is, in pixels, that stands for no cell: by 1/√count narrower than the box that varies as much as
 * the filter does. The box varies by 1/12, the tent by 1/6. */
static inline double sample_width(uint32_t count, enum pixel_filter filter)
{
    return (filter == FILTER_TENT ? sqrt(2) : 1) / sqrt(count);
}

/* Cells across and down of a block of samples. */
struct sample_cells {
    uint32_t across, down;
};

/* Those of samples first .. end − 1 of a pixel; {0, 0}: these stand for no cells, but for what is around them. By the box
 * a block that is no net does, for its cells would leave gaps; by the tent only a pixel's first sample alone. */
struct sample_cells sample_cells(uint32_t first, uint32_t end, enum pixel_filter filter);

/* The index-th of `count` samples of pixel (x, y). */
struct sample_position sample_position(uint32_t x, uint32_t y, uint32_t index, uint32_t count,
                                       enum pixel_filter filter);

#endif
