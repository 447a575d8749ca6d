/*
 * Lanes: loops over rays that the compiler turns into vector instructions.
 *
 * A file under lanes/ is compiled once for each instruction set, as plain C: loops over structures of arrays whose
 * bodies are inline functions without branches (intersect.h), so each lane computes what a scalar would, bit for bit.
 * LANES_SUFFIX names the instruction set and ends the names of what such a file exports.
 */
#ifndef WEFT_TRACE_LANES_H
#define WEFT_TRACE_LANES_H

#include <stddef.h>
#include <stdint.h>

#if defined(__AVX__) || defined(__SSE2__)
#include <immintrin.h>
#endif

#ifndef LANES_SUFFIX
#error "LANES_SUFFIX must name the instruction set that this file is compiled for"
#endif

/* name_suffix */
#define LANES_JOIN(name, suffix) name##_##suffix
#define LANES_EXPAND(name, suffix) LANES_JOIN(name, suffix)
#define LANES_NAME(name) LANES_EXPAND(name, LANES_SUFFIX)
#define LANES_DECLARE_THESE(isa) LANES_DECLARE(isa)

/* Before a loop whose turns do not depend on one another. */
#if defined(__clang__)
#define LANES_LOOP _Pragma("clang loop vectorize(assume_safety)")
#else
#define LANES_LOOP _Pragma("GCC ivdep")
#endif

/* Bit i: whether a[i] <= b[i], for eight floats, both 32-byte aligned. No loop over bits becomes this by itself. */
static inline uint32_t lanes_at_most(const float *a, const float *b)
{
#if defined(__AVX__)
    return (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(_mm256_load_ps(a), _mm256_load_ps(b), _CMP_LE_OQ));
#elif defined(__SSE2__)
    uint32_t low = (uint32_t)_mm_movemask_ps(_mm_cmple_ps(_mm_load_ps(a), _mm_load_ps(b)));
    return low | (uint32_t)_mm_movemask_ps(_mm_cmple_ps(_mm_load_ps(a + 4), _mm_load_ps(b + 4))) << 4;
#else
    uint32_t mask = 0;
    for (int i = 0; i < 8; i++)
        mask |= (uint32_t)(a[i] <= b[i]) << i;
    return mask;
#endif
}

/* The same for sixteen, 64-byte aligned. */
static inline uint32_t lanes_at_most_16(const float *a, const float *b)
{
#if defined(__AVX512F__)
    return _mm512_cmp_ps_mask(_mm512_load_ps(a), _mm512_load_ps(b), _CMP_LE_OQ);
#else
    return lanes_at_most(a, b) | lanes_at_most(a + 8, b + 8) << 8;
#endif
}

/* Bit i: whether a[i] is not below b, for sixteen floats, 64-byte aligned; that of NaN is set. */
static inline uint32_t lanes_not_below_16(const float *a, float b)
{
#if defined(__AVX512F__)
    return _mm512_cmp_ps_mask(_mm512_load_ps(a), _mm512_set1_ps(b), _CMP_NLT_UQ);
#elif defined(__AVX__)
    const __m256 bound = _mm256_set1_ps(b);
    uint32_t low = (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(_mm256_load_ps(a), bound, _CMP_NLT_UQ));
    return low | (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(_mm256_load_ps(a + 8), bound, _CMP_NLT_UQ)) << 8;
#elif defined(__SSE2__)
    const __m128 bound = _mm_set1_ps(b);
    uint32_t mask = 0;
    for (int i = 0; i < 16; i += 4)
        mask |= (uint32_t)_mm_movemask_ps(_mm_cmpnlt_ps(_mm_load_ps(a + i), bound)) << i;
    return mask;
#else
    uint32_t mask = 0;
    for (int i = 0; i < 16; i++)
        mask |= (uint32_t) !(a[i] < b) << i;
    return mask;
#endif
}

/* The least and the largest of `count` floats, none of them NaN: a multiple of 16, 64-byte aligned. Compilers do not
 * take the last steps, across one vector, in vectors. */
