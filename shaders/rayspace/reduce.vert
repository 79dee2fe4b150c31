// SPDX-License-Identifier: MIT
// A slot as a point, for rayspace/reduce.geom.
#include "rayspace/reduce.h"
#include "shared/bindings.h"

layout(binding = UNIT_RAYSPACE_SLOTS) uniform usamplerBuffer slots;

layout(location = 0) flat out uvec4 slot;

void main()
{
    slot = texelFetch(slots, gl_VertexID);
}
