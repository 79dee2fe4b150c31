// SPDX-License-Identifier: MIT
// The rays of a wave that a dispatch is for: first_ray .. ray_end - 1.
#include "shared/bindings.h"
#include "shared/wave.h"

uniform uint first_ray;
uniform uint ray_count;    // where the range ends, unless the wave does before
uniform uint counts_place; // 0, or 1 + the index of the wave, where only the device knows how many rays it has
layout(std430, binding = BIND_WAVE) readonly buffer wave_counts_block { wave_counts counts_of_waves[]; };
uint ray_end = counts_place == 0u ? ray_count : min(ray_count, counts_of_waves[counts_place - 1u].count);
