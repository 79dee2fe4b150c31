/* SPDX-License-Identifier: MIT */
#include "nff.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

void nff_free_shapes(struct nff_shapes *shapes)
{
    free(shapes->positions);
    free(shapes->normals);
    free(shapes->indices);
    free(shapes->triangle_materials);
    free(shapes->spheres);
    free(shapes->sphere_materials);
}

/* Two arrays that grow together; element sizes in bytes. */
static bool reserve(struct import_scene *scene, void **first, size_t first_bytes, void **second,
                    size_t second_bytes, size_t *capacity, size_t wanted)
{
    size_t grown_to = *capacity + *capacity / 2 + 64;
    void *grown;

    if (wanted <= *capacity)
        return true;
    if (wanted > NFF_TRIANGLES_MAX * (size_t)3)
        return import_fail(scene, NULL, "more geometry than %u triangles", NFF_TRIANGLES_MAX);
    if (grown_to < wanted)
        grown_to = wanted;
    grown = realloc(*first, grown_to * first_bytes);
    if (!grown)
        return import_fail(scene, NULL, "out of memory");
    *first = grown;
    grown = realloc(*second, grown_to * second_bytes);
    if (!grown)
        return import_fail(scene, NULL, "out of memory");
    *second = grown;
    *capacity = grown_to;
    return true;
}

static bool reserve_vertices(struct nff_shapes *shapes, size_t more)
{
    void *positions = shapes->positions, *normals = shapes->normals;
    bool reserved = reserve(shapes->scene, &positions, 12, &normals, 12, &shapes->vertex_capacity,
                            shapes->vertex_count + more);

    shapes->positions = positions;
    shapes->normals = normals;
    return reserved;
}

static bool reserve_triangles(struct nff_shapes *shapes, size_t more)
{
    void *indices = shapes->indices, *materials = shapes->triangle_materials;
    bool reserved = reserve(shapes->scene, &indices, 12, &materials, 4, &shapes->triangle_capacity,
                            shapes->triangle_count + more);

    shapes->indices = indices;
    shapes->triangle_materials = materials;
    return reserved;
}

static void include(struct nff_shapes *shapes, const float point[3], float radius)
{
    for (int c = 0; c < 3; c++) {
        shapes->lower[c] = fminf(shapes->lower[c], point[c] - radius);
        shapes->upper[c] = fmaxf(shapes->upper[c], point[c] + radius);
    }
}

/* The caller has reserved. */
static uint32_t add_vertex(struct nff_shapes *shapes, const float position[3], const float normal[3])
{
    memcpy(shapes->positions + shapes->vertex_count * 3, position, 12);
    memcpy(shapes->normals + shapes->vertex_count * 3, normal, 12);
    include(shapes, position, 0);
    return (uint32_t)shapes->vertex_count++;
}

static void add_triangle(struct nff_shapes *shapes, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *to = shapes->indices + shapes->triangle_count * 3;

    to[0] = a;
    to[1] = b;
    to[2] = c;
    shapes->triangle_materials[shapes->triangle_count++] = shapes->material;
}

bool nff_add_sphere(struct nff_shapes *shapes, const float centre[3], float radius)
{
    void *spheres = shapes->spheres, *materials = shapes->sphere_materials;
    bool reserved =
        reserve(shapes->scene, &spheres, 16, &materials, 4, &shapes->sphere_capacity, shapes->sphere_count + 1);
    float *to;

    shapes->spheres = spheres;
    shapes->sphere_materials = materials;
    if (!reserved)
        return false;
    to = shapes->spheres + shapes->sphere_count * 4;
    memcpy(to, centre, 12);
    to[3] = radius;
    shapes->sphere_materials[shapes->sphere_count++] = shapes->material;
    include(shapes, centre, radius);
    return true;
}

static bool normalise(float v[3])
{
    double length = sqrt((double)v[0] * (double)v[0] + (double)v[1] * (double)v[1] + (double)v[2] * (double)v[2]);

    if (!(length > 0) || !isfinite(length))
        return false;
    for (int c = 0; c < 3; c++)
        v[c] = (float)((double)v[c] / length);
    return true;
}

static void newell(const float *corners, uint32_t count, float normal[3])
{
    double sum[3] = {0}, length;

    for (uint32_t i = 0; i < count; i++) {
        const float *a = corners + (size_t)i * 3, *b = corners + (size_t)((i + 1) % count) * 3;

        for (int c = 0; c < 3; c++) {
            int u = (c + 1) % 3, v = (c + 2) % 3;

            sum[c] += ((double)a[u] - (double)b[u]) * ((double)a[v] + (double)b[v]);
        }
    }
    /* Scaled before it is narrowed, or small polygons would have no normal. */
    length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (int c = 0; c < 3; c++)
        normal[c] = length > 0 ? (float)(sum[c] / length) : 0;
}

