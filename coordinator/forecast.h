/*
 * How much work a job still is, judged by the bands that are done: pure, for remaining time.
 *
 * Rows of one picture can differ in cost a hundredfold, so what is left is not in proportion to the rows that are left.
 * A row's work is taken to be its samples times what one costs. Where a survey was made, that expects how many samples
 * there will be, and what is done shows how far such expectations hold in this picture. What a sample costs lies
 * between what it does in the nearest rows that are done above and below, and its ups and downs are the survey's;
 * beyond the first and the last of these rows the nearest counts at first, and farther away the mean of all.
 *
 * Work is counted in whatever unit the caller likes, such as milliseconds of one thread.
 */
#ifndef WEFT_COORDINATOR_FORECAST_H
#define WEFT_COORDINATOR_FORECAST_H

#include <stddef.h>
#include <stdint.h>

#include "trace/survey.h"

struct forecast;

/* Of a job of so many rows, at least 1. cell_rows: how many of them a row of its survey's cells stands for (the last
 * for what is left); 0: there is no survey. */
struct forecast *forecast_create(uint32_t rows, uint32_t cell_rows);

/* Frees *forecast and sets it to NULL; *forecast may be NULL. */
void forecast_destroy(struct forecast **forecast);

/* So many rows of cells are surveyed, each once, and took so much work; NAN: unknown, as of an earlier run's. */
void forecast_survey(struct forecast *forecast, uint32_t first_cell, uint32_t cells, double work);

/* All are surveyed, and that row of them expects so many samples a pixel on average, at least 1. To be told of each,
 * before the first band of the render. */
void forecast_expect(struct forecast *forecast, uint32_t cell, double samples);

/* A band of the render is done, each row once, and took so much work; NAN: unknown, as of an earlier run's. looks: with
 * adaptive sampling, the share that first samples are of all samples, 0..1, else 0. Such a band takes first samples
 * of rows beyond its edges too, many for its height where it is low: that is allowed for. */
void forecast_add(struct forecast *forecast, uint32_t first_row, uint32_t rows, double work, double looks);

/* What is seen of this part of a survey expects so many samples a pixel, on average, of a render by that sampling. */
double forecast_samples(const struct survey *part, const struct sampling *sampling);

/* A band of the render that somebody holds, the work that they spent on it so far, and how much they do a unit of time
 * (more than 0). */
struct forecast_hand {
    uint32_t first_row, rows;
    double spent, power;
};

/* The time that is left, with hands[count] in work and the rest to come as so many bands, at so much work a unit of
 * time altogether (more than 0); not less than what a band in work takes those who have it. Negative: unknown, as long
 * as the survey is not done, or too little of the render. */
double forecast_time(struct forecast *forecast, const struct forecast_hand *hands, size_t count, uint32_t bands,
                     double power);

/* The work expected of the rows that are not done, summed from the top: sums[rows + 1], sums[i] that of rows 0 .. i − 1.
 * Now and then brought up to date, so that asking is cheap; valid until the next call. NULL: unknown, as above. */
const double *forecast_sums(struct forecast *forecast);

#endif
