/* SPDX-License-Identifier: MIT */
/* Collecting of triangles and spheres. */
#include "shapes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void shapes_init(struct shapes *shapes, struct import_scene *scene, uint64_t *polygon_budget)
{
    *shapes = (struct shapes){.scene = scene, .polygon_budget = polygon_budget};
    for (int c = 0; c < 3; c++) {
        shapes->lower[c] = INFINITY;
        shapes->upper[c] = -INFINITY;
    }
}

void shapes_free(struct shapes *shapes)
{
    free(shapes->positions);
    free(shapes->normals);
    free(shapes->indices);
    free(shapes->triangle_materials);
    free(shapes->spheres);
    free(shapes->sphere_materials);
}

/* Arrays of floats or numbers that grow together, with `width` elements for each item. */
struct growing {
    void **array;
    size_t width;
};

static bool reserve(struct import_scene *scene, const struct growing *arrays, size_t array_count, size_t *capacity,
                    size_t wanted)
{
    size_t grown_to = *capacity + *capacity / 2 + 64;

    if (wanted <= *capacity)
        return true;
    if (wanted > SHAPES_TRIANGLES_MAX * (size_t)3)
        return import_fail(scene, NULL, "more geometry than %u triangles", SHAPES_TRIANGLES_MAX);
    if (grown_to < wanted)
        grown_to = wanted;
    for (size_t i = 0; i < array_count; i++) {
        void *grown = realloc(*arrays[i].array, grown_to * arrays[i].width * 4);

        if (!grown)
            return import_fail(scene, NULL, "out of memory");
        *arrays[i].array = grown;
    }
    *capacity = grown_to;
    return true;
}

bool shapes_reserve(struct shapes *shapes, size_t more_vertices, size_t more_triangles)
{
    void *positions = shapes->positions, *normals = shapes->normals;
    void *indices = shapes->indices, *materials = shapes->triangle_materials;
    const struct growing vertices[] = {{&positions, 3}, {&normals, 3}};
    const struct growing triangles[] = {{&indices, 3}, {&materials, 1}};
    bool reserved =
        reserve(shapes->scene, vertices, 2, &shapes->vertex_capacity, shapes->vertex_count + more_vertices) &&
        reserve(shapes->scene, triangles, 2, &shapes->triangle_capacity, shapes->triangle_count + more_triangles);

    shapes->positions = positions;
    shapes->normals = normals;
    shapes->indices = indices;
    shapes->triangle_materials = materials;
    return reserved;
}

static void include(struct shapes *shapes, const float point[3], float radius)
{
    for (int c = 0; c < 3; c++) {
        shapes->lower[c] = fminf(shapes->lower[c], point[c] - radius);
        shapes->upper[c] = fmaxf(shapes->upper[c], point[c] + radius);
    }
}

/* Normalises v; false, with v unchanged, if it has no direction. */
static bool normalise(float v[3])
{
    double length = sqrt((double)v[0] * (double)v[0] + (double)v[1] * (double)v[1] + (double)v[2] * (double)v[2]);

    if (!(length > 0) || !isfinite(length))
        return false;
    for (int c = 0; c < 3; c++)
        v[c] = (float)((double)v[c] / length);
    return true;
}

uint32_t shapes_add_vertex(struct shapes *shapes, const struct shape_vertex *vertex)
{
    float *position = shapes->positions + shapes->vertex_count * 3;
    float *normal = shapes->normals + shapes->vertex_count * 3;

    memcpy(position, vertex->position, 12);
    memcpy(normal, vertex->normal, 12);
    normalise(normal);
    include(shapes, position, 0);
    return (uint32_t)shapes->vertex_count++;
}

void shapes_add_triangle(struct shapes *shapes, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *to = shapes->indices + shapes->triangle_count * 3;

    to[0] = a;
    to[1] = b;
    to[2] = c;
    shapes->triangle_materials[shapes->triangle_count++] = shapes->material;
}