bool nff_add_polygon(struct nff_shapes *shapes, const float *corners, const float *normals, uint32_t count,
                     const char *where)
{
    uint32_t *triangles = malloc((size_t)count * 3 * sizeof(*triangles));
    uint32_t first = (uint32_t)shapes->vertex_count;
    float flat[3];

    if (!triangles || !reserve_vertices(shapes, count) || !reserve_triangles(shapes, count)) {
        free(triangles);
        return import_fail(shapes->scene, where, "out of memory");
    }
    newell(corners, count, flat);
    for (uint32_t i = 0; i < count; i++) {
        float normal[3];

        memcpy(normal, normals ? normals + (size_t)i * 3 : flat, sizeof(normal));
        if (!normalise(normal))
            memcpy(normal, flat, sizeof(normal));
        add_vertex(shapes, corners + (size_t)i * 3, normal);
    }
    if (!polygon_triangulate(corners, count, triangles, &shapes->polygon_budget))
        import_note(shapes->scene, PROTOCOL_SEVERITY_WARNING, where, "a twisted polygon may look wrong");
    for (uint32_t i = 0; i + 2 < count; i++)
        add_triangle(shapes, first + triangles[i * 3], first + triangles[i * 3 + 1], first + triangles[i * 3 + 2]);
    free(triangles);
    return true;
}

/* ---- cones ---- */

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

bool nff_add_cone(struct nff_shapes *shapes, const float ends[8], const char *where)
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
    if (!reserve_vertices(shapes, 2 * (NFF_CONE_SEGMENTS + 1)) ||
        !reserve_triangles(shapes, 2 * NFF_CONE_SEGMENTS))
        return false;
    for (int c = 0; c < 3; c++)
        axis[c] /= length;
    frame_of(axis, u, v);
    slope = ((double)ends[3] - (double)ends[7]) / length; /* normals lean towards the thin end */
    for (int i = 0; i <= NFF_CONE_SEGMENTS; i++) {
        double angle = 2 * PI * (i % NFF_CONE_SEGMENTS) / NFF_CONE_SEGMENTS;
        float position[3], normal[3];

        for (int end = 0; end < 2; end++) {
            for (int c = 0; c < 3; c++) {
                double outwards = cos(angle) * u[c] + sin(angle) * v[c];

                position[c] = (float)((double)ends[end * 4 + c] + outwards * (double)ends[end * 4 + 3]);
                normal[c] = (float)(outwards + axis[c] * slope);
            }
            normalise(normal);
            add_vertex(shapes, position, normal);
        }
    }
    for (uint32_t i = 0; i < NFF_CONE_SEGMENTS; i++) {
        uint32_t at = first + 2 * i;

        if (ends[3] > 0)
            add_triangle(shapes, at, at + 2, at + 1);
        if (ends[7] > 0)
            add_triangle(shapes, at + 1, at + 2, at + 3);
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

bool nff_add_solid(struct nff_shapes *shapes, int faces, const float centre[3], float radius, const char *where)
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
            float corners[15];
            int face[5] = {0};
            uint32_t count;

            for (int c = 0; c < 3; c++)
                along[c] = solids[s].dual[f][c] * solids[s].mirror;
            count = solid_face(solids[s].vertices, solids[s].vertex_count, along, face);
            for (uint32_t i = 0; i < count; i++)
                for (int c = 0; c < 3; c++)
                    corners[i * 3 + (uint32_t)c] =
                        (float)((double)centre[c] + solids[s].vertices[face[i]][c] * scale);
            if (!nff_add_polygon(shapes, corners, NULL, count, where))
                return false;
        }
    }
    return true;
}

/* ---- the end ---- */

bool nff_finish_shapes(struct nff_shapes *shapes)
{
    struct import_scene *scene = shapes->scene;

    if (shapes->triangle_count > 0) {
        struct import_mesh mesh = {.name = "triangles",
                                   .vertex_count = (uint32_t)shapes->vertex_count,
                                   .triangle_count = (uint32_t)shapes->triangle_count,
                                   .positions = shapes->positions,
                                   .normals = shapes->normals,
                                   .indices = shapes->indices};

        shapes->positions = shapes->normals = NULL;
        shapes->indices = NULL;
        if (!import_add_grouped_mesh(scene, &mesh, shapes->triangle_materials))
            return false;
    }
    return shapes->sphere_count == 0 ||
           import_add_grouped_spheres(scene, "spheres", shapes->spheres, shapes->sphere_materials,
                                      (uint32_t)shapes->sphere_count);
}
