/*
 * Decimal numbers in text, read as the nearest double, whatever the locale.
 */
#ifndef WEFT_SCENE_NUMBER_H
#define WEFT_SCENE_NUMBER_H

/* *value becomes the number that `text` begins with: an optional sign, digits with at most one point among,
 * before or after them, and an optional exponent ("1", "-.5", "2.", "1e-3"). Returns where it ends; NULL (and
 * *value as it was) if the text begins with none: "nan", "inf" and "+" are no numbers, and of "0x1" only the
 * "0" is one. The value is that of strtod in the C locale; beyond double's range it is infinite.
 *
 * A NUL must follow the text somewhere. */
const char *number_read(const char *text, double *value);

#endif
