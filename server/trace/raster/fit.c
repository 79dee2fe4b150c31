/* SPDX-License-Identifier: MIT */
/* Layers counted from projected areas, and the resolution that follows from them. */
#include "trace/raster/fit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define PI 3.14159265358979
/* Maximum of primitives measured, about a millisecond's worth; at least one of each instance is. */
#define PRIMITIVES_MEASURED (1u << 16)
/* Blocks along a side of an image, each with its number of layers; as steps, they end with one more. */
#define COUNTED_ALONG 128
#define COUNTED_ROW (COUNTED_ALONG + 1)
#define COUNTED_STEPS (COUNTED_ROW * COUNTED_ROW)

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

/* The count so far. */
struct counting {
    const struct axes_box *whole; /* the cube as one cell */
    double overlap, steep;
    double each;   /* primitives that the next one stands for */
    double areas;  /* in all three images, square metres */
    double *steps; /* steps of the number of layers along u and v: COUNTED_STEPS per image; NULL: only areas are
                      counted */
};

static int block_of(const struct counting *counting, double place_world, int axis)
{
    const double share =
        (place_world - (double)counting->whole->lower_world[axis]) / (double)counting->whole->cell_world;
    return (int)fmin(fmax(share * COUNTED_ALONG, 0), COUNTED_ALONG - 1);
}

/* Adds areas along the axes, spread evenly over the blocks that the bounds touch: no block gets more than there
 * is, and large primitives take no longer than small ones. */
static void count_areas(struct counting *counting, const double areas[3], const double lower[3],
                        const double upper[3])
{
    const double side = (double)counting->whole->cell_world / COUNTED_ALONG;
    for (int axis = 0; axis < 3; axis++) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        counting->areas += areas[axis] * counting->each;
        if (!counting->steps)
            continue;
        const int u0 = block_of(counting, lower[u], u), u1 = block_of(counting, upper[u], u) + 1;
        const int v0 = block_of(counting, lower[v], v), v1 = block_of(counting, upper[v], v) + 1;
        const double layers = areas[axis] * counting->each / (side * side * (u1 - u0) * (v1 - v0));
        double *image = counting->steps + (size_t)axis * COUNTED_STEPS;
        image[v0 * COUNTED_ROW + u0] += layers;
        image[v0 * COUNTED_ROW + u1] -= layers;
        image[v1 * COUNTED_ROW + u0] -= layers;
        image[v1 * COUNTED_ROW + u1] += layers;
    }
}

/* Sums the steps; returns the maximum of the sums. */
static double greatest_of(double *steps)
{
    double greatest = 0;
    for (size_t i = 0; i < 3 * (size_t)COUNTED_STEPS; i++) {
        const size_t u = i % COUNTED_ROW, v = i / COUNTED_ROW % COUNTED_ROW;
        steps[i] += (u > 0 ? steps[i - 1] : 0) + (v > 0 ? steps[i - COUNTED_ROW] : 0) -
                    (u > 0 && v > 0 ? steps[i - COUNTED_ROW - 1] : 0);
        greatest = fmax(greatest, steps[i]);
    }
    return greatest;
}

/* Projected areas, square metres, of a flat area with this normal in object space in the images that it is in. */
static void areas_in_images(double areas[3], const double rows[3][3], const double normal[3], double overlap,
                            double steep)
{
    int dominant = 0;
    double squares = 0;
    for (int r = 0; r < 3; r++) {
        areas[r] = fabs(rows[r][0] * normal[0] + rows[r][1] * normal[1] + rows[r][2] * normal[2]);
        dominant = areas[r] > areas[dominant] ? r : dominant;
        squares += areas[r] * areas[r];
    }
    const double least = fmax(overlap * areas[dominant], steep * sqrt(squares));
    for (int r = 0; r < 3; r++)
        if (overlap == 1 ? r != dominant : !(areas[r] >= least))
            areas[r] = 0;
}

