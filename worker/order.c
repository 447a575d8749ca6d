#include "worker/order.h"

#include "image/encode.h"
#include "trace/survey.h"
#include "wire/rows.h"

struct order order_of(const struct message *band)
{
    return (struct order){
        .pass = (enum render_pass)band->band.pass,
        .first_row = band->band.first_row,
        .rows = band->band.rows,
        .sampling = {band->band.sampling.least, band->band.sampling.most, band->band.sampling.threshold},
    };
}

static bool is_stage(uint32_t samples)
{
    return sampling_stage(sampling_stage_within(samples)) == samples;
}

static bool is_fixed(const struct sampling *sampling)
{
    return sampling_is_fixed(sampling) && sampling->least >= 1 && sampling->most <= MESSAGE_SAMPLES_MAX;
}

static bool is_adaptive(const struct sampling *sampling)
{
    return is_stage(sampling->least) && is_stage(sampling->most) && sampling->most > sampling->least &&
           sampling->most <= MESSAGE_SAMPLES_MAX &&
           sampling->threshold < SAMPLING_THRESHOLDS;
}

static bool is_small(const struct order *order, const struct job_settings *settings)
{
    const struct row_layout layout = row_layout_of(
        settings->width, pixel_format_bytes((enum pixel_format)settings->pixel_format), settings->maps);
    return order->pass == PASS_SURVEY || order->rows <= MESSAGE_RESULT_MAX / row_record_bytes(&layout);
}

bool order_fits(const struct order *order, const struct job_settings *settings)
{
    const struct sampling *sampling = &order->sampling;
    bool surveys = order->pass == PASS_SURVEY;
    uint32_t rows = surveys ? survey_grid(settings->width, settings->height).down : settings->height;
    return order->rows > 0 && order->first_row < rows && order->rows <= rows - order->first_row &&
           is_small(order, settings) &&
           (surveys ? is_adaptive(sampling) && sampling->least == 1 : is_fixed(sampling) || is_adaptive(sampling));
}
