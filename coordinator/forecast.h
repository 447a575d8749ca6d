/*
 * How much work a job still is, judged by the bands that are done: pure, for remaining time.
 *
 * Rows of one picture can differ in cost a hundredfold, so what is left is not in proportion to the rows that are left.
 * Between rows that are done, others are taken to cost what lies between; where a survey was made, it is the ratio of
 * the render's cost to the survey's that is carried over to them. Beyond the first and the last row that are done the
 * nearest counts at first, and farther away the mean of all.
 *
 * Work is counted in whatever unit the caller likes, such as milliseconds of one thread.
 */
#ifndef WEFT_COORDINATOR_FORECAST_H
#define WEFT_COORDINATOR_FORECAST_H

#include <stddef.h>
#include <stdint.h>

#include "wire/message.h"

struct forecast;

/* Of a job of so many rows, at least 1. cell_rows: how many of them a row of its survey's cells stands for (the last
 * for what is left); 0: there is no survey. */
struct forecast *forecast_create(uint32_t rows, uint32_t cell_rows);

/* Frees *forecast and sets it to NULL; *forecast may be NULL. */
void forecast_destroy(struct forecast **forecast);

/* A band is done, each row once a pass, and took so much work; NAN: unknown, as of an earlier run's. looks: of a render
 * by adaptive sampling, the share that first samples are of all samples, 0..1, else 0. Such a band takes first samples
 * of rows beyond its edges too, many for its height where it is low: that is allowed for. */
void forecast_add(struct forecast *forecast, enum render_pass pass, uint32_t first_row, uint32_t rows, double work,
                  double looks);

/* A band of the render that somebody holds, and the work that they spent on it so far. */
struct forecast_hand {
    uint32_t first_row, rows;
    double spent;
};

/* The time that is left, with hands[count] in work and the rest to come as so many bands, at so much work a unit of
 * time altogether (more than 0). Negative: unknown, as long as the survey is not done, or too little of the render. */
double forecast_time(struct forecast *forecast, const struct forecast_hand *hands, size_t count, uint32_t bands,
                     double power);

#endif
