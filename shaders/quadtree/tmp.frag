// SPDX-License-Identifier: MIT
#include "quadtree/layout.h"
uniform uint instance_index, first_primitive, layer;
layout(binding = UNIT_QUADTREE_DEPTH) uniform sampler2D before;
layout(location = 0) out uvec2 visible;
void main()
{
    if (layer > 0u && gl_FragCoord.z >= texelFetch(before, ivec2(gl_FragCoord.xy), 0).x)
        discard;
    visible = uvec2(instance_index + 1u, first_primitive + uint(gl_PrimitiveID));
}
