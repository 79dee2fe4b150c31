// SPDX-License-Identifier: MIT
// Primitives of instances on their way into a layered depth cube, a vertex each: which one it is. The geometry shader
// fetches the rest, once. The one attribute advances with the instance.

layout(location = 0) in uvec3 drawn; // shared/ldc_build.h

layout(location = 0) flat out uvec3 primitive; // id, instance, scene-wide number

void main()
{
    primitive = uvec3(uint(gl_VertexID) + drawn.y, drawn.z, uint(gl_VertexID));
}
