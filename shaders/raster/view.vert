// SPDX-License-Identifier: MIT
// Vertices of an instance's primitives, fetched from the scene's texel buffers by vertex number; there are no vertex
// attributes. PRIMITIVE_KIND: 0 triangles, 1 spheres as their bounding boxes, 2 discs as squares.

#include "common/camera.glsl"
#include "common/geometry.glsl"
#include "common/math.glsl"

uniform uint instance_index;
uniform uint first_primitive; // first primitive of this draw, scene-wide
uniform uint layer;           // index of the current sample that is drawn

#if PRIMITIVE_KIND == 1
// Corners of a cube by bit (x 1, y 2, z 4), two triangles per side, counter-clockwise from outside.
const uint BOX_CORNERS[36] = uint[36](0u, 4u, 6u, 0u, 6u, 2u, 1u, 3u, 7u, 1u, 7u, 5u, 0u, 1u, 5u, 0u, 5u, 4u,
                                      2u, 6u, 7u, 2u, 7u, 3u, 0u, 2u, 3u, 0u, 3u, 1u, 4u, 5u, 7u, 4u, 7u, 6u);
// Margin of a sphere's box, so that rounding does not cut the rim.
const float BOX_MARGIN = 1.0001;
#endif

invariant gl_Position; // several programs draw surfaces that coincide

void main()
{
#if PRIMITIVE_KIND == 0
    uvec4 triangle = texelFetch(triangles, int(first_primitive) + gl_VertexID / 3);
    vec3 object = texelFetch(positions, int(triangle[gl_VertexID % 3])).xyz;
    vec3 world = affine_point(instance_at(instance_index).world_from_object, object);
#elif PRIMITIVE_KIND == 1
    vec4 sphere = texelFetch(spheres, int(first_primitive) + gl_VertexID / 36);
    uint corner = BOX_CORNERS[gl_VertexID % 36];
    vec3 outward = vec3(corner & 1u, corner >> 1 & 1u, corner >> 2 & 1u) * 2.0 - 1.0;
    vec3 object = sphere.xyz + outward * (sphere.w * BOX_MARGIN);
    vec3 world = affine_point(instance_at(instance_index).world_from_object, object);
#else
    disc d = disc_at(first_primitive + uint(gl_VertexID) / 6u);
    uint corner = uint[6](0u, 1u, 2u, 2u, 1u, 3u)[gl_VertexID % 6];
    vec3 tangent, bitangent;
    tangent_frame(d.normal.xyz, tangent, bitangent);
    vec2 place = vec2(corner & 1u, corner >> 1) * 2.0 - 1.0;
    vec3 world = d.centre_radius.xyz + d.centre_radius.w * (place.x * tangent + place.y * bitangent);
#endif
    gl_Position = clip_from_world_point(world, sample_place(layer));
}
