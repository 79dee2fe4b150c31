// SPDX-License-Identifier: MIT
// Lists of the current wave: its numbers of rays, hits and blocks. Only passes that read them include this file: Mesa's
// zink (22.3) confuses uniform blocks where a program declares one that it does not read.
#include "shared/wave.h"

layout(std140, binding = UNIFORM_WAVE) uniform wave_block { wave_state wave_in_block; };
#ifdef UNIFORMS_AT_START // server/gpu/uniforms.h
wave_state wave_at_start()
{
    wave_state w = wave_in_block;
    w.rays.count = at_start(wave_in_block.rays.count);
    w.hits.count = at_start(wave_in_block.hits.count);
    return w;
}
wave_state wave = wave_at_start();
#else
#define wave wave_in_block
#endif
