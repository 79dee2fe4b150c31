// SPDX-License-Identifier: MIT
// Random numbers of samples: Owen-scrambled Sobol points. server/render/picture/sequence.c is the host's version.
//
// Each choice (a dimension: SEQUENCE_* of shared/frame.h) has one or two numbers of a sequence of its own for each
// pixel and seed, so that choices are not correlated. The numbers of the samples 0 .. 2^k - 1, and of any aligned 2^k
// after them, are stratified as in a (0, 2)-sequence: one in each of 2^k intervals, and as pairs one in each 2^a x
// 2^(k-a) cell; so the error of a mean of n of them falls as fast as n^-1.5 where the integrand is smooth.
//
// The pixels of an aligned block of 8 x 8 have one scrambling, and each its own part of it: the first 2^k samples of 2 x 2,
// 4 x 4 or all 8 x 8 of them (aligned) are together stratified like 2^k times as many of one pixel, up to 64 samples a
// pixel. So the errors of neighbours cancel each other, and the rest is blue noise. This is the method of Ahmed and Wonka
// (Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels. 2020), who number
// the samples of all pixels consecutively; they need to know the number of a pixel's samples, while here frames add to
// earlier ones.
//
// Burley. Practical Hash-based Owen Scrambling. JCGT 2020: a hash in which no bit depends on a higher one scrambles
// reversed bits as Owen's tree does, and shuffles the order of the samples so that dimensions may be padded.

// PCG in the form of Jarzynski and Olano. Hash Functions for GPU Rendering. 2020.
uint hash_u32(uint v)
{
    uint state = v * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}

// Laine and Karras. Stratified Sampling for Stochastic Transparency. 2011, with the constants of Vegdahl. Building
// a Better LK Hash. 2021.
uint scramble_reversed(uint v, uint seed)
{
    v ^= v * 0x3d20adeau;
    v += seed;
    v *= seed >> 16 | 1u;
    v ^= v * 0x05526c56u;
    v ^= v * 0x53a22864u;
    return v;
}

// Second Sobol dimension of a point, bits reversed: Pascal's triangle modulo 2 times the bits of its index, whose factors
// Lucas' theorem gives. The first dimension is the index itself.
uint sobol_second_reversed(uint v)
{
    v ^= v >> 16;
    v ^= (v & 0xff00ff00u) >> 8;
    v ^= (v & 0xf0f0f0f0u) >> 4;
    v ^= (v & 0xccccccccu) >> 2;
    v ^= (v & 0xaaaaaaaau) >> 1;
    return v;
}

float unit_from_bits(uint v)
{
    return float(v >> 8) * (1.0 / 16777216.0);
}

// Digits that each bit of a pixel's place in its block adds to a sample, beginning with x and y of its 2 x 2: the first
// number's twelve in the low half, the second's in the high one, first digits lowest. They are columns of digital nets'
// matrices (Niederreiter. Random Number Generation and Quasi-Monte Carlo Methods. 1992, section 4.3), found by search:
// beside the first k columns of the identity and of Pascal's triangle, k = 0 .. 6, the first 2, 4 or 6 of these leave no
// dependent rows among the first a of the one half and the k + 2, 4 or 6 - a of the other.
const uint SEQUENCE_COLUMN_0 = 0x0f5b0e5bu, SEQUENCE_COLUMN_1 = 0x0cb60cedu, SEQUENCE_COLUMN_2 = 0x07140bd1u;
const uint SEQUENCE_COLUMN_3 = 0x02d10514u, SEQUENCE_COLUMN_4 = 0x090708f0u, SEQUENCE_COLUMN_5 = 0x0d1a0541u;
const uint SEQUENCE_DIGITS = 0xfffu;

// Seed of a pixel for the functions below: that of its block, and its place there, with alternating bits of x and y, the
// largest ones lowest.
uvec2 sequence_seed(uvec2 pixel, uint seed)
{
    uvec2 block = pixel >> 3, at = pixel & 7u;
    at = at >> 2 & 1u | (at & 2u) << 1 | (at & 1u) << 4;
    return uvec2(hash_u32(block.x + hash_u32(block.y + hash_u32(seed))), at.y | at.x << 1);
}

