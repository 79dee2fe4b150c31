// SPDX-License-Identifier: MIT
// Primitives of instances on their way into images along the axes, a vertex each: which one it is. The geometry shader
// fetches the rest, once. The one attribute advances with the instance.

layout(location = 0) in uvec4 drawn; // raster/layout.h

layout(location = 0) flat out uvec4 primitive; // id, instance, scene-wide number, DRAWN_*

void main()
{
    primitive = uvec4(uint(gl_VertexID) + drawn.y, drawn.z, uint(gl_VertexID), drawn.w);
}
