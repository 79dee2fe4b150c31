// SPDX-License-Identifier: MIT
// Vertex normals, in a file of their own, as few stages read them, and a stage has few samplers.
#include "shared/bindings.h"

layout(binding = UNIT_NORMALS) uniform samplerBuffer normals; // xyz, handedness