// Place in the order of a choice: halves of the block, halves of these and so on are swapped, and in the quarters of each
// size either the columns, the rows or the diagonals share a half of the first number's interval.
uint sequence_place(uint place, uint own)
{
    place = scramble_reversed(place, own);
    uint upper = place & 0x15u, lower = place >> 1 & 0x15u;
    uint once = own >> 8 & ~(own >> 9) & 0x15u, twice = own >> 9 & ~(own >> 8) & 0x15u; // times a root of unity of GF(4)
    uint mixed = upper ^ lower, same = ~(once | twice);
    return upper & same | mixed & once | lower & twice | (lower & same | upper & once | mixed & twice) << 1;
}

// Sum of the columns for a place: the digits that it adds.
uint sequence_column(uint place)
{
    uint sum = (place >> 5 & 1u) * SEQUENCE_COLUMN_0 ^ (place >> 4 & 1u) * SEQUENCE_COLUMN_1;
    sum ^= (place >> 3 & 1u) * SEQUENCE_COLUMN_2 ^ (place >> 2 & 1u) * SEQUENCE_COLUMN_3;
    return sum ^ (place >> 1 & 1u) * SEQUENCE_COLUMN_4 ^ (place & 1u) * SEQUENCE_COLUMN_5;
}

// Order of a pixel's samples: the halves of each aligned 2^k are swapped, except for the first.
uint sequence_shuffled(uint index, uint seed)
{
    uint v = bitfieldReverse(index);
    v ^= v * 0x3d20adeau;
    v *= seed | 1u;
    v ^= v * 0x05526c56u;
    v *= seed >> 16 | 1u;
    v ^= v * 0x53a22864u;
    return bitfieldReverse(v);
}

// Seeds of a choice: the scrambling of the block; the digits that the pixel adds, the last of which are its own; and the
// seed of its order.
struct sequence_choice
{
    uint own, column, order;
};

sequence_choice sequence_choose(uvec2 pixel_seed, uint dimension)
{
    uint own = hash_u32(pixel_seed.x + dimension * 0x9e3779b9u), place = sequence_place(pixel_seed.y, own);
    return sequence_choice(own, sequence_column(place), hash_u32(own + place + 1u));
}

// Number in [0, 1) of sample `index` of the pixel, in a dimension that has one number.
float sequence_number(uvec2 pixel_seed, uint dimension, uint index)
{
    sequence_choice c = sequence_choose(pixel_seed, dimension);
    uint digits = sequence_shuffled(index, c.order) ^ c.column & SEQUENCE_DIGITS ^ c.order & ~SEQUENCE_DIGITS;
    return unit_from_bits(bitfieldReverse(scramble_reversed(digits, hash_u32(c.own))));
}

// Both numbers of a place in the sequence.
vec2 sequence_pair_at(uint index, sequence_choice c)
{
    uint first = hash_u32(c.own), second = hash_u32(first), last_digits = c.order & ~SEQUENCE_DIGITS;
    uint x = index ^ c.column & SEQUENCE_DIGITS ^ last_digits;
    uint y = sobol_second_reversed(index) ^ c.column >> 16 ^ last_digits;
    return vec2(unit_from_bits(bitfieldReverse(scramble_reversed(x, first))),
                unit_from_bits(bitfieldReverse(scramble_reversed(y, second))));
}

// Numbers in [0, 1) of sample `index`, in a dimension that has two.
vec2 sequence_pair(uvec2 pixel_seed, uint dimension, uint index)
{
    sequence_choice c = sequence_choose(pixel_seed, dimension);
    return sequence_pair_at(sequence_shuffled(index, c.order), c);
}

// Numbers of sequence_pair(), with the samples of each group of 2^group_shift in an order in which neighbours have first
// numbers close together, with random swaps of the interval's halves, quarters and so on: their choices are alike, and
// neighbouring rays have similar directions. Only one choice of a wave may use it, as two such orders would be
// correlated.
vec2 sequence_pair_sorted(uvec2 pixel_seed, uint dimension, uint index, uint group_shift)
{
    sequence_choice c = sequence_choose(pixel_seed, dimension);
    uint mask = (1u << group_shift) - 1u, group = sequence_shuffled(index, c.order) & ~mask;
    uint in_group = group_shift > 0u ? bitfieldReverse(index & mask) >> 32u - group_shift : 0u;
    return sequence_pair_at(group | in_group, c);
}