static void count_triangle(struct counting *counting, const struct instance *instance, const double rows[3][3],
                           const struct scene_mesh *mesh, uint32_t triangle)
{
    const uint32_t *corner =
        (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data + 3 * (size_t)triangle;
    const float *positions = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data;
    double at[3][3], normal[3], areas[3], lower[3], upper[3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            at[i][k] = (double)positions[3 * (size_t)corner[i] + (size_t)k];
    for (int k = 0; k < 3; k++) {
        const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
        normal[k] = 0.5 * ((at[1][k1] - at[0][k1]) * (at[2][k2] - at[0][k2]) -
                           (at[1][k2] - at[0][k2]) * (at[2][k1] - at[0][k1]));
    }
    for (int r = 0; r < 3; r++) {
        const float *m = instance->world_from_object[r];
        double world[3];
        for (int i = 0; i < 3; i++)
            world[i] = (double)m[0] * at[i][0] + (double)m[1] * at[i][1] + (double)m[2] * at[i][2] + (double)m[3];
        lower[r] = fmin(world[0], fmin(world[1], world[2]));
        upper[r] = fmax(world[0], fmax(world[1], world[2]));
    }
    areas_in_images(areas, rows, normal, counting->overlap, counting->steep);
    count_areas(counting, areas, lower, upper);
}

/* The share of a sphere's projection along an axis within which its normal leans to the axis enough: the
 * directions through a square at distance 1, which reaches 1 / overlap to each side, weighed by their cosine (the
 * form factor of a rectangle). Without an overlap: what lies within the sine that belongs to the cosine `steep`.
 */
static double share_of_sphere(double overlap, double steep)
{
    if (overlap == 0)
        return 1 - steep * steep;
    const double reach = 1 / overlap, edge = reach / sqrt(1 + reach * reach);
    return 4 / PI * edge * atan(edge);
}

/* Counts both sides of a sphere; a squeezed one as if the share were the same. */
static void count_sphere(struct counting *counting, const struct instance *instance, const double rows[3][3],
                         const struct scene_spheres *spheres, uint32_t sphere)
{
    const float *at = (const float *)(const void *)spheres->centres_radii->data + 4 * (size_t)sphere;
    const double radius = (double)at[3], share = share_of_sphere(counting->overlap, counting->steep);
    double areas[3], lower[3], upper[3];
    for (int r = 0; r < 3; r++) {
        const float *m = instance->world_from_object[r];
        const double centre = (double)m[0] * (double)at[0] + (double)m[1] * (double)at[1] +
                              (double)m[2] * (double)at[2] + (double)m[3];
        const double reach =
            radius * sqrt((double)m[0] * (double)m[0] + (double)m[1] * (double)m[1] + (double)m[2] * (double)m[2]);
        lower[r] = centre - reach;
        upper[r] = centre + reach;
        areas[r] = 2 * PI * radius * radius * share *
                   sqrt(rows[r][0] * rows[r][0] + rows[r][1] * rows[r][1] + rows[r][2] * rows[r][2]);
    }
    count_areas(counting, areas, lower, upper);
}

/* Counts every `stride`th primitive in place of those after it. */
static void count_instance(struct counting *counting, const struct gpu_scene *scene,
                           const struct instance *instance, uint32_t stride)
{
    const struct gpu_scene_geometry *geometry = &scene->geometries[instance->geometry];
    const uint32_t count = geometry->device.primitive_count;
    double rows[3][3];
    areas_of(rows, instance);
    counting->each = count / ceil((double)count / stride);
    for (uint64_t i = 0; i < count; i += stride) {
        if (geometry->mesh)
            count_triangle(counting, instance, rows, geometry->mesh, (uint32_t)i);
        else
            count_sphere(counting, instance, rows, geometry->spheres, (uint32_t)i);
    }
}

struct axes_layers axes_count_layers(const struct gpu_scene *scene, const uint32_t *instances, uint32_t count,
                                     float overlap, float steep, const struct axes_box *whole)
{
    struct counting counting = {.whole = whole, .overlap = (double)overlap, .steep = (double)steep};
    const double side = (double)whole->cell_world;
    struct axes_layers layers = {0};
    uint64_t primitives = 0;
    if (!(side > 0))
        return layers;
    counting.steps = calloc(3 * (size_t)COUNTED_STEPS, sizeof(*counting.steps));
    for (uint32_t i = 0; i < count; i++)
        primitives += scene->geometries[scene->instances[instances[i]].geometry].device.primitive_count;
    /* An odd stride measures both triangles of a quadrilateral by turns, as they often alternate. */
    const uint32_t stride = (uint32_t)(primitives / PRIMITIVES_MEASURED) | 1u;
    for (uint32_t i = 0; i < count; i++)
        count_instance(&counting, scene, &scene->instances[instances[i]], stride);
    layers.mean = counting.areas / (3 * side * side);
    layers.greatest = counting.steps ? greatest_of(counting.steps) : 0;
    free(counting.steps);
    return layers;
}

uint32_t axes_greatest_resolution(const struct axes_request *request)
{
    return request->resolution > 0 ? request->resolution : request->usual;
}

double axes_times(const struct gpu_device *device)
{
    return (double)device->facts.axes_samples_max / AXES_SAMPLES_USUAL;
}

uint32_t axes_choose_resolution(const struct tracer *tracer, double layers, const struct axes_request *request)
{
    const uint32_t pixels = tracer->options.picture_pixels;
    if (request->resolution > 0 || pixels == 0)
        return axes_greatest_resolution(request);
    const double counted = pixels > AXES_PICTURE_PIXELS_MIN ? pixels : AXES_PICTURE_PIXELS_MIN;
    const double samples = request->samples_per_pixel * counted * axes_times(tracer->device);
    const double fitting = fmax(sqrt(samples / (3 * (layers + AXES_TEXEL_COST))), AXES_FITTED_MIN);
    return (uint32_t)fmin(fitting, request->usual);
}

uint32_t axes_wanted_resolution(const struct tracer *tracer, const struct axes_request *request)
{
    const uint32_t pixels = tracer->options.picture_pixels, greatest = axes_greatest_resolution(request);
    return request->resolution > 0 || pixels == 0 ? greatest : (uint32_t)fmin(sqrt(pixels) / 2, greatest);
}

bool axes_fit_resolution(const struct tracer *tracer, double layers, uint32_t *resolution, struct error *error)
{
    const double maximum = (double)tracer->device->facts.axes_samples_max;
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

bool axes_fit_depth(const struct tracer *tracer, double layers, uint32_t maximum, struct error *error)
{
    if (!(layers > maximum))
        return true;
    error_set(error, ERROR_LIMIT, tracer->impl->name,
              "the scene has %.0f layers in one place, of at most %u: too many to sample", layers, maximum);
    return error_remedy(error, "choose another tracer, such as bvh");
}

void axes_fit_warn(struct structure_row *resolution, uint32_t wanted)
{
    if (resolution->number < wanted)
        snprintf(resolution->warning, sizeof(resolution->warning),
                 "%llu instead of %u texels along a side, as the scene has too many layers: what is smaller than "
                 "a cell may be "
                 "missing (choose another tracer, such as bvh)",
                 (unsigned long long)resolution->number, wanted);
}
