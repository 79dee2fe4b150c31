// SPDX-License-Identifier: MIT
// Positions at a time: 0 when the shutter opens, 1 when it closes.
//
// Defines: HAS_MOTION something moves meanwhile; without it all positions are those at which the shutter opens, whatever
// the time.
#include "common/geometry.glsl"
#include "common/math.glsl"

#ifdef HAS_MOTION

layout(binding = UNIT_MOTIONS) uniform samplerBuffer motions; // three texels per pose

// Interpolates each entry between the two poses around the time; poses are evenly spaced.
void world_from_object_at(uint first_texel, uint pose_count, float time, out vec4 rows[3])
{
    float place = clamp(time, 0.0, 1.0) * float(pose_count - 1u);
    float before = min(floor(place), float(pose_count - 2u));
    int texel = int(first_texel) + 3 * int(before);
    for (int row = 0; row < 3; row++)
        rows[row] = mix(texelFetch(motions, texel + row), texelFetch(motions, texel + 3 + row), place - before);
}

// Inverts an affine transform, and returns its determinant's sign. Entries are divided by the largest one first, so that
// products of very small or large ones stay finite. The inverse of a singular one is NaN, and no ray hits anything.
float invert(vec4 m[3], out vec4 inverse[3])
{
    float max_entry = max_component(max(abs(m[0].xyz), max(abs(m[1].xyz), abs(m[2].xyz))));
    float scale = 1.0 / max_entry;
    vec3 r0 = m[0].xyz * scale, r1 = m[1].xyz * scale, r2 = m[2].xyz * scale;
    vec3 c0 = cross(r1, r2), c1 = cross(r2, r0), c2 = cross(r0, r1); // columns of the inverse
    float determinant = dot(r0, c0);
    float factor = scale / determinant;
    vec3 move = vec3(m[0].w, m[1].w, m[2].w);
    for (int row = 0; row < 3; row++) {
        vec3 entries = vec3(c0[row], c1[row], c2[row]) * factor;
        inverse[row] = vec4(entries, -dot(entries, move));
    }
    return determinant;
}

#endif

instance instance_at_time(uint index, float time)
{
    instance i = instance_at(index);
#ifdef HAS_MOTION
    if (i.motion != 0u) {
        world_from_object_at(i.motion - 1u, i.flags >> INSTANCE_POSES_SHIFT & INSTANCE_POSES_MASK, time,
                             i.world_from_object);
        float determinant = invert(i.world_from_object, i.object_from_world);
        i.flags = determinant < 0.0 ? i.flags | INSTANCE_MIRRORED : i.flags & ~INSTANCE_MIRRORED;
    }
#endif
    return i;
}

uint close_offset_of(uint geometry_index)
{
#ifdef HAS_MOTION
    return geometry_at(geometry_index).close_offset;
#else
    return 0u;
#endif
}

// A vertex at a time. The vertices of its geometry at shutter close lie `close_offset` behind those at shutter open.
vec3 position_at_time(uint vertex, uint close_offset, float time)
{
    vec3 position = texelFetch(positions, int(vertex)).xyz;
#ifdef HAS_MOTION
    if (close_offset != 0u)
        position = mix(position, texelFetch(positions, int(vertex + close_offset)).xyz, time);
#endif
    return position;
}
