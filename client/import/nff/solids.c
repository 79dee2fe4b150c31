/* SPDX-License-Identifier: MIT */
/* Cones and platonic solids as triangles. */
#include "shapes.h"

#include <math.h>

#define PI 3.14159265358979323846

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
}

/* Two directions across the axis (of unit length). */
static void frame_of(const double axis[3], double u[3], double v[3])
{
    double other[3] = {0}, length;
    int minimum = 0;

    for (int c = 1; c < 3; c++)
        if (fabs(axis[c]) < fabs(axis[minimum]))
            minimum = c;
    other[minimum] = 1;
    cross(axis, other, u);
    length = sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    for (int c = 0; c < 3; c++)
        u[c] /= length;
    cross(axis, u, v);
}

bool shapes_add_cone(struct shapes *shapes, const float ends[8], const char *where)
{
    double axis[3], u[3], v[3], length = 0, slope;
    uint32_t first = (uint32_t)shapes->vertex_count;

    for (int c = 0; c < 3; c++) {
        axis[c] = (double)ends[4 + c] - (double)ends[c];
        length += axis[c] * axis[c];
    }
    length = sqrt(length);
    if (!(length > 0) || !isfinite(length)) {
        import_note(shapes->scene, PROTOCOL_SEVERITY_WARNING, where, "a cone without height is left out");
        return true;
    }
    if (!shapes_reserve(shapes, 2 * (SHAPES_CONE_SEGMENTS + 1), 2 * SHAPES_CONE_SEGMENTS))
        return false;
    for (int c = 0; c < 3; c++)
        axis[c] /= length;
    frame_of(axis, u, v);
    slope = ((double)ends[3] - (double)ends[7]) / length; /* normals lean towards the thin end */
    for (int i = 0; i <= SHAPES_CONE_SEGMENTS; i++) {
        double angle = 2 * PI * (i % SHAPES_CONE_SEGMENTS) / SHAPES_CONE_SEGMENTS;

        for (int end = 0; end < 2; end++) {
            struct shape_vertex vertex = {0};

            for (int c = 0; c < 3; c++) {
                double outwards = cos(angle) * u[c] + sin(angle) * v[c];

                vertex.position[c] = (float)((double)ends[end * 4 + c] + outwards * (double)ends[end * 4 + 3]);
                vertex.normal[c] = (float)(outwards + axis[c] * slope);
            }
            shapes_add_vertex(shapes, &vertex);
        }
    }
    for (uint32_t i = 0; i < SHAPES_CONE_SEGMENTS; i++) {
        uint32_t at = first + 2 * i;

        if (ends[3] > 0)
            shapes_add_triangle(shapes, at, at + 2, at + 1);
        if (ends[7] > 0)
            shapes_add_triangle(shapes, at + 1, at + 2, at + 3);
    }
    return true;
}

/* ---- solids ---- */

#define PHI 1.6180339887498949

static const double tetrahedron[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
static const double octahedron[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
static const double cube[8][3] = {{1, 1, 1},  {1, 1, -1},  {1, -1, 1},  {1, -1, -1},
                                  {-1, 1, 1}, {-1, 1, -1}, {-1, -1, 1}, {-1, -1, -1}};
static const double icosahedron[12][3] = {{1, 0, PHI}, {1, 0, -PHI}, {-1, 0, PHI}, {-1, 0, -PHI},
                                          {0, PHI, 1}, {0, -PHI, 1}, {0, PHI, -1}, {0, -PHI, -1},
                                          {PHI, 1, 0}, {-PHI, 1, 0}, {PHI, -1, 0}, {-PHI, -1, 0}};
static const double dodecahedron[20][3] = {
    {1, 1, 1},           {1, 1, -1},          {1, -1, 1},         {1, -1, -1},        {-1, 1, 1},
    {-1, 1, -1},         {-1, -1, 1},         {-1, -1, -1},       {0, 1 / PHI, PHI},  {0, 1 / PHI, -PHI},
    {0, -1 / PHI, PHI},  {0, -1 / PHI, -PHI}, {1 / PHI, PHI, 0},  {1 / PHI, -PHI, 0}, {-1 / PHI, PHI, 0},
    {-1 / PHI, -PHI, 0}, {PHI, 0, 1 / PHI},   {-PHI, 0, 1 / PHI}, {PHI, 0, -1 / PHI}, {-PHI, 0, -1 / PHI}};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The face whose normal points along the corner of the dual solid: the vertices farthest that way, in order around
 * it. Returns how many there are. */
static uint32_t solid_face(const double (*vertices)[3], int vertex_count, const double along[3], int face[5])
{
    double farthest = -1e9, u[3], v[3], axis[3], length = sqrt(dot(along, along));
    uint32_t count = 0;

    for (int c = 0; c < 3; c++)
        axis[c] = along[c] / length;
    frame_of(axis, u, v);
    for (int i = 0; i < vertex_count; i++)
        farthest = fmax(farthest, dot(vertices[i], axis));
    for (int i = 0; i < vertex_count && count < 5; i++) {
        uint32_t at = count;
        double angle = atan2(dot(vertices[i], v), dot(vertices[i], u));

        if (dot(vertices[i], axis) < farthest - 1e-6)
            continue;
        for (; at > 0 && atan2(dot(vertices[face[at - 1]], v), dot(vertices[face[at - 1]], u)) > angle; at--)
            face[at] = face[at - 1];
        face[at] = i;
        count++;
    }
    return count;
}

bool shapes_add_solid(struct shapes *shapes, int faces, const float centre[3], float radius, const char *where)
{
    /* Each solid's faces point at the corners of its dual; the tetrahedron's dual is its own mirror image. */
    static const struct {
        int faces, vertex_count;
        const double (*vertices)[3], (*dual)[3];
        double mirror;
    } solids[] = {{4, 4, tetrahedron, tetrahedron, -1},
                  {6, 8, cube, octahedron, 1},
                  {8, 6, octahedron, cube, 1},
                  {12, 20, dodecahedron, icosahedron, 1}};

    for (size_t s = 0; s < sizeof(solids) / sizeof(solids[0]); s++) {
        double scale;

        if (solids[s].faces != faces)
            continue;
        scale = (double)radius / sqrt(dot(solids[s].vertices[0], solids[s].vertices[0]));
        for (int f = 0; f < faces; f++) {
            double along[3];
            struct shape_vertex corners[5];
            int face[5] = {0};
            uint32_t count;

            for (int c = 0; c < 3; c++)
                along[c] = solids[s].dual[f][c] * solids[s].mirror;
            count = solid_face(solids[s].vertices, solids[s].vertex_count, along, face);
            for (uint32_t i = 0; i < count; i++)
                for (int c = 0; c < 3; c++)
                    corners[i].position[c] = (float)((double)centre[c] + solids[s].vertices[face[i]][c] * scale);
            if (!shapes_add_polygon(shapes, corners, count, true, where))
                return false;
        }
    }
    return true;
}
