/*
 * What a band is to be rendered as.
 */
#ifndef WEFT_WORKER_ORDER_H
#define WEFT_WORKER_ORDER_H

#include <stdbool.h>
#include <stdint.h>

#include "trace/sampling.h"
#include "wire/message.h"

struct order {
    enum render_pass pass;
    uint32_t first_row, rows; /* of the picture, or of its survey's cells */
    struct sampling sampling;
};

/* The order that a BAND message gives. */
struct order order_of(const struct message *band);

/* Whether a picture of these settings has these rows, their result is not too large (wire/message.h), and its tracer
 * (sampling.h, survey.h) knows such a sampling. */
bool order_fits(const struct order *order, const struct job_settings *settings);

#endif
