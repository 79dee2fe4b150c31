/* SPDX-License-Identifier: MIT */
#include "trace/raster/fit.h"

#include <math.h>
#include <stdio.h>

#define PI 3.14159265358979
/* Looked at, of all primitives: about a millisecond's worth. Of each instance at least one is. */
#define PRIMITIVES_LOOKED_AT (1u << 16)

/* The transform of normals whose lengths are areas, by an instance's matrix. */
static void areas_of(double rows[3][3], const struct instance *instance)
{
    const vec4 *m = instance->world_from_object;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            rows[r][c] = (double)m[r1][c1] * (double)m[r2][c2] - (double)m[r1][c2] * (double)m[r2][c1];
        }
}

/* A flat area with this normal in object space, as the images that it is in see it, square metres. */
static double area_in_images(const double rows[3][3], const double normal[3], double overlap)
{
    double lean[3], sum = 0;
    for (int r = 0; r < 3; r++)
        lean[r] = fabs(rows[r][0] * normal[0] + rows[r][1] * normal[1] + rows[r][2] * normal[2]);
    const double maximum = fmax(lean[0], fmax(lean[1], lean[2]));
    if (overlap == 1)
        return maximum;
    for (int r = 0; r < 3; r++)
        sum += lean[r] >= overlap * maximum ? lean[r] : 0;
    return sum;
}

static double area_of_triangle(const double rows[3][3], const struct scene_mesh *mesh, uint32_t triangle,
                               double overlap)
{
    const uint32_t *corner =
        (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data + 3 * (size_t)triangle;
    const float *positions = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data;
    const float *a = positions + 3 * (size_t)corner[0], *b = positions + 3 * (size_t)corner[1];
    const float *c = positions + 3 * (size_t)corner[2];
    double ab[3], ac[3], normal[3];
    for (int k = 0; k < 3; k++) {
        ab[k] = (double)b[k] - (double)a[k];
        ac[k] = (double)c[k] - (double)a[k];
    }
    for (int k = 0; k < 3; k++)
        normal[k] = 0.5 * (ab[(k + 1) % 3] * ac[(k + 2) % 3] - ab[(k + 2) % 3] * ac[(k + 1) % 3]);
    return area_in_images(rows, normal, overlap);
}

/* The share of a sphere's projection along an axis within which its normal leans to the axis enough: the
 * directions through a square at distance 1, which reaches 1 / overlap to each side, weighed by their cosine (the
 * form factor of a rectangle). */
static double share_of_sphere(double overlap)
{
    if (overlap == 0)
        return 1;
    const double reach = 1 / overlap, edge = reach / sqrt(1 + reach * reach);
    return 4 / PI * edge * atan(edge);
}

/* Both sides; squeezed ones as if the share were theirs too. */
static double area_of_sphere(const double rows[3][3], const struct scene_spheres *spheres, uint32_t sphere,
                             double overlap)
{
    const double radius =
        (double)((const float *)(const void *)spheres->centres_radii->data)[4 * (size_t)sphere + 3];
    double sum = 0;
    for (int r = 0; r < 3; r++)
        sum += sqrt(rows[r][0] * rows[r][0] + rows[r][1] * rows[r][1] + rows[r][2] * rows[r][2]);
    return 2 * PI * radius * radius * sum * share_of_sphere(overlap);
}

/* Every `stride`th primitive stands for those after it. */
static double area_of_instance(const struct gpu_scene *scene, const struct instance *instance, uint32_t stride,
                               double overlap)
{
    const struct gpu_scene_geometry *geometry = &scene->geometries[instance->geometry];
    const uint32_t count = geometry->device.primitive_count;
    uint32_t seen = 0;
    double rows[3][3], sum = 0;
    areas_of(rows, instance);
    for (uint64_t i = 0; i < count; i += stride, seen++)
        sum += geometry->mesh ? area_of_triangle(rows, geometry->mesh, (uint32_t)i, overlap)
                              : area_of_sphere(rows, geometry->spheres, (uint32_t)i, overlap);
    return seen > 0 ? sum * count / seen : 0;
}

double axes_mean_layers(const struct gpu_scene *scene, const uint32_t *instances, uint32_t count, float overlap,
                        double longest_world)
{
    uint64_t primitives = 0;
    double sum = 0;
    for (uint32_t i = 0; i < count; i++)
        primitives += scene->geometries[scene->instances[instances[i]].geometry].device.primitive_count;
    /* Odd: the two triangles of a quadrilateral, which often come by turns, are looked at by turns. */
    const uint32_t stride = (uint32_t)(primitives / PRIMITIVES_LOOKED_AT) | 1u;
    for (uint32_t i = 0; i < count; i++)
        sum += area_of_instance(scene, &scene->instances[instances[i]], stride, (double)overlap);
    return longest_world > 0 ? sum / (3 * longest_world * longest_world) : 0;
}

static double samples_max(const struct tracer *tracer)
{
    if (tracer->options.bench.axes_samples > 0)
        return tracer->options.bench.axes_samples;
    return AXES_SAMPLES_MAX * (tracer->device->facts.software ? 1 : AXES_HARDWARE_TIMES);
}

bool axes_fit_resolution(const struct tracer *tracer, double layers, uint32_t *resolution, struct error *error)
{
    const double maximum = samples_max(tracer);
    if (!(layers * 3 * *resolution * *resolution > maximum))
        return true;
    const double fitting = sqrt(maximum / (3 * layers));
    if (!(fitting >= AXES_FITTED_MIN)) {
        error_set(error, ERROR_LIMIT, tracer->impl->name,
                  "the scene has %.0f layers on average: too many to sample", layers);
        return error_remedy(error, "choose another tracer, such as bvh");
    }
    *resolution = (uint32_t)fitting;
    return true;
}

void axes_fit_tell(struct structure_row *resolution, uint32_t wanted)
{
    if (resolution->number < wanted)
        snprintf(resolution->warning, sizeof(resolution->warning),
                 "%llu instead of %u texels along a side, as the scene has too many layers: what is smaller than "
                 "a cell may be "
                 "missing (choose another tracer, such as bvh)",
                 (unsigned long long)resolution->number, wanted);
}