bool shapes_add_sphere(struct shapes *shapes, const float centre[3], float radius)
{
    void *spheres = shapes->spheres, *materials = shapes->sphere_materials;
    const struct growing arrays[] = {{&spheres, 4}, {&materials, 1}};
    bool reserved = reserve(shapes->scene, arrays, 2, &shapes->sphere_capacity, shapes->sphere_count + 1);
    float *to;

    shapes->spheres = spheres;
    shapes->sphere_materials = materials;
    if (!reserved)
        return false;
    to = shapes->spheres + shapes->sphere_count * 4;
    memcpy(to, centre, 12);
    to[3] = radius;
    shapes->sphere_materials[shapes->sphere_count++] = shapes->material;
    include(shapes, to, to[3]);
    return true;
}

static void newell(const struct shape_vertex *corners, uint32_t count, float normal[3])
{
    double sum[3] = {0}, length;

    for (uint32_t i = 0; i < count; i++) {
        const float *a = corners[i].position, *b = corners[(i + 1) % count].position;

        for (int c = 0; c < 3; c++) {
            int u = (c + 1) % 3, v = (c + 2) % 3;

            sum[c] += ((double)a[u] - (double)b[u]) * ((double)a[v] + (double)b[v]);
        }
    }
    /* Scaled before the conversion to float, as small polygons would have no normal. */
    length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (int c = 0; c < 3; c++)
        normal[c] = length > 0 ? (float)(sum[c] / length) : 0;
}

bool shapes_add_polygon(struct shapes *shapes, const struct shape_vertex *corners, uint32_t count, bool flat,
                        const char *where)
{
    uint32_t *triangles = malloc((size_t)count * 3 * sizeof(*triangles));
    uint32_t first = (uint32_t)shapes->vertex_count;
    float *positions = malloc((size_t)count * 12), face[3];

    if (!triangles || !positions || !shapes_reserve(shapes, count, count)) {
        free(triangles);
        free(positions);
        return import_fail(shapes->scene, where, "out of memory");
    }
    newell(corners, count, face);
    for (uint32_t i = 0; i < count; i++) {
        struct shape_vertex vertex = corners[i];

        if (flat || !normalise(vertex.normal))
            memcpy(vertex.normal, face, sizeof(face));
        memcpy(positions + (size_t)i * 3, vertex.position, 12);
        shapes_add_vertex(shapes, &vertex);
    }
    if (!polygon_triangulate(positions, count, triangles, shapes->polygon_budget))
        import_note(shapes->scene, PROTOCOL_SEVERITY_WARNING, where, "a twisted polygon may look wrong");
    for (uint32_t i = 0; i + 2 < count; i++)
        shapes_add_triangle(shapes, first + triangles[i * 3], first + triangles[i * 3 + 1],
                            first + triangles[i * 3 + 2]);
    free(triangles);
    free(positions);
    return true;
}

static void to_identifiers(uint32_t *numbers, size_t count, const uint32_t *materials)
{
    for (size_t i = 0; i < count; i++)
        numbers[i] = materials[numbers[i]];
}

bool shapes_finish(struct shapes *shapes, const uint32_t *materials)
{
    struct import_scene *scene = shapes->scene;

    to_identifiers(shapes->triangle_materials, shapes->triangle_count, materials);
    to_identifiers(shapes->sphere_materials, shapes->sphere_count, materials);
    if (shapes->triangle_count > 0) {
        struct import_mesh mesh = {.name = "triangles",
                                   .vertex_count = (uint32_t)shapes->vertex_count,
                                   .triangle_count = (uint32_t)shapes->triangle_count,
                                   .positions = shapes->positions,
                                   .normals = shapes->normals,
                                   .indices = shapes->indices};

        shapes->positions = shapes->normals = NULL;
        shapes->indices = NULL;
        if (!import_add_grouped_mesh(scene, 0, &mesh, shapes->triangle_materials))
            return false;
    }
    return shapes->sphere_count == 0 ||
           import_add_grouped_spheres(scene, 0, "spheres", shapes->spheres, shapes->sphere_materials,
                                      (uint32_t)shapes->sphere_count);
}
