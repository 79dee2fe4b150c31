/* SPDX-License-Identifier: MIT */
/* Loops that compilers vectorise: plain C over LANES adjacent values. A function with such loops is a
 * LANES_KERNEL, compiled once for each kind of vector unit; the functions that it calls are LANES_INLINE, so
 * that they are part of each version. Results are equal on all processors: the folder is compiled without
 * contraction of products and sums. */
#ifndef FARLIGHT_CLIENT_WARP_LANES_H
#define FARLIGHT_CLIENT_WARP_LANES_H

#include "quadtree/layout.h"

#include <stdint.h>
#include <string.h>

#define LANES 16 /* floats in the widest vector registers */

#define LANES_INLINE static inline __attribute__((always_inline))

/* LANES_CLONES is set by the Makefile for optimised builds without sanitizers. A loop that mostly loads takes a
 * tenth less time with registers of 256 bits. Kernels are static because clang renames clones across files. */
#if defined(LANES_CLONES) && defined(__x86_64__)
#define LANES_KERNEL __attribute__((target_clones("avx512f", "avx2", "default")))
#define LANES_KERNEL_OF_LOADS __attribute__((target_clones("avx2", "default")))
#else
#define LANES_KERNEL
#define LANES_KERNEL_OF_LOADS
#endif

LANES_INLINE float float_from_bits(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof(value));
    return value;
}

LANES_INLINE uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof(bits));
    return bits;
}

LANES_INLINE float magnitude(float a)
{
    return float_from_bits(bits_of(a) & 0x7fffffffu);
}

LANES_INLINE float min_of(float a, float b)
{
    return a < b ? a : b;
}

LANES_INLINE float max_of(float a, float b)
{
    return a > b ? a : b;
}

LANES_INLINE int min_int(int a, int b)
{
    return a < b ? a : b;
}

LANES_INLINE int max_int(int a, int b)
{
    return a > b ? a : b;
}

LANES_INLINE float max_of_4(const float a[4])
{
    return max_of(max_of(a[0], a[1]), max_of(a[2], a[3]));
}

LANES_INLINE float min_of_4(const float a[4])
{
    return min_of(min_of(a[0], a[1]), min_of(a[2], a[3]));
}

/* Conditions of lanes are masks, all bits or none, as in vector registers; for a `bool` compilers make branches
 * or bytes. */
LANES_INLINE uint32_t mask_of(int condition)
{
    return (uint32_t)-condition;
}

LANES_INLINE int pick_int(uint32_t mask, int a, int b)
{
    return (int)(((uint32_t)a & mask) | ((uint32_t)b & ~mask));
}

LANES_INLINE float pick(uint32_t mask, float a, float b)
{
    return float_from_bits((bits_of(a) & mask) | (bits_of(b) & ~mask));
}

/* NaN becomes `low`. */
LANES_INLINE float clamp(float a, float low, float high)
{
    return min_of(max_of(a, low), high);
}

#endif
