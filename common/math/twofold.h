/*
 * Numbers as the unevaluated sum of two doubles, of which the second is what rounding would lose: for the few
 * differences in which nearly everything cancels. Exact as long as nothing overflows (products: factors from 2^996) or
 * underflows.
 */
#ifndef WEFT_MATH_TWOFOLD_H
#define WEFT_MATH_TWOFOLD_H

struct twofold {
    double high, low;
};

/* a + b, exactly (Knuth, The Art of Computer Programming 2, 4.2.2, theorem B). */
static inline struct twofold twofold_sum(double a, double b)
{
    double sum = a + b, of_b = sum - a;
    return (struct twofold){sum, (a - (sum - of_b)) + (b - of_b)};
}

/* a b, exactly (Dekker 1971, with Veltkamp's splitting). */
static inline struct twofold twofold_product(double a, double b)
{
    double product = a * b;
    double a_big = 134217729 * a, b_big = 134217729 * b; /* 2^27 + 1 */
    double a_high = a_big - (a_big - a), b_high = b_big - (b_big - b);
    double a_low = a - a_high, b_low = b - b_high;
    return (struct twofold){product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)};
}

/* a + b, to about 2^-104 of |a| + |b|. */
static inline struct twofold twofold_add(struct twofold a, struct twofold b)
{
    struct twofold sum = twofold_sum(a.high, b.high);
    return twofold_sum(sum.high, sum.low + (a.low + b.low));
}

#endif
