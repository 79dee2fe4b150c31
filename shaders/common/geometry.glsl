// SPDX-License-Identifier: MIT
// Geometry of the scene on the device, bound by gpu_scene_bind(). Layouts: shared/geometry.h. NO_COLOURS: see
// common/attributes.glsl.
#include "shared/bindings.h"
#include "shared/geometry.h"
#include "common/affine.glsl"
#include "common/tables.glsl"

layout(binding = UNIT_TRIANGLES) uniform usamplerBuffer triangles;       // i0 i1 i2 material
layout(binding = UNIT_POSITIONS) uniform samplerBuffer positions;        // xyz, object space
layout(binding = UNIT_TEXCOORDS) uniform samplerBuffer texcoords;        // u0 v0 u1 v1
#ifndef NO_COLOURS
layout(binding = UNIT_COLOURS) uniform samplerBuffer colours;            // rgba, linear
#endif
layout(binding = UNIT_SPHERES) uniform samplerBuffer spheres;            // centre, radius
layout(binding = UNIT_SPHERE_MATERIALS) uniform usamplerBuffer sphere_materials;

layout(binding = UNIT_INSTANCES) uniform usamplerBuffer instances;       // struct instance

instance instance_at(uint index)
{
    int texel = int(index) * INSTANCE_TEXELS;
    instance i;
    for (int row = 0; row < 3; row++) {
        i.world_from_object[row] = uintBitsToFloat(texelFetch(instances, texel + row));
        i.object_from_world[row] = uintBitsToFloat(texelFetch(instances, texel + 3 + row));
    }
    uvec4 last = texelFetch(instances, texel + 6);
    i.geometry = last.x;
    i.node = last.y;
    i.flags = last.z;
    i.motion = last.w;
    return i;
}
