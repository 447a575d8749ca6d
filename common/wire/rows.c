#include "wire/rows.h"

#include <string.h>

static uint64_t saturated_sum(uint64_t a, uint64_t b)
{
    return b > UINT64_MAX - a ? UINT64_MAX : a + b;
}

void row_figures_add(struct row_figures *to, const struct row_figures *from)
{
    to->samples += from->samples;
    to->secondary_rays += from->secondary_rays;
    to->shadow_rays += from->shadow_rays;
    for (size_t i = 0; i < 2; i++)
        to->error[i] = saturated_sum(to->error[i], from->error[i]);
    for (size_t i = 0; i < ROW_STAGES; i++)
        to->stages[i] += from->stages[i];
}

void row_figures_write(uint8_t *record, const struct row_figures *figures)
{
    struct bytes bytes = {0};
    bytes_put_u64(&bytes, figures->samples);
    bytes_put_u64(&bytes, figures->secondary_rays);
    bytes_put_u64(&bytes, figures->shadow_rays);
    for (size_t i = 0; i < 2; i++)
        bytes_put_u64(&bytes, figures->error[i]);
    for (size_t i = 0; i < ROW_STAGES; i++)
        bytes_put_u64(&bytes, figures->stages[i]);
    memcpy(record, bytes.data, ROW_FIGURES_BYTES);
    bytes_finish(&bytes);
}

void row_figures_read(const uint8_t *record, struct row_figures *figures)
{
    struct byte_reader reader = byte_reader_of(record, ROW_FIGURES_BYTES);
    figures->samples = byte_reader_u64(&reader);
    figures->secondary_rays = byte_reader_u64(&reader);
    figures->shadow_rays = byte_reader_u64(&reader);
    for (size_t i = 0; i < 2; i++)
        figures->error[i] = byte_reader_u64(&reader);
    for (size_t i = 0; i < ROW_STAGES; i++)
        figures->stages[i] = byte_reader_u64(&reader);
}

/* --- errors on a scale ------------------------------------------------------------------------------------ */

enum { CODE_OF_ONE = 255, STEPS = 8 }; /* an octave of the RMS error, so half as many of the squared one */

/* 2^(1/8), 2^(3/8), 2^(5/8), 2^(7/8): midway between the steps of an octave of the squared error. */
static const double midway[STEPS / 2] = {1.0905077326652577, 1.2968395546510096, 1.5422108254079407,
                                         1.8340080864093424};

uint8_t row_error_code(double squared)
{
    if (!(squared > 0))
        return 0;
    if (squared >= 1)
        return CODE_OF_ONE;
    int code = CODE_OF_ONE;
    for (; squared < 1 && code > 1; code -= STEPS / 2) /* exact: into 1 <= squared < 2 */
        squared *= 2;
    for (size_t i = 0; i < STEPS / 2; i++)
        code += squared >= midway[i];
    return (uint8_t)(code < 1 ? 1 : code);
}

double row_error_of(uint8_t code)
{
    /* 2^(-i/8) */
    static const double within[STEPS] = {1,
                                         0.9170040432046712,
                                         0.8408964152537145,
                                         0.7711054127039704,
                                         0.7071067811865476,
                                         0.6484197773255048,
                                         0.5946035575013605,
                                         0.5452538663326288};
    unsigned below = CODE_OF_ONE - code;
    return code == 0 ? 0 : within[below % STEPS] / (double)(UINT64_C(1) << below / STEPS);
}
