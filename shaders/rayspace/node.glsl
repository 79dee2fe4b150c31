// SPDX-License-Identifier: MIT
// Nodes of level 1 and above.
#include "rayspace/ray.glsl"

layout(binding = UNIT_RAYSPACE_NODES) uniform samplerBuffer nodes;

bundle bundle_of_node(uint node)
{
    int texel = int(node) * RAYSPACE_NODE_TEXELS;
    vec4 centre_radius = texelFetch(nodes, texel), axis_secant = texelFetch(nodes, texel + 1);
    vec4 lower_tan = texelFetch(nodes, texel + 2), upper_end = texelFetch(nodes, texel + 3);
    return bundle(centre_radius.xyz, centre_radius.w, axis_secant.xyz, axis_secant.w, lower_tan.w, lower_tan.xyz,
                  upper_end.xyz, texelFetch(nodes, texel + 4).xyz, texelFetch(nodes, texel + 5).xyz, upper_end.w);
}
