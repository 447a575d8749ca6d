#include "wire/rows.h"

#include <string.h>

void row_figures_write(uint8_t *record, const struct row_figures *figures)
{
    struct bytes bytes = {0};
    bytes_put_u64(&bytes, figures->samples);
    bytes_put_u64(&bytes, figures->secondary_rays);
    bytes_put_u64(&bytes, figures->shadow_rays);
    memcpy(record, bytes.data, ROW_FIGURES_BYTES);
    bytes_finish(&bytes);
}

const uint8_t *row_record_decode(const uint8_t *data, struct row_figures *figures)
{
    struct byte_reader reader = byte_reader_of(data, ROW_FIGURES_BYTES);
    figures->samples = byte_reader_u64(&reader);
    figures->secondary_rays = byte_reader_u64(&reader);
    figures->shadow_rays = byte_reader_u64(&reader);
    return data + ROW_FIGURES_BYTES;
}
