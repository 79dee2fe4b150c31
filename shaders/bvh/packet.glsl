// SPDX-License-Identifier: MIT
// Formation of packets: which rays are traversed together.

uint octant_of(vec3 direction)
{
    return (direction.x < 0.0 ? 1u : 0u) | (direction.y < 0.0 ? 2u : 0u) | (direction.z < 0.0 ? 4u : 0u);
}

uniform float bvh_packet_reach;             // maximum distance of origins; world space
const float PACKET_SQUARED_COSINE = 0.998;  // squared cosine of the maximum angle between two rays: 2.6 degrees

// Whether two rays have similar directions; otherwise their interval would cull nothing.
bool form_packet(vec3 origin_a, vec3 direction_a, vec3 origin_b, vec3 direction_b)
{
#ifdef SHARED_ORIGIN
    vec3 apart = vec3(0.0);
#else
    vec3 apart = origin_b - origin_a;
#endif
    float cosine = dot(direction_a, direction_b);
    return octant_of(direction_a) == octant_of(direction_b) &&
           cosine * cosine >=
               PACKET_SQUARED_COSINE * dot(direction_a, direction_a) * dot(direction_b, direction_b) &&
           dot(apart, apart) <= bvh_packet_reach * bvh_packet_reach;
}
