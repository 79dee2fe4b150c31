// SPDX-License-Identifier: MIT
// Vertices of instances drawn into images along the axes, one per primitive: its number. The geometry shader fetches the
// rest, once. The only attribute advances with the instance.

layout(location = 0) in uvec4 drawn; // raster/layout.h

layout(location = 0) flat out uvec4 primitive; // id, instance, scene-wide number, DRAWN_*

void main()
{
    primitive = uvec4(uint(gl_VertexID) + drawn.y, drawn.z, uint(gl_VertexID), drawn.w);
}
