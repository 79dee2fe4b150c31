// SPDX-License-Identifier: MIT
// The rays of a wave that a dispatch is for: first_ray .. ray_end - 1.
// Defines: HAS_COUNTS only the device knows how many rays the wave has.
#include "shared/bindings.h"
#include "shared/wave.h"

uniform uint first_ray;
uniform uint ray_count; // where the range ends, unless the wave does before
#ifdef HAS_COUNTS
uniform uint counts_index; // of the wave
layout(std430, binding = BIND_WAVE) readonly buffer wave_counts_block { wave_counts counts_of_waves[]; };
uint ray_end = min(ray_count, counts_of_waves[counts_index].count);
#else
#define ray_end ray_count
#endif
