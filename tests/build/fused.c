/* Compiled, never run, by tests that look for fused instructions and must find one. */
void add_products(double *restrict sums, const double *restrict a, const double *restrict b, int count);
void add_products(double *restrict sums, const double *restrict a, const double *restrict b, int count)
{
    for (int i = 0; i < count; i++)
        sums[i] += a[i] * b[i];
}
