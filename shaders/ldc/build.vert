// SPDX-License-Identifier: MIT
// Primitives of instances on their way into a layered depth cube, pulled from the scene's texel buffers by the number
// of the vertex. PRIMITIVE_KIND: 0 triangles; 1 spheres, as a point each. The one attribute advances with the instance.

#include "common/geometry.glsl"
#include "common/math.glsl"

uniform vec3 lower_world; // of the cube
uniform float cell_world;

layout(location = 0) in uvec3 drawn; // shared/ldc_build.h

layout(location = 0) out vec3 place_cells;
layout(location = 1) flat out uvec3 primitive; // id, instance, scene-wide number
#if PRIMITIVE_KIND == 1
layout(location = 2) out vec3 reach_cells; // half the sides of the box round the sphere
#endif

void main()
{
    uint instance_index = drawn.z;
    int first_row = int(instance_index) * INSTANCE_TEXELS;
    vec4 world_from_object[3];
    for (int row = 0; row < 3; row++)
        world_from_object[row] = uintBitsToFloat(texelFetch(instances, first_row + row));
#if PRIMITIVE_KIND == 0
    int number = gl_VertexID / 3;
    uvec4 triangle = texelFetch(triangles, number);
    vec3 object = texelFetch(positions, int(triangle[gl_VertexID - 3 * number])).xyz;
#else
    int number = gl_VertexID;
    vec4 sphere = texelFetch(spheres, number);
    vec3 object = sphere.xyz;
    reach_cells = sphere.w / cell_world *
                  vec3(length(world_from_object[0].xyz), length(world_from_object[1].xyz),
                       length(world_from_object[2].xyz));
#endif
    primitive = uvec3(uint(number) + drawn.y, instance_index, uint(number));
    place_cells = (affine_point(world_from_object, object) - lower_world) / cell_world;
}
