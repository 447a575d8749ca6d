#include "coordinator/map_colours.h"

#include "image/flip.h"
#include "trace/sampling.h"

void map_colour_of_stage(uint8_t stage, uint8_t codes[3])
{
    enum { LAST = SAMPLING_STAGES - 1, HALF = 3 }; /* half-way up if the scale had no end */
    flip_colour((float)(stage * (LAST + HALF)) / (float)((stage + HALF) * LAST), codes);
}

void map_colour_of_error(uint8_t error, uint8_t codes[3])
{
    enum { OCTAVE = 8, LIGHTEST = 255 - OCTAVE, DARKEST = 255 - 11 * OCTAVE };
    flip_colour((float)(error - DARKEST) / (LIGHTEST - DARKEST), codes);
}
