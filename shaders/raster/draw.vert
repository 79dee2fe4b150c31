// SPDX-License-Identifier: MIT
// Primitives of instances that are drawn into images along the axes, one vertex each: the primitive's number. The
// geometry shader fetches the rest, once. The one attribute advances with the instance.

layout(location = 0) in uvec4 drawn; // raster/layout.h

layout(location = 0) flat out uvec4 primitive; // id, instance, scene-wide number, DRAWN_*

void main()
{
    primitive = uvec4(uint(gl_VertexID) + drawn.y, drawn.z, uint(gl_VertexID), drawn.w);
}
