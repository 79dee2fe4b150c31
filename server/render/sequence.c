/* SPDX-License-Identifier: MIT */
#include "render/sequence.h"

uint32_t sequence_hash(uint32_t v)
{
    uint32_t state = v * 747796405u + 2891336453u;
    uint32_t word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}

static uint32_t reverse(uint32_t v)
{
    v = (v >> 1 & 0x55555555u) | (v & 0x55555555u) << 1;
    v = (v >> 2 & 0x33333333u) | (v & 0x33333333u) << 2;
    v = (v >> 4 & 0x0f0f0f0fu) | (v & 0x0f0f0f0fu) << 4;
    v = (v >> 8 & 0x00ff00ffu) | (v & 0x00ff00ffu) << 8;
    return v >> 16 | v << 16;
}

static uint32_t scramble_reversed(uint32_t v, uint32_t seed)
{
    v ^= v * 0x3d20adeau;
    v += seed;
    v *= seed >> 16 | 1u;
    v ^= v * 0x05526c56u;
    v ^= v * 0x53a22864u;
    return v;
}

static uint32_t sobol_second_reversed(uint32_t v)
{
    v ^= v >> 16;
    v ^= (v & 0xff00ff00u) >> 8;
    v ^= (v & 0xf0f0f0f0u) >> 4;
    v ^= (v & 0xccccccccu) >> 2;
    v ^= (v & 0xaaaaaaaau) >> 1;
    return v;
}

static float unit_from_bits(uint32_t v)
{
    return (float)(v >> 8) * 0x1p-24f;
}

uint32_t sequence_seed(uint32_t number, uint32_t seed)
{
    return sequence_hash(number + sequence_hash(seed));
}

float sequence_number(uint32_t pixel_seed, uint32_t dimension, uint32_t index)
{
    uint32_t own = sequence_hash(pixel_seed + dimension * 0x9e3779b9u);
    uint32_t place = reverse(scramble_reversed(reverse(index), own));
    return unit_from_bits(reverse(scramble_reversed(place, sequence_hash(own))));
}

static void pair_at(float pair[2], uint32_t place, uint32_t own)
{
    uint32_t first = sequence_hash(own), second = sequence_hash(first);
    pair[0] = unit_from_bits(reverse(scramble_reversed(place, first)));
    pair[1] = unit_from_bits(reverse(scramble_reversed(sobol_second_reversed(place), second)));
}

void sequence_pair(float pair[2], uint32_t pixel_seed, uint32_t dimension, uint32_t index)
{
    uint32_t own = sequence_hash(pixel_seed + dimension * 0x9e3779b9u);
    pair_at(pair, reverse(scramble_reversed(reverse(index), own)), own);
}

void sequence_pair_sorted(float pair[2], uint32_t pixel_seed, uint32_t dimension, uint32_t index,
                          uint32_t group_shift)
{
    uint32_t own = sequence_hash(pixel_seed + dimension * 0x9e3779b9u), mask = (1u << group_shift) - 1u;
    uint32_t group = reverse(scramble_reversed(reverse(index), own)) & ~mask;
    pair_at(pair, group | (group_shift > 0 ? reverse(index & mask) >> (32 - group_shift) : 0), own);
}
