// SPDX-License-Identifier: MIT
// Range of a wave's rays in a dispatch: first_ray .. ray_end - 1.
// Defines: HAS_COUNTS only the device knows how many rays the wave has.
#include "shared/bindings.h"
#include "shared/wave.h"

uniform uint first_ray;
uniform uint ray_count; // end of the range, unless the wave ends before
#ifdef HAS_COUNTS
uniform uint counts_index; // index of the wave's counts
layout(std430, binding = BIND_WAVE) readonly buffer wave_counts_block { wave_counts counts_of_waves[]; };
uint ray_end = min(ray_count, counts_of_waves[counts_index].count);
#else
#define ray_end ray_count
#endif
