/*
 * A band and what comes of it, tile by tile: how it is cut, how a tile is rendered or surveyed, and how the outcomes
 * add up to the band's result. Tiles may be worked on by several threads at once; all else is one thread's at a time.
 */
#ifndef WEFT_WORKER_BAND_H
#define WEFT_WORKER_BAND_H

#include "base/bytes.h"
#include "trace/survey.h"
#include "trace/tracer.h"
#include "wire/message.h"
#include "wire/rows.h"
#include "worker/order.h"

/* Pixels of a render's tile. Adaptive sampling looks beyond it, so small ones cost. A survey's are runs of its
 * cells. */
enum { TILE_WIDTH = 64, TILE_ROWS = 32 };

/* Tiles are numbered row of tiles by row of tiles. */
struct band {
    const struct job_settings *settings; /* borrowed */
    struct order order;
    uint32_t tiles_across, tiles;
    struct row_layout layout;    /* of the records of a render */
    struct row_figures *figures; /* of each of its rows */
    struct survey *survey;       /* of a survey, else NULL */
    struct bytes result;
};

/* What came of a tile, beside the pixels, which go straight to their place. */
struct tile_outcome {
    uint64_t rays;
    struct row_figures figures[TILE_ROWS];
    struct survey survey;
};

/* The order fits the job. */
void band_init(struct band *band, const struct job_settings *settings, const struct order *order);

void band_finish(struct band *band);

/* Works on a tile with a tracer of the job's plan. Concurrent calls name different tiles. */
void band_work(const struct band *band, struct tracer *tracer, uint32_t tile, struct tile_outcome *outcome);

void band_add(struct band *band, uint32_t tile, const struct tile_outcome *outcome);

/* With all tiles added: the rows' records (wire/rows.h) or their survey (trace/survey.h), which the caller frees. */
struct bytes band_complete(struct band *band);

#endif
