// SPDX-License-Identifier: MIT
// The scene's geometry on the device: what scene_gpu_bind() binds. Layouts: shared/geometry.h.
#include "shared/bindings.h"
#include "shared/geometry.h"

layout(binding = UNIT_TRIANGLES) uniform usamplerBuffer triangles;       // i0 i1 i2 material
layout(binding = UNIT_POSITIONS) uniform samplerBuffer positions;        // xyz, object space
layout(binding = UNIT_NORMALS) uniform samplerBuffer normals;            // xyz, handedness
layout(binding = UNIT_TANGENTS) uniform usamplerBuffer tangents;         // octahedral
layout(binding = UNIT_TEXCOORDS) uniform samplerBuffer texcoords;        // u0 v0 u1 v1
layout(binding = UNIT_COLOURS) uniform samplerBuffer colours;            // rgba, linear
layout(binding = UNIT_SPHERES) uniform samplerBuffer spheres;            // centre, radius
layout(binding = UNIT_SPHERE_MATERIALS) uniform usamplerBuffer sphere_materials;

layout(std430, binding = BIND_INSTANCES) readonly buffer instance_block { instance instances[]; };
layout(std430, binding = BIND_GEOMETRIES) readonly buffer geometry_block { geometry geometries[]; };
layout(std430, binding = BIND_DISCS) readonly buffer disc_block { disc discs[]; };
