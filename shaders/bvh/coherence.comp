// SPDX-License-Identifier: MIT
// The coherence of a wave: in a sample of groups of consecutive rays, the number of live rays and of the packets that
// would be best for them: as bvh/traverse.glsl forms them, but none of rays so far apart that each meets leaves of its
// own. One invocation per group.
#include "shared/bindings.h"
#include "common/dispatch.glsl"
#include "bvh/packet.glsl"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels each
layout(std430, binding = BIND_TRACER_0) buffer count_block { uint alive_count, packet_count; };

uniform uint group_count;
uniform uint group_stride; // rays from one group to the next
uniform uint group_rays;   // of a group; no constant, as a loop of eight within one of eight took 0.2 s to compile
uniform vec3 scene_centre;
uniform float packet_width; // maximum distance at the scene's centre; 0: any

// The distance of two rays at the distance of the scene's centre.
bool stay_close(vec3 origin_a, vec3 direction_a, vec3 origin_b, vec3 direction_b)
{
    float far = length(scene_centre - origin_a);
    float apart = distance(origin_a, origin_b) + far * distance(normalize(direction_a), normalize(direction_b));
    return packet_width == 0.0 || apart <= packet_width;
}

void main()
{
    if (item_index() >= group_count)
        return;
    int first = int(item_index() * group_stride), count = int(group_rays);
    uint waiting = 0u, packets = 0u;
    for (int k = 0; k < count; k++) {
        float t_min = texelFetch(rays, 2 * (first + k)).w, t_max = texelFetch(rays, 2 * (first + k) + 1).w;
        waiting |= t_max > t_min ? 1u << k : 0u;
    }
    atomicAdd(alive_count, uint(bitCount(waiting)));
    for (; waiting != 0u; packets++) {
        int leading = findLSB(waiting);
        vec3 origin = texelFetch(rays, 2 * (first + leading)).xyz;
        vec3 direction = texelFetch(rays, 2 * (first + leading) + 1).xyz;
        waiting &= ~(1u << leading);
        for (int k = leading + 1; k < count; k++) {
            vec3 other_origin = texelFetch(rays, 2 * (first + k)).xyz;
            vec3 other_direction = texelFetch(rays, 2 * (first + k) + 1).xyz;
            if (form_packet(origin, direction, other_origin, other_direction) &&
                stay_close(origin, direction, other_origin, other_direction))
                waiting &= ~(1u << k);
        }
    }
    atomicAdd(packet_count, packets);
}
