/* SPDX-License-Identifier: MIT */
/* Owen-scrambled Sobol points, as shaders/common/sequence.glsl has them. */
#include "render/picture/sequence.h"

static uint32_t hash(uint32_t v)
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

enum { DIGITS = 0xfff };

struct sequence_seed sequence_seed(uint32_t x, uint32_t y, uint32_t seed)
{
    struct sequence_seed pixel = {.block = hash((x >> 3) + hash((y >> 3) + hash(seed)))};
    for (uint32_t bit = 0; bit < 3; bit++)
        pixel.place |= (y >> (2 - bit) & 1u) << (2 * bit) | (x >> (2 - bit) & 1u) << (2 * bit + 1);
    return pixel;
}

static uint32_t place_of(uint32_t place, uint32_t own)
{
    place = scramble_reversed(place, own);
    uint32_t upper = place & 0x15u, lower = place >> 1 & 0x15u, mixed = upper ^ lower;
    uint32_t once = own >> 8 & ~(own >> 9) & 0x15u, twice = own >> 9 & ~(own >> 8) & 0x15u;
    uint32_t same = ~(once | twice);
    return (upper & same) | (mixed & once) | (lower & twice) |
           ((lower & same) | (upper & once) | (mixed & twice)) << 1;
}

static uint32_t column_of(uint32_t place)
{
    static const uint32_t columns[] = {0x0f5b0e5bu, 0x0cb60cedu, 0x07140bd1u,
                                       0x02d10514u, 0x090708f0u, 0x0d1a0541u};
    uint32_t sum = 0;
    for (uint32_t i = 0; i < 6; i++)
        sum ^= (place >> (5 - i) & 1u) * columns[i];
    return sum;
}

static uint32_t shuffled(uint32_t index, uint32_t seed)
{
    uint32_t v = reverse(index);
    v ^= v * 0x3d20adeau;
    v *= seed | 1u;
    v ^= v * 0x05526c56u;
    v *= seed >> 16 | 1u;
    v ^= v * 0x53a22864u;
    return reverse(v);
}

struct choice {
    uint32_t own, column, order;
};

static struct choice choose(struct sequence_seed pixel, uint32_t dimension)
{
    uint32_t own = hash(pixel.block + dimension * 0x9e3779b9u), place = place_of(pixel.place, own);
    return (struct choice){own, column_of(place), hash(own + place + 1u)};
}

float sequence_number(struct sequence_seed pixel, uint32_t dimension, uint32_t index)
{
    struct choice c = choose(pixel, dimension);
    uint32_t digits = shuffled(index, c.order) ^ (c.column & DIGITS) ^ (c.order & ~(uint32_t)DIGITS);
    return unit_from_bits(reverse(scramble_reversed(digits, hash(c.own))));
}

static void pair_at(float pair[2], uint32_t index, struct choice c)
{
    uint32_t first = hash(c.own), second = hash(first), last_digits = c.order & ~(uint32_t)DIGITS;
    uint32_t x = index ^ (c.column & DIGITS) ^ last_digits;
    uint32_t y = sobol_second_reversed(index) ^ c.column >> 16 ^ last_digits;
    pair[0] = unit_from_bits(reverse(scramble_reversed(x, first)));
    pair[1] = unit_from_bits(reverse(scramble_reversed(y, second)));
}

void sequence_pair(float pair[2], struct sequence_seed pixel, uint32_t dimension, uint32_t index)
{
    struct choice c = choose(pixel, dimension);
    pair_at(pair, shuffled(index, c.order), c);
}

void sequence_pair_sorted(float pair[2], struct sequence_seed pixel, uint32_t dimension, uint32_t index,
                          uint32_t group_shift)
{
    struct choice c = choose(pixel, dimension);
    uint32_t mask = (1u << group_shift) - 1u, group = shuffled(index, c.order) & ~mask;
    pair_at(pair, group | (group_shift > 0 ? reverse(index & mask) >> (32 - group_shift) : 0), c);
}
