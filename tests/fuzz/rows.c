/* Row records of untruthful workers: figures have just one encoding, and the sums of them tell no error below 0. */
#include <math.h>

#include "coordinator/render_job.h"
#include "tests/fuzz/fuzz.h"
#include "wire/rows.h"

enum { WIDTH = 40 };

static void require_error(const struct render_job *job, uint32_t rows, const struct row_figures *figures)
{
    double rmse = render_job_rows_rmse(job, rows, figures);
    require(rmse >= 0 || isnan(rmse));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct row_figures sum = {0};
    uint32_t rows = 0;
    for (; size - rows * ROW_FIGURES_BYTES >= ROW_FIGURES_BYTES; rows++) {
        uint8_t again[ROW_FIGURES_BYTES];
        struct row_figures figures;
        row_figures_read(data + rows * ROW_FIGURES_BYTES, &figures);
        row_figures_write(again, &figures);
        require(memcmp(again, data + rows * ROW_FIGURES_BYTES, ROW_FIGURES_BYTES) == 0);
        row_figures_add(&sum, &figures);
    }
    static struct render_job job; /* all zero but for: */
    job.settings.width = WIDTH;
    job.settings.height = rows;
    for (uint32_t most = 1; most <= 4 && rows > 0; most *= 4) {
        job.sampling = (struct sampling){1, most, 0};
        for (job.error = 0; job.error < 1; job.error += 0.5)
            require_error(&job, rows, &sum);
    }
    return 0;
}