static inline void lanes_range(const float *values, int count, float *least, float *largest)
{
#if defined(__AVX__)
    __m256 low = _mm256_load_ps(values), high = low;
    for (int i = 8; i < count; i += 8) {
        __m256 next = _mm256_load_ps(values + i);
        low = _mm256_min_ps(low, next);
        high = _mm256_max_ps(high, next);
    }
    __m128 l = _mm_min_ps(_mm256_castps256_ps128(low), _mm256_extractf128_ps(low, 1));
    __m128 h = _mm_max_ps(_mm256_castps256_ps128(high), _mm256_extractf128_ps(high, 1));
    l = _mm_min_ps(l, _mm_movehl_ps(l, l));
    h = _mm_max_ps(h, _mm_movehl_ps(h, h));
    *least = _mm_cvtss_f32(_mm_min_ss(l, _mm_shuffle_ps(l, l, 1)));
    *largest = _mm_cvtss_f32(_mm_max_ss(h, _mm_shuffle_ps(h, h, 1)));
#else
    float low[4], high[4];
    for (int i = 0; i < 4; i++)
        low[i] = high[i] = values[i];
    for (int base = 4; base < count; base += 4)
        LANES_LOOP
        for (int i = 0; i < 4; i++) {
            low[i] = values[base + i] < low[i] ? values[base + i] : low[i];
            high[i] = values[base + i] > high[i] ? values[base + i] : high[i];
        }
    *least = *largest = values[0];
    for (int i = 0; i < 4; i++) {
        *least = low[i] < *least ? low[i] : *least;
        *largest = high[i] > *largest ? high[i] : *largest;
    }
#endif
}

/* Bit i: whether a[i] is not below 0, for eight doubles, 64-byte aligned; that of NaN is set. */
static inline uint32_t lanes_not_negative(const double *a)
{
#if defined(__AVX512F__)
    return _mm512_cmp_pd_mask(_mm512_load_pd(a), _mm512_setzero_pd(), _CMP_NLT_UQ);
#elif defined(__AVX__)
    const __m256d zero = _mm256_setzero_pd();
    uint32_t low = (uint32_t)_mm256_movemask_pd(_mm256_cmp_pd(_mm256_load_pd(a), zero, _CMP_NLT_UQ));
    return low | (uint32_t)_mm256_movemask_pd(_mm256_cmp_pd(_mm256_load_pd(a + 4), zero, _CMP_NLT_UQ)) << 4;
#else
    uint32_t mask = 0;
    for (int i = 0; i < 8; i++)
        mask |= (uint32_t) !(a[i] < 0) << i;
    return mask;
#endif
}

/* The first 4 × blocks doubles of four structs that lie `stride` doubles apart, turned so that to[f][k] is number f of
 * struct k; `to` is 32-byte aligned. */
static inline void lanes_transpose(const double *from, size_t stride, int blocks, double (*to)[4])
{
    for (int block = 0; block < blocks; block++, from += 4, to += 4) {
#if defined(__AVX__)
        __m256d a = _mm256_loadu_pd(from), b = _mm256_loadu_pd(from + stride);
        __m256d c = _mm256_loadu_pd(from + 2 * stride), d = _mm256_loadu_pd(from + 3 * stride);
        __m256d ab0 = _mm256_unpacklo_pd(a, b), ab1 = _mm256_unpackhi_pd(a, b);
        __m256d cd0 = _mm256_unpacklo_pd(c, d), cd1 = _mm256_unpackhi_pd(c, d);
        _mm256_store_pd(to[0], _mm256_permute2f128_pd(ab0, cd0, 0x20));
        _mm256_store_pd(to[1], _mm256_permute2f128_pd(ab1, cd1, 0x20));
        _mm256_store_pd(to[2], _mm256_permute2f128_pd(ab0, cd0, 0x31));
        _mm256_store_pd(to[3], _mm256_permute2f128_pd(ab1, cd1, 0x31));
#else
        for (int f = 0; f < 4; f++)
            for (size_t k = 0; k < 4; k++)
                to[f][k] = from[k * stride + (size_t)f];
#endif
    }
}

#endif
