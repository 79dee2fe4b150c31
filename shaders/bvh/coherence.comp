// SPDX-License-Identifier: MIT
// The coherence of a wave: in a sample of groups of consecutive rays, the number of live rays and of the packets that
// would be best for them: as bvh/traverse.glsl forms them, but none of rays so far apart that each meets leaves of its
// own. One invocation per group.
//
// Defines: PACKET_RAYS, the rays of a group.
#include "shared/bindings.h"
#include "common/dispatch.glsl"
#include "bvh/packet.glsl"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // two texels each
layout(std430, binding = BIND_TRACER_0) buffer count_block { uint alive_count, packet_count; };

uniform uint group_count;
uniform uint group_stride;    // rays from one group to the next
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
    int first = int(item_index() * group_stride);
    vec3 origins[PACKET_RAYS], directions[PACKET_RAYS];
    uint waiting = 0u, packets = 0u;
    for (int k = 0; k < PACKET_RAYS; k++) {
        vec4 origin_t_min = texelFetch(rays, 2 * (first + k)), direction_t_max = texelFetch(rays, 2 * (first + k) + 1);
        origins[k] = origin_t_min.xyz;
        directions[k] = direction_t_max.xyz;
        waiting |= direction_t_max.w > origin_t_min.w ? 1u << k : 0u;
    }
    atomicAdd(alive_count, uint(bitCount(waiting)));
    for (; waiting != 0u; packets++) {
        int leading = findLSB(waiting);
        for (int k = 0; k < PACKET_RAYS; k++)
            if (k == leading ||
                (form_packet(origins[leading], directions[leading], origins[k], directions[k]) &&
                 stay_close(origins[leading], directions[leading], origins[k], directions[k])))
                waiting &= ~(1u << k);
    }
    atomicAdd(packet_count, packets);
}
