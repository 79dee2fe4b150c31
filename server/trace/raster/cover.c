/* SPDX-License-Identifier: MIT */
/* Projected areas of primitives, in texels. */
#include "trace/raster/cover.h"

#include <math.h>

#define PI 3.14159265f

/* An instance's transform of normals whose lengths are areas. */
struct areas {
    float rows[3][3];
    float per_cell; /* texels per unit of area */
};

static struct areas areas_of(const struct instance *instance, float cell_world)
{
    struct areas areas = {.per_cell = 1.0f / (cell_world * cell_world)};
    const vec4 *m = instance->world_from_object;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            areas.rows[r][c] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        }
    return areas;
}

/* Texels along the three axes of a flat area with this normal in object space. */
static float texels_of_normal(const struct areas *areas, const float normal[3])
{
    float sum = 0;
    for (int r = 0; r < 3; r++)
        sum +=
            fabsf(areas->rows[r][0] * normal[0] + areas->rows[r][1] * normal[1] + areas->rows[r][2] * normal[2]);
    return sum * areas->per_cell;
}

static float texels_of_triangle(const struct areas *areas, const struct scene_mesh *mesh, uint32_t triangle)
{
    const uint32_t *corner =
        (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data + 3 * (size_t)triangle;
    const float *positions = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data;
    const float *a = positions + 3 * (size_t)corner[0], *b = positions + 3 * (size_t)corner[1];
    const float *c = positions + 3 * (size_t)corner[2];
    const float ab[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, ac[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const float normal[3] = {0.5f * (ab[1] * ac[2] - ab[2] * ac[1]), 0.5f * (ab[2] * ac[0] - ab[0] * ac[2]),
                             0.5f * (ab[0] * ac[1] - ab[1] * ac[0])};
    return texels_of_normal(areas, normal);
}

static float texels_of_sphere(const struct areas *areas, const struct scene_spheres *spheres, uint32_t sphere)
{
    const float radius = ((const float *)(const void *)spheres->centres_radii->data)[4 * (size_t)sphere + 3];
    float sum = 0;
    for (int k = 0; k < 3; k++) {
        const float disc[3] = {k == 0 ? PI * radius * radius : 0, k == 1 ? PI * radius * radius : 0,
                               k == 2 ? PI * radius * radius : 0};
        sum += texels_of_normal(areas, disc);
    }
    return sum;
}

/* Does the work of axes_cover_end() for the primitives of one instance. */
static uint32_t end_in_instance(const struct gpu_scene *scene, const struct instance *instance, float cell_world,
                                uint32_t first, uint32_t end, double maximum, double *texels)
{
    const struct gpu_scene_geometry *geometry = &scene->geometries[instance->geometry];
    const struct areas areas = areas_of(instance, cell_world);
    for (uint32_t i = first; i < end; i++) {
        const double more = geometry->mesh ? (double)texels_of_triangle(&areas, geometry->mesh, i)
                                           : (double)texels_of_sphere(&areas, geometry->spheres, i);
        if (*texels > 0 && !(*texels + more <= maximum))
            return i;
        *texels += more > 1 ? more : 1;
    }
    return end;
}

uint32_t axes_cover_end(const struct axes_draw *draw, const struct gpu_scene *scene, float cell_world,
                        uint32_t first, uint32_t end, double maximum, double *texels)
{
    *texels = 0;
    for (uint32_t id = first; id < end;) {
        const struct axes_command *command = &draw->listed[axes_draw_command_of(draw, id)];
        const uint32_t each = command->vertex_count, number = (id - command->first_id) / each;
        const uint32_t start = command->first_id + number * each, left = end - start;
        const uint32_t inner_end = left < each ? left : each;
        const struct instance *instance = &scene->instances[draw->instances[command->base_instance + number]];
        const uint32_t inner =
            end_in_instance(scene, instance, cell_world, id - start, inner_end, maximum, texels);
        id = start + inner;
        if (inner < inner_end)
            return id;
    }
    return end;
}
