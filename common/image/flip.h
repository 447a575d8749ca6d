/*
 * FLIP: the difference that a person sees who flips between two images in one place. Pontus Andersson, Jim Nilsson,
 * Tomas Akenine-Möller, Magnus Oskarsson, Kalle Åström and Mark D. Fairchild, "FLIP: A Difference Evaluator for
 * Alternating Images", Proceedings of the ACM on Computer Graphics and Interactive Techniques 3(2) (HPG 2020), for
 * images of low dynamic range: linear light is clamped to 0..1 first.
 */
#ifndef WEFT_IMAGE_FLIP_H
#define WEFT_IMAGE_FLIP_H

#include <stdint.h>

#include "image/image.h"

/* How large the images are seen, in pixels per degree of the field of view. The default is that of the paper: a display
 * 0.7 m wide with 3840 pixels, seen from 0.7 m. */
#define FLIP_PPD_DEFAULT (0.7 * 3840 / 0.7 * 3.14159265358979323846 / 180)

enum { FLIP_PPD_MIN = 10, FLIP_PPD_MAX = 1000 };

/* The error of each pixel, 0 (none) to 1 (the most), into errors[width * height], rows from the top. Both images have
 * one size and finite values; which is the reference makes no difference. Works on up to `threads` threads, with the
 * same result. */
void flip_errors(const struct image *a, const struct image *b, double pixels_per_degree, int threads, float *errors);

/* Their mean, which is what is meant by the FLIP of two images. */
double flip_mean(const float *errors, uint32_t width, uint32_t height);

/* The colour of an error in FLIP's pictures, as sRGB codes: matplotlib's magma, from black to pale yellow. */
void flip_colour(float error, uint8_t codes[3]);

#endif
