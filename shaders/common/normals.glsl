// SPDX-License-Identifier: MIT
// Apart, as few stages read them, and a stage has few samplers. Stored samples (HAS_SAMPLED) have theirs already.
#include "shared/bindings.h"

#ifndef HAS_SAMPLED
layout(binding = UNIT_NORMALS) uniform samplerBuffer normals; // xyz, handedness
#endif
