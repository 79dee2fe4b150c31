// SPDX-License-Identifier: MIT
// First step of the reduction by a geometry shader: each slot is to be drawn as a point. The arguments of
// glDrawArraysIndirect.
#define GROUP_SIZE 1
#include "rayspace/reduce.glsl"

layout(std430, binding = BIND_RAYSPACE_DRAW) writeonly buffer draw_block { uvec4 draw; };

void main()
{
    draw = uvec4(slot_count(), 1u, 0u, 0u);
}
