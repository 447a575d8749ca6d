/*
 * The survey: the first pass of a render that is to meet a given error. Pixels of blocks spread over the image are
 * sampled stage by stage, three times, each compared with the others; for each threshold it is noted how many samples they
 * would have got and how far off they would have been. Where many look alike a few stand for the others. Sums of whole
 * numbers, so that they come out the same however the work was shared out.
 */
#ifndef WEFT_TRACE_SURVEY_H
#define WEFT_TRACE_SURVEY_H

#include <stddef.h>
#include <stdint.h>

#include "trace/sampling.h"
#include "trace/tracer.h"

/* The image is cut into cells of equal size (those at the right and lower edge may be smaller), and a block of each, at
 * a place hashed from the cell's, is surveyed. */
struct survey_grid {
    uint32_t width, height;   /* of the image, pixels */
    uint32_t side;            /* of a cell, pixels */
    uint32_t across, down;    /* cells */
};

struct survey_grid survey_grid(uint32_t width, uint32_t height);

/* What pixels would have come to under one threshold. Squared errors, in units of PIXEL_ERROR_UNIT, of pixels with one
 * sample ([0]) and with more ([1]). */
struct survey_outcome {
    int64_t samples;
    int64_t error[2];     /* measured against samples of their own: right on average */
    int64_t estimated[2]; /* by the pixels' own samples, as a render would estimate it */
};

/* Policy i takes at least 4^i samples of every pixel. From one threshold to the next the outcome of few pixels changes,
 * so what is kept is by how much: steps[i][t] is the outcome at t less that at t − 1, and steps[i][0] that at 0. */
enum { SURVEY_POLICIES = 4 };
struct survey {
    uint64_t pixels, rays; /* pixels: each as often as it was tried; rays: of every kind, that the survey took */
    struct survey_outcome steps[SURVEY_POLICIES][SAMPLING_THRESHOLDS];
};

enum { SURVEY_BYTES = 16 + SURVEY_POLICIES * SAMPLING_THRESHOLDS * 5 * 8 };

/* The sampling that the survey itself needs for a render that is to meet `error` (RMSE as shown, 0..1) with at most
 * `most` samples a pixel, one of sampling_stage's from 4 on: its threshold is the finest that may be chosen. */
struct sampling survey_sampling(uint32_t most, double error);

/* Surveys the blocks of cells x .. x + count − 1 of row y of the cells, and adds what it finds, and the rays that it
 * took. What comes of a block does not depend on which others there are; SURVEY_RUN of them are traced together. */
enum { SURVEY_RUN = 32 };
void survey_cells(struct tracer *tracer, const struct sampling *sampling, const struct survey_grid *grid,
                  uint32_t x, uint32_t count, uint32_t y, struct survey *survey, struct ray_counts *counts);

void survey_add(struct survey *to, const struct survey *from);

/* Little-endian, bytes[SURVEY_BYTES]. */
void survey_write(const struct survey *survey, uint8_t *bytes);
void survey_read(struct survey *survey, const uint8_t *bytes);

/* The sum of the policy's steps up to that threshold. */
struct survey_outcome survey_outcome(const struct survey *survey, uint32_t policy, uint32_t threshold);

/* The cheapest sampling whose error in the survey was at most 0.8 of `error`, for surveys are off by as much; if none
 * was, the finest. `surveyed` is what survey_sampling gave. */
struct sampling survey_choose(const struct survey *survey, const struct sampling *surveyed, double error);

/* The RMSE (as shown, 0..1) of a render by one sample a pixel. */
double survey_error_of_one(const struct survey *survey);

/* The RMSE of a render by that sampling, adaptive: `estimated` are its pixels' own estimates, summed as
 * in survey_outcome, and corrected by how such estimates were off in the survey. */
double survey_error(const struct survey *survey, const struct sampling *sampling, uint64_t pixels,
                    const uint64_t estimated[2]);

#endif
