/*
 * Lanes: loops over rays that the compiler turns into vector instructions.
 *
 * A file under lanes/ is compiled once for each instruction set, as plain C: loops over structures of arrays whose
 * bodies are inline functions without branches (intersect.h), so each lane computes what a scalar would, bit for bit.
 * LANES_SUFFIX names the instruction set and ends the names of what such a file exports.
 */
#ifndef WEFT_TRACE_LANES_H
#define WEFT_TRACE_LANES_H

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

#endif
