// SPDX-License-Identifier: MIT
// Deforms the vertices of one mesh: morph targets, then joints, by the rules of glTF 2.0 (sections 3.7.2.2 and 3.7.3).
// One invocation per vertex reads the mesh at rest and writes the scene's vertices in place. The host's twin is
// scene_deform() of server/scene/deform.c.
//
// The host (gpu_scene/deform.c) sets the defines:
//   HAS_NORMALS     the mesh has normals
//   HAS_TANGENTS    the mesh has tangents
#include "shared/bindings.h"
#include "common/affine.glsl"
#include "common/dispatch.glsl"
#include "common/math.glsl"
#include "common/unit.glsl"

// Attributes at rest, of all meshes one after the other.
layout(binding = UNIT_REST_POSITIONS) uniform samplerBuffer rest_positions;
layout(binding = UNIT_REST_NORMALS) uniform samplerBuffer rest_normals;
layout(binding = UNIT_REST_TANGENTS) uniform samplerBuffer rest_tangents; // handedness in w
layout(binding = UNIT_JOINTS) uniform usamplerBuffer joints;
layout(binding = UNIT_JOINT_WEIGHTS) uniform samplerBuffer joint_weights;
layout(binding = UNIT_TARGET_POSITIONS) uniform samplerBuffer target_positions;
layout(binding = UNIT_TARGET_NORMALS) uniform samplerBuffer target_normals;
layout(binding = UNIT_TARGET_TANGENTS) uniform samplerBuffer target_tangents;
// Joints: rows of world_from_mesh, three texels each. Active targets: weight, number.
layout(binding = UNIT_DEFORM_PARAMETERS) uniform samplerBuffer parameters;

layout(binding = IMAGE_POSITIONS, rgba32f) writeonly uniform imageBuffer positions_out;
layout(binding = IMAGE_NORMALS, rgba32f) writeonly uniform imageBuffer normals_out;
layout(binding = IMAGE_TANGENTS, r32ui) writeonly uniform uimageBuffer tangents_out;

uniform uint vertex_count;
uniform uint first_vertex; // at rest
uniform uint first_vertex_out;
uniform uint first_influence;
uniform uint influence_count; // per vertex; 0: no skin
uniform uint first_joint;     // texel of the parameters
uniform uint joint_count;
uniform uint first_target_vertex;
uniform uint first_morph; // texel of the parameters
uniform uint morph_count;
uniform uint target_arrays; // 1: positions, 2: normals, 4: tangents

const float FLOAT_MAX = 3.402823466e38;

// Replaces sums that overflow by 0: no tracer could bound them.
vec3 finite_or_zero(vec3 v)
{
    bvec3 fine = lessThanEqual(abs(v), vec3(FLOAT_MAX));
    return vec3(fine.x ? v.x : 0.0, fine.y ? v.y : 0.0, fine.z ? v.z : 0.0);
}

// Mean of the joints' matrices, weighted for the vertex. False: it has no weights, and stays unchanged.
bool blend(uint vertex, out vec4 rows[3])
{
    rows = vec4[3](vec4(0.0), vec4(0.0), vec4(0.0));
    float sum = 0.0;
    for (uint k = 0u; k < influence_count; k++) {
        int influence = int(first_influence + vertex * influence_count + k);
        float weight = texelFetch(joint_weights, influence).x;
        uint joint = texelFetch(joints, influence).x;
        if (weight == 0.0 || joint >= joint_count)
            continue;
        int texel = int(first_joint + 3u * joint);
        for (int row = 0; row < 3; row++)
            rows[row] += weight * texelFetch(parameters, texel + row);
        sum += weight;
    }
    for (int row = 0; row < 3; row++)
        rows[row] /= sum;
    return sum > 0.0;
}

// Normalises a vector; one without a direction stays unchanged. (The squares of small components would underflow.)
vec3 unit_or_same(vec3 v)
{
    float scale = max_component(abs(v));
    return scale > 0.0 && scale <= FLOAT_MAX ? normalize(v / scale) : v;
}

// Transforms a normal by the cofactors, which are the inverse transpose up to a factor; its sign keeps a mirrored normal
// outside.
vec3 moved_normal(vec4 rows[3], vec3 normal, float determinant)
{
    vec3 moved = vec3(dot(cross(rows[1].xyz, rows[2].xyz), normal), dot(cross(rows[2].xyz, rows[0].xyz), normal),
                      dot(cross(rows[0].xyz, rows[1].xyz), normal));
    float scale = max_component(abs(moved));
    if (!(scale > 0.0 && scale <= FLOAT_MAX))
        return normal;
    return determinant < 0.0 ? -unit_or_same(moved) : unit_or_same(moved);
}

uint pack_unit_or_zero(vec3 v)
{
    float scale = max_component(abs(v));
    return scale > 0.0 && scale <= FLOAT_MAX ? pack_unit(v / scale) : 0u;
}

void main()
{
    uint vertex = item_index();
    if (vertex >= vertex_count)
        return;
    int at = int(first_vertex + vertex), out_at = int(first_vertex_out + vertex);
    vec3 position = texelFetch(rest_positions, at).xyz;
#ifdef HAS_NORMALS
    vec3 normal = texelFetch(rest_normals, at).xyz;
#endif
#ifdef HAS_TANGENTS
    vec4 tangent = texelFetch(rest_tangents, at);
#endif
    for (uint k = 0u; k < morph_count; k++) {
        vec2 weight_target = texelFetch(parameters, int(first_morph + k)).xy;
        int target = int(first_target_vertex + uint(weight_target.y) * vertex_count + vertex);
        if ((target_arrays & 1u) != 0u)
            position += weight_target.x * texelFetch(target_positions, target).xyz;
#ifdef HAS_NORMALS
        if ((target_arrays & 2u) != 0u)
            normal += weight_target.x * texelFetch(target_normals, target).xyz;
#endif
#ifdef HAS_TANGENTS
        if ((target_arrays & 4u) != 0u)
            tangent.xyz += weight_target.x * texelFetch(target_tangents, target).xyz;
#endif
    }
#ifdef HAS_NORMALS
    normal = unit_or_same(normal);
#endif
    float handedness = 0.0;
#ifdef HAS_TANGENTS
    handedness = tangent.w < 0.0 ? -1.0 : 1.0;
#endif
    vec4 rows[3];
    if (blend(vertex, rows)) {
        position = affine_point(rows, position);
        float determinant = dot(rows[0].xyz, cross(rows[1].xyz, rows[2].xyz));
#ifdef HAS_NORMALS
        normal = moved_normal(rows, normal, determinant);
#endif
#ifdef HAS_TANGENTS
        tangent.xyz = affine_vector(rows, tangent.xyz);
        handedness = determinant < 0.0 ? -handedness : handedness;
#endif
    }
    imageStore(positions_out, out_at, vec4(finite_or_zero(position), 0.0));
#ifdef HAS_NORMALS
    imageStore(normals_out, out_at, vec4(finite_or_zero(normal), handedness));
#endif
#ifdef HAS_TANGENTS
    imageStore(tangents_out, out_at, uvec4(pack_unit_or_zero(tangent.xyz)));
#endif
}
