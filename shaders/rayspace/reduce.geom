// SPDX-License-Identifier: MIT
// Stream reduction by a geometry shader (section 4.2): only slots that are not empty are emitted, each to the buffer of
// its list.
#include "rayspace/reduce.h"

layout(points) in;
layout(points, max_vertices = 1) out;

layout(location = 0) flat in uvec4 slot[];

layout(stream = 0, xfb_buffer = 0, xfb_stride = 16, xfb_offset = 0, location = 0) flat out uvec4 pair;
layout(stream = 1, xfb_buffer = 1, xfb_stride = 16, xfb_offset = 0, location = 1) flat out uvec4 leaf;
layout(stream = 2, xfb_buffer = 2, xfb_stride = 16, xfb_offset = 0, location = 2) flat out uvec4 far;

void main()
{
    uint last = slot[0].w;
    if (last == RAYSPACE_SLOT_LEAF) {
        leaf = slot[0];
        EmitStreamVertex(1);
    } else if (last == RAYSPACE_SLOT_EMPTY) {
        return;
    } else if ((last & RAYSPACE_AGAIN) != 0u) {
        far = slot[0];
        EmitStreamVertex(2);
    } else {
        pair = slot[0];
        EmitStreamVertex(0);
    }
}
