// SPDX-License-Identifier: MIT
#include "common/geometry.glsl"
#include "common/math.glsl"
#include "quadtree/node.glsl"
uniform uint instance_index, first_primitive, face;
invariant gl_Position;
void main()
{
    uvec4 triangle = texelFetch(triangles, int(first_primitive) + gl_VertexID / 3);
    vec3 object = texelFetch(positions, int(triangle[gl_VertexID % 3])).xyz;
    vec3 world = affine_point(instance_at(instance_index).world_from_object, object) - quadtree.eye_world.xyz;
    vec3 v = vec3(dot(quadtree.face_from_world[face * 3u].xyz, world), dot(quadtree.face_from_world[face * 3u + 1u].xyz, world), dot(quadtree.face_from_world[face * 3u + 2u].xyz, world));
    vec2 s = 2.0 * quadtree.scale_centre.xy / vec2(quadtree.width, quadtree.height);
    gl_Position = vec4(v.xy * s, quadtree.depths.w, v.z);
}
