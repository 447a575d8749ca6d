/*
 * Conversions from double to float and back that gcc 12 deletes with its SLP vectoriser, at -O2 and -O3 on x86-64: of
 * neighbouring values it then copies the doubles as they are.
 */
#ifndef WEFT_TESTS_ROUNDING_H
#define WEFT_TESTS_ROUNDING_H

/* out[i] = in[i], rounded to float. */
static __attribute__((noinline)) void round_pair(double *restrict out, const double *restrict in)
{
    const float rounded[2] = {(float)in[0], (float)in[1]};
    out[0] = rounded[0];
    out[1] = rounded[1];
}

struct triple {
    double x, y, z;
};

static __attribute__((noinline)) struct triple round_triple(struct triple v)
{
    const float rounded[3] = {(float)v.x, (float)v.y, (float)v.z};
    return (struct triple){rounded[0], rounded[1], rounded[2]};
}

/* How many of the five conversions were carried out: 1/3 is no float. */
static int conversions_done(void)
{
    volatile double third = 1.0 / 3; /* lest the compiler does them itself, rightly */
    const double in[2] = {third, -third};
    double out[2];
    round_pair(out, in);
    const struct triple triple = round_triple((struct triple){third, 2 * third, -third});
    const double rounded = 0x1.555556p-2; /* 1/3 as a float */
    return (out[0] == rounded) + (out[1] == -rounded) + (triple.x == rounded) + (triple.y == 2 * rounded) +
           (triple.z == -rounded);
}

#endif
