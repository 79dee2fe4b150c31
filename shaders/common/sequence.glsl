// SPDX-License-Identifier: MIT
// The random numbers of a sample: Owen-scrambled Sobol points. server/render/sequence.c is the same for the host.
//
// Each choice (a dimension: SEQUENCE_* of shared/frame.h) has one or two numbers of a sequence of its own for each
// pixel and seed, so that choices do not follow each other and pixels do not resemble each other. The numbers of the
// samples 0 .. 2^k - 1, and of any aligned 2^k after them, are stratified as those of a (0, 2)-sequence are: one in
// each of 2^k intervals, and as pairs one in each 2^a x 2^(k-a) cell; so the error of a mean of n of them falls as fast
// as n^-1.5 where what they choose is smooth.
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

// The second Sobol dimension of a point, bits reversed: Pascal's triangle modulo 2 times the bits of its index, whose
// factors Lucas' theorem gives. The first dimension is the index itself.
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

// The seed of a pixel, or of anything else with its own numbers, for the functions below.
uint sequence_seed(uint number, uint seed)
{
    return hash_u32(number + hash_u32(seed));
}

// In [0, 1): sample `index` of the pixel in a dimension that has one number.
float sequence_number(uint pixel_seed, uint dimension, uint index)
{
    uint own = hash_u32(pixel_seed + dimension * 0x9e3779b9u);
    uint place = bitfieldReverse(scramble_reversed(bitfieldReverse(index), own));
    return unit_from_bits(bitfieldReverse(scramble_reversed(place, hash_u32(own))));
}

// The two numbers of a place in the sequence.
vec2 sequence_pair_at(uint place, uint own)
{
    uint first = hash_u32(own), second = hash_u32(first);
    return vec2(unit_from_bits(bitfieldReverse(scramble_reversed(place, first))),
                unit_from_bits(bitfieldReverse(scramble_reversed(sobol_second_reversed(place), second))));
}

// Likewise where it has two.
vec2 sequence_pair(uint pixel_seed, uint dimension, uint index)
{
    uint own = hash_u32(pixel_seed + dimension * 0x9e3779b9u);
    return sequence_pair_at(bitfieldReverse(scramble_reversed(bitfieldReverse(index), own)), own);
}

// Likewise, with the samples of each group of 2^group_shift in an order in which neighbours have first numbers close
// together, up to the halves, quarters and so on of the interval being swapped: what they choose is alike, and rays
// side by side go the same way. Not for more than one choice of a wave, as two such orders would be correlated.
vec2 sequence_pair_sorted(uint pixel_seed, uint dimension, uint index, uint group_shift)
{
    uint own = hash_u32(pixel_seed + dimension * 0x9e3779b9u), mask = (1u << group_shift) - 1u;
    uint group = bitfieldReverse(scramble_reversed(bitfieldReverse(index), own)) & ~mask;
    uint in_group = group_shift > 0u ? bitfieldReverse(index & mask) >> 32u - group_shift : 0u;
    return sequence_pair_at(group | in_group, own);
}
