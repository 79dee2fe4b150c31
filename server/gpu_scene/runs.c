/* SPDX-License-Identifier: MIT */
/* Where runs of primitives lie and how large they are, found while the geometry is packed. */
#include "gpu_scene/state.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

bool gpu_scene_reserve_runs(struct gpu_scene_geometry *geometry, struct error *error)
{
    const size_t count = geometry->device.primitive_count / GEOMETRY_RUN + 1;
    geometry->runs = calloc(count, sizeof(*geometry->runs));
    return geometry->runs || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %zu runs", count);
}

void gpu_scene_drop_geometries(struct gpu_scene *gpu)
{
    for (uint32_t i = 0; i < gpu->geometry_count; i++)
        free(gpu->geometries[i].runs);
    free(gpu->geometries);
    gpu->geometries = NULL;
    gpu->geometry_count = 0;
}

struct run_box {
    float lower[3], upper[3];
};

static void grow(struct run_box *box, const float point[3], float radius)
{
    for (int k = 0; k < 3; k++) {
        box->lower[k] = fminf(box->lower[k], point[k] - radius);
        box->upper[k] = fmaxf(box->upper[k], point[k] + radius);
    }
}

static float triangle_area(const float a[3], const float b[3], const float c[3])
{
    const float u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const float cross[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    return 0.5f * sqrtf(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
}

/* Grows the box. Returns the triangle's area, or the largest shadow of the cube that a sphere is drawn as. */
static float add_primitive(struct run_box *box, const struct gpu_scene_geometry *geometry, size_t primitive)
{
    if (geometry->spheres) {
        const float *sphere = (const float *)(const void *)geometry->spheres->centres_radii->data + 4 * primitive;
        grow(box, sphere, sphere[3]);
        return 7.0f * sphere[3] * sphere[3];
    }
    const uint32_t *indices =
        (const uint32_t *)(const void *)geometry->mesh->arrays[MESH_INDICES]->data + 3 * primitive;
    const float *positions = (const float *)(const void *)geometry->mesh->arrays[MESH_POSITIONS]->data;
    const float *corners[3];
    for (int k = 0; k < 3; k++) {
        corners[k] = positions + 3 * (size_t)indices[k];
        grow(box, corners[k], 0.0f);
    }
    return triangle_area(corners[0], corners[1], corners[2]);
}

void gpu_scene_find_runs(const struct gpu_scene_geometry *geometry)
{
    const uint32_t count = geometry->device.primitive_count;
    for (uint32_t first = 0; first < count; first += GEOMETRY_RUN) {
        struct geometry_run *run = &geometry->runs[first / GEOMETRY_RUN];
        const uint32_t end = count - first < GEOMETRY_RUN ? count : first + GEOMETRY_RUN;
        struct run_box box = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
        float area = 0.0f, squared = 0.0f;
        for (uint32_t i = first; i < end; i++)
            area += add_primitive(&box, geometry, i);
        for (int k = 0; k < 3; k++) {
            const float half = 0.5f * box.upper[k] - 0.5f * box.lower[k];
            run->centre[k] = 0.5f * box.lower[k] + 0.5f * box.upper[k];
            squared += half * half;
        }
        run->radius = sqrtf(squared);
        run->area = area;
    }
}
