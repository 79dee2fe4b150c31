// SPDX-License-Identifier: MIT
// The lists of the wave in hand: how many rays, hits and blocks of them there are.
#include "shared/wave.h"

layout(std140, binding = UNIFORM_WAVE) uniform wave_block { wave_state wave; };
