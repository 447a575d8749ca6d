/*
 * How far apart two images are, as a display shows them: linear light clamped to 0..1 and sRGB-encoded, but not rounded
 * to codes. An image that was read from a PNG comes back as its codes, within 2.7e-8 (a 560th of a 16 bit step).
 */
#ifndef WEFT_IMAGE_COMPARE_H
#define WEFT_IMAGE_COMPARE_H

#include "image/image.h"

struct image_difference {
    double rmse;      /* root of the mean square, over all pixels and channels: 0..1 */
    double maximum;   /* the largest of any channel: 0..1 */
    double share_off; /* of the pixels with a channel off by more than 1/255, the step of 8 bit codes: 0..1 */
};

/* Both images have one size and finite values. Works on up to `threads` threads, with the same result. */
struct image_difference image_compare(const struct image *a, const struct image *b, int threads);

/* The peak signal-to-noise ratio in decibels, −20 log10 of the RMSE; INFINITY where that is 0. */
double image_psnr(double rmse);

#endif
