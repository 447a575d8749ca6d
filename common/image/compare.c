#include "image/compare.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "math/colour.h"
#include "math/elementary.h"

/* A step of 8 bit codes and a quarter of one of 16 bit codes: neither the rounding of linear light to float nor that of
 * the difference takes a step of exactly 1/255 beyond it, and the next larger difference of 16 bit codes is. */
static const double STEP = 1.0 / 255 + 0.25 / 65535;

struct row_difference {
    double squares; /* their sum */
    double maximum;
    size_t pixels_off;
};

struct comparison {
    const struct image *a, *b;
    struct row_difference *rows;
};

static void add_pixel(struct row_difference *row, const double a[3], const double b[3])
{
    double squares = 0, most = 0;
    for (int c = 0; c < 3; c++) {
        double difference = fabs(a[c] - b[c]);
        squares += difference * difference;
        most = difference > most ? difference : most;
    }
    row->squares += squares;
    row->maximum = most > row->maximum ? most : row->maximum;
    row->pixels_off += most > STEP;
}

static void compare_row(void *context, size_t y)
{
    enum { PIXELS_AT_ONCE = 256 };
    double a[3 * PIXELS_AT_ONCE], b[3 * PIXELS_AT_ONCE];
    const struct comparison *job = context;
    size_t width = job->a->width;
    for (size_t start = 0; start < width; start += PIXELS_AT_ONCE) {
        size_t count = width - start < PIXELS_AT_ONCE ? width - start : PIXELS_AT_ONCE;
        size_t at = 3 * (y * width + start);
        colour_encode_srgb_many(job->a->rgb + at, 3 * count, a);
        colour_encode_srgb_many(job->b->rgb + at, 3 * count, b);
        for (size_t i = 0; i < count; i++)
            add_pixel(&job->rows[y], a + 3 * i, b + 3 * i);
    }
}

struct image_difference image_compare(const struct image *a, const struct image *b, int threads)
{
    assert(a->width == b->width && a->height == b->height && a->rgb && b->rgb);
    struct comparison job = {a, b, memory_array(a->height, sizeof *job.rows)};
    parallel_for(threads, a->height, compare_row, &job);
    struct row_difference all = {0};
    for (size_t y = 0; y < a->height; y++) { /* in this order whoever did the rows */
        all.squares += job.rows[y].squares;
        all.maximum = job.rows[y].maximum > all.maximum ? job.rows[y].maximum : all.maximum;
        all.pixels_off += job.rows[y].pixels_off;
    }
    free(job.rows);
    double pixels = (double)a->width * a->height;
    return (struct image_difference){sqrt(all.squares / (3 * pixels)), all.maximum, (double)all.pixels_off / pixels};
}

double image_psnr(double rmse)
{
    return rmse > 0 ? 20 / M_LN10 * math_log(1 / rmse) : INFINITY;
}
