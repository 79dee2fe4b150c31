// SPDX-License-Identifier: MIT
// Seeded numbers: a hash gives each pixel and dimension its shift, a lattice spreads the samples.

// PCG in the form of Jarzynski and Olano. Hash Functions for GPU Rendering. 2020.
uint hash_u32(uint v)
{
    uint state = v * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}

uint hash_u32(uint a, uint b, uint c)
{
    return hash_u32(a + hash_u32(b + hash_u32(c)));
}

// Two numbers in [0, 1) for sample `index` of a pixel. The R2 lattice (Roberts. The unreasonable effectiveness
// of quasirandom sequences. 2018) in 32-bit fixed point, shifted by the hash (Cranley and Patterson 1976).
vec2 random_pair(uint pixel, uint dimension, uint seed, uint index)
{
    uint x = hash_u32(pixel, dimension, seed), y = hash_u32(x);
    x += index * 3242174889u; // 2^32 / 1.32471795724
    y += index * 2447445413u; // 2^32 / 1.32471795724^2
    return vec2(x >> 8, y >> 8) * (1.0 / 16777216.0);
}
