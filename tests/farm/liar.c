/*
 * A worker that lies: linked with this, weft-worker flips one bit of some of its results. LIES="FROM EVERY" says which:
 * the one of that number, counted from 0, and every so many after it.
 */
#include <stdio.h>
#include <stdlib.h>

#include "worker/band.h"

struct bytes __real_band_complete(struct band *band);
struct bytes __wrap_band_complete(struct band *band);

struct bytes __wrap_band_complete(struct band *band)
{
    static unsigned number;
    unsigned from = 0, every = 1;
    struct bytes result = __real_band_complete(band);
    const char *lies = getenv("LIES");
    if (lies && sscanf(lies, "%u %u", &from, &every) == 2 && number >= from && (number - from) % every == 0)
        result.data[result.size - 1] ^= 1; /* of a pixel, or of a survey's largest digit */
    number++;
    return result;
}
