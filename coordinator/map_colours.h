/*
 * The colours of maps: FLIP's (image/flip.h), which grow lighter all the way and so can be told apart by everyone.
 */
#ifndef WEFT_COORDINATOR_MAP_COLOURS_H
#define WEFT_COORDINATOR_MAP_COLOURS_H

#include <stdint.h>

/* Of a stage of sampling (trace/sampling.h): a step each from black, 1 sample, to pale yellow, 65,536. The first steps,
 * which most pixels get no further than, are the largest. */
void map_colour_of_stage(uint8_t stage, uint8_t codes[3]);

/* Of the code of a pixel's RMS error (wire/rows.h): a tenth of the scale an octave, from black, 2^-11 (0.0005) and
 * less, to pale yellow, 0.5 and more. */
void map_colour_of_error(uint8_t error, uint8_t codes[3]);

#endif
