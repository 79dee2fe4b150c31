// SPDX-License-Identifier: MIT
// Sends a triangle to the image whose axis its normal leans to most (paper, figure 5), or to those where images overlap,
// with its plane in cells; a sphere to all three, as the square round it. PRIMITIVE_KIND as in build.vert; HAS_CUTOUT:
// triangles may have holes.

#include "ldc/image.glsl"

uniform float resolution; // cells along a side of the cube

#if PRIMITIVE_KIND == 0
layout(triangles) in;
layout(triangle_strip, max_vertices = 9) out;
#else
layout(points) in;
layout(triangle_strip, max_vertices = 12) out;
#endif

layout(location = 0) in vec3 place_cells[];
layout(location = 1) flat in uvec3 primitive_in[];

#if PRIMITIVE_KIND == 0
layout(location = 0) flat out vec4 plane;  // slopes of the depth along u and v; u, v of a point of it
layout(location = 1) flat out vec3 depths; // of that point; least, greatest
#ifdef HAS_CUTOUT
layout(location = 3) out vec2 barycentrics;
#endif
#else
layout(location = 2) in vec3 reach_cells[];
#endif
layout(location = 2) flat out uvec3 primitive;

// What lies on the sides of the cube stays in it, to rounding.
float clip_depth(float depth_cells)
{
    return 0.0005 + 0.999 * depth_cells / resolution;
}

void emit(vec2 uv_cells, float depth_cells, int axis)
{
    gl_Position = vec4(2.0 * uv_cells / resolution - 1.0, clip_depth(depth_cells), 1.0);
    gl_Layer = axis;
    EmitVertex();
}

#if PRIMITIVE_KIND == 0
void main()
{
    vec3 normal = cross(place_cells[1] - place_cells[0], place_cells[2] - place_cells[0]);
    vec3 lean = abs(normal);
    if (!(max(lean.x, max(lean.y, lean.z)) > 0.0)) // no area
        return;
    for (int axis = 0; axis < 3; axis++) {
        if (!is_in_image(lean, axis))
            continue;
        int u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
        vec3 along = vec3(place_cells[0][axis], place_cells[1][axis], place_cells[2][axis]);
        vec4 plane_ = vec4(-normal[u] / normal[axis], -normal[v] / normal[axis], place_cells[0][u], place_cells[0][v]);
        vec3 depths_ = vec3(along.x, min(along.x, min(along.y, along.z)), max(along.x, max(along.y, along.z)));
        for (int i = 0; i < 3; i++) {
            plane = plane_;
            depths = depths_;
            primitive = primitive_in[0];
#ifdef HAS_CUTOUT
            barycentrics = vec2(i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0);
#endif
            emit(vec2(place_cells[i][u], place_cells[i][v]), along[i], axis);
        }
        EndPrimitive();
    }
}
#else
// The square is a little larger than the sphere, so that rounding does not cut the sphere's rim. Its depth is of no
// account, only that it is in the cube.
const float SQUARE_MARGIN = 1.0001;

void main()
{
    for (int axis = 0; axis < 3; axis++) {
        int u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
        vec2 middle = vec2(place_cells[0][u], place_cells[0][v]);
        vec2 reach = vec2(reach_cells[0][u], reach_cells[0][v]) * SQUARE_MARGIN;
        for (int corner = 0; corner < 4; corner++) {
            primitive = primitive_in[0];
            emit(middle + reach * vec2(float(corner & 1) * 2.0 - 1.0, float(corner >> 1) * 2.0 - 1.0),
                 0.5 * resolution, axis);
        }
        EndPrimitive();
    }
}
#endif
