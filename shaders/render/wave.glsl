// SPDX-License-Identifier: MIT
// The lists of the wave in hand: how many rays, hits and blocks of them there are. Only a pass that reads them includes
// it: Mesa's zink (22.3) takes one uniform block for another where a program declares one that it does not read.
#include "shared/wave.h"

layout(std140, binding = UNIFORM_WAVE) uniform wave_block { wave_state wave; };
