/* SPDX-License-Identifier: MIT */
/* Contents of images along the three axes, worked out in double precision from the scene's own buffers: no
 * rasteriser, no shader. Texels whose middle is so near to an edge that rounding decides are left out. */
#ifndef FARLIGHT_TESTS_AXES_ORACLE_H
#define FARLIGHT_TESTS_AXES_ORACLE_H

#include "raster/layout.h"
#include "shared/material.h"
#include "gpu_scene/scene.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* A rasteriser moves corners by half of a 1/256 of a texel (OpenGL asks for four bits, drivers have eight). */
#define ORACLE_EDGE_TEXELS (1.0 / 128)
/* Difference of a normal's entries below which rounding decides whether it leans enough to an axis. */
#define ORACLE_LEAN 1e-4

struct oracle_sample {
    double depth_cells;
    double normal[3]; /* unit, world, to the outside */
    double weights[3];
    double
        slope; /* slope of its plane along u and v, both together: change of the depth from one cell to the next */
    uint32_t instance, primitive; /* scene-wide */
};

struct oracle_texel {
    struct oracle_sample *samples; /* ascending */
    uint32_t count, capacity;
    bool open; /* rounding decides what is there */
};

/* The scene's buffers, read back. */
struct oracle_scene {
    const struct gpu_scene *gpu;
    uint32_t (*triangles)[4];
    float (*positions)[4];
    float (*normals)[4];
    uint16_t (*colours)[4];
    float (*spheres)[4];
    uint32_t *sphere_materials;
    char *tables;
    const struct material *materials; /* in these */
};

enum oracle_images {
    ORACLE_LEANING, /* those that a surface leans to */
    ORACLE_ONE,     /* the one that it leans to most */
    ORACLE_ALL
};

struct oracle {
    uint32_t resolution;
    double lower_world[3], cell_world;
    enum oracle_images images;   /* images that have the surface */
    struct oracle_texel *texels; /* 3 * resolution^2 */
};

static inline void *oracle_read(struct gpu_device *of, const struct gpu_buffer *buffer)
{
    void *data = calloc(1, buffer->size_bytes + 1);
    gpu_buffer_read(of, buffer, 0, data, buffer->size_bytes);
    return data;
}

static inline void oracle_scene_init(struct oracle_scene *scene, const struct gpu_scene *gpu)
{
    *scene = (struct oracle_scene){.gpu = gpu};
    scene->triangles = oracle_read(gpu->device, &gpu->triangles);
    scene->positions = oracle_read(gpu->device, &gpu->positions);
    scene->normals = oracle_read(gpu->device, &gpu->normals);
    scene->colours = oracle_read(gpu->device, &gpu->colours);
    scene->spheres = oracle_read(gpu->device, &gpu->spheres);
    scene->sphere_materials = oracle_read(gpu->device, &gpu->sphere_materials);
    scene->tables = oracle_read(gpu->device, &gpu->tables);
    scene->materials = (const struct material *)(scene->tables + (size_t)gpu->table_starts.materials * 16);
}

static inline void oracle_scene_finish(struct oracle_scene *scene)
{
    free(scene->triangles);
    free(scene->positions);
    free(scene->normals);
    free(scene->colours);
    free(scene->spheres);
    free(scene->sphere_materials);
    free(scene->tables);
}

static inline void oracle_finish(struct oracle *oracle)
{
    for (uint32_t i = 0; i < 3 * oracle->resolution * oracle->resolution; i++)
        free(oracle->texels[i].samples);
    free(oracle->texels);
}

static inline void oracle_add(struct oracle_texel *texel, const struct oracle_sample *sample)
{
    if (texel->count == texel->capacity) {
        texel->capacity = texel->capacity ? 2 * texel->capacity : 4;
        texel->samples = realloc(texel->samples, texel->capacity * sizeof(*texel->samples));
    }
    texel->samples[texel->count++] = *sample;
}

static inline void oracle_cross(double out[3], const double a[3], const double b[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static inline double oracle_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

enum oracle_lean { ORACLE_LEANS_AWAY, ORACLE_LEANS_TO, ORACLE_LEANS_SO_SO /* rounding decides */ };

/* Whether a surface with this normal is in the image of an axis. */
static inline enum oracle_lean oracle_lean(const double n[3], int axis, enum oracle_images images)
{
    if (images == ORACLE_ALL)
        return ORACLE_LEANS_TO;
    double others = fmax(fabs(n[(axis + 1) % 3]), fabs(n[(axis + 2) % 3])), maximum = fmax(fabs(n[axis]), others);
    double beyond =
        images == ORACLE_ONE ? (fabs(n[axis]) - others) / maximum : fabs(n[axis]) / maximum - (double)AXES_OVERLAP;
    if (fabs(beyond) <= ORACLE_LEAN)
        return ORACLE_LEANS_SO_SO;
    return beyond > 0 ? ORACLE_LEANS_TO : ORACLE_LEANS_AWAY;
}

/* Interpolated colour of the vertices, linear. */
static inline void oracle_colour(double out[4], const struct oracle_scene *scene,
                                 const struct oracle_sample *sample)
{
    for (int c = 0; c < 4; c++) {
        out[c] = 0;
        for (int i = 0; i < 3; i++)
            out[c] += sample->weights[i] * scene->colours[scene->triangles[sample->primitive][i]][c] / 65535.0;
    }
}

/* -1: cut out, 0: for rounding to say, 1: there. No textures, and colours of vertices only. */
static inline int oracle_cutout(const struct oracle_scene *scene, const struct oracle_sample *sample)
{
    const struct geometry *g = &scene->gpu->geometries[scene->gpu->instances[sample->instance].geometry].device;
    const struct material *m =
        &scene->materials[g->kind == GEOMETRY_SPHERES ? scene->sphere_materials[sample->primitive]
                                                      : scene->triangles[sample->primitive][3]];
    double colour[4] = {1, 1, 1, 1};
    if ((m->flags & MATERIAL_ALPHA_MASK) == 0)
        return 1;
    if (g->flags & GEOMETRY_HAS_COLOURS)
        oracle_colour(colour, scene, sample);
    double above = colour[3] * m->base_colour[3] - m->alpha_cutoff;
    return fabs(above) < 0.01 ? 0 : above > 0 ? 1 : -1;
}

/* Texels of image `axis` under the triangle; `open`: they are for rounding to decide. */
static inline void oracle_cover(struct oracle *oracle, const struct oracle_scene *scene, int axis, double p[3][3],
                                const struct oracle_sample *base, const double n[3], bool open)
{
    int u = (axis + 1) % 3, v = (axis + 2) % 3, size = (int)oracle->resolution;
    double low_u = fmin(p[0][u], fmin(p[1][u], p[2][u])), high_u = fmax(p[0][u], fmax(p[1][u], p[2][u]));
    double low_v = fmin(p[0][v], fmin(p[1][v], p[2][v])), high_v = fmax(p[0][v], fmax(p[1][v], p[2][v]));
    if (n[axis] == 0)
        return;
    double area = (p[1][u] - p[0][u]) * (p[2][v] - p[0][v]) - (p[1][v] - p[0][v]) * (p[2][u] - p[0][u]);
    for (int y = (int)fmax(0, floor(low_v) - 1); y < size && y <= high_v + 1; y++)
        for (int x = (int)fmax(0, floor(low_u) - 1); x < size && x <= high_u + 1; x++) {
            double inside = 1e30, weights[3];
            for (int k = 0; k < 3; k++) {
                const double *a = p[(k + 1) % 3], *b = p[(k + 2) % 3];
                double eu = b[u] - a[u], ev = b[v] - a[v];
                double edge = eu * (y + 0.5 - a[v]) - ev * (x + 0.5 - a[u]);
                weights[k] = edge / area;
                inside = fmin(inside, edge * (area > 0 ? 1 : -1) / fmax(hypot(eu, ev), 1e-30));
            }
            if (inside < -ORACLE_EDGE_TEXELS)
                continue;
            struct oracle_texel *texel =
                &oracle->texels[((uint32_t)(axis * size + y)) * oracle->resolution + (uint32_t)x];
            texel->open |= open || inside < ORACLE_EDGE_TEXELS;
            struct oracle_sample sample = *base;
            memcpy(sample.weights, weights, sizeof(weights));
            sample.depth_cells = p[0][axis] - (n[u] * (x + 0.5 - p[0][u]) + n[v] * (y + 0.5 - p[0][v])) / n[axis];
            sample.slope = (fabs(n[u]) + fabs(n[v])) / fabs(n[axis]);
            int there = oracle_cutout(scene, &sample);
            texel->open |= there == 0;
            if (there > 0)
                oracle_add(texel, &sample);
        }
}

static inline void oracle_point(double out[3], const float rows[3][4], const float p[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = (double)rows[k][0] * p[0] + (double)rows[k][1] * p[1] + (double)rows[k][2] * p[2] + rows[k][3];
}

static inline void oracle_triangle(struct oracle *oracle, const struct oracle_scene *scene, uint32_t instance,
                                   uint32_t primitive)
{
    const struct instance *at = &scene->gpu->instances[instance];
    double p[3][3], e1[3], e2[3], n[3];
    for (int i = 0; i < 3; i++) {
        oracle_point(p[i], (const float(*)[4])at->world_from_object,
                     scene->positions[scene->triangles[primitive][i]]);
        for (int k = 0; k < 3; k++)
            p[i][k] = (p[i][k] - oracle->lower_world[k]) / oracle->cell_world;
    }
    for (int k = 0; k < 3; k++) {
        e1[k] = p[1][k] - p[0][k];
        e2[k] = p[2][k] - p[0][k];
    }
    oracle_cross(n, e1, e2);
    double length = sqrt(oracle_dot(n, n)), side = at->flags & INSTANCE_MIRRORED ? -1 : 1;
    if (length == 0)
        return;
    struct oracle_sample base = {.instance = instance, .primitive = primitive};
    for (int k = 0; k < 3; k++)
        base.normal[k] = side * n[k] / length;
    for (int axis = 0; axis < 3; axis++) {
        enum oracle_lean lean = oracle_lean(n, axis, oracle->images);
        if (lean != ORACLE_LEANS_AWAY)
            oracle_cover(oracle, scene, axis, p, &base, n, lean == ORACLE_LEANS_SO_SO);
    }
}

/* By rays along the axes in the sphere's own space, every texel. */
static inline void oracle_sphere(struct oracle *oracle, const struct oracle_scene *scene, uint32_t instance,
                                 uint32_t primitive)
{
    const struct instance *at = &scene->gpu->instances[instance];
    const float *sphere = scene->spheres[primitive];
    uint32_t size = oracle->resolution;
    for (uint32_t i = 0; i < 3 * size * size; i++) {
        int axis = (int)(i / (size * size)), u = (axis + 1) % 3, v = (axis + 2) % 3;
        double world[3] = {0}, o[3], d[3];
        world[u] = (i % size + 0.5) * oracle->cell_world;
        world[v] = (i / size % size + 0.5) * oracle->cell_world;
        for (int k = 0; k < 3; k++) {
            const float *row = at->object_from_world[k];
            o[k] = row[3] - (double)sphere[k];
            for (int j = 0; j < 3; j++)
                o[k] += (world[j] + oracle->lower_world[j]) * row[j];
            d[k] = row[axis] * oracle->cell_world;
        }
        double a = oracle_dot(d, d), b = oracle_dot(o, d), c = oracle_dot(o, o) - (double)sphere[3] * sphere[3];
        double root = b * b - a * c;
        /* Within a thousandth of the radius of its rim. */
        bool rim = fabs(root) < 2e-3 * a * (double)sphere[3] * sphere[3];
        if (root < 0 && !rim)
            continue;
        oracle->texels[i].open |= rim;
        for (int s = -1; s <= 1 && !rim; s += 2) {
            struct oracle_sample sample = {.instance = instance, .primitive = primitive};
            sample.depth_cells = (-b + s * sqrt(root)) / a;
            double length = 0;
            for (int k = 0; k < 3; k++) {
                for (int j = 0; j < 3; j++)
                    sample.normal[k] += (o[j] + sample.depth_cells * d[j]) * at->object_from_world[j][k];
                length += sample.normal[k] * sample.normal[k];
            }
            for (int k = 0; k < 3; k++)
                sample.normal[k] /= sqrt(length);
            sample.slope = (fabs(sample.normal[u]) + fabs(sample.normal[v])) / fabs(sample.normal[axis]);
            enum oracle_lean lean = oracle_lean(sample.normal, axis, oracle->images);
            if (lean == ORACLE_LEANS_SO_SO)
                oracle->texels[i].open = true;
            else if (lean == ORACLE_LEANS_TO && oracle_cutout(scene, &sample) > 0)
                oracle_add(&oracle->texels[i], &sample);
        }
    }
}

static inline int oracle_compare(const void *a, const void *b)
{
    const struct oracle_sample *left = a, *right = b;
    if (left->depth_cells != right->depth_cells)
        return left->depth_cells < right->depth_cells ? -1 : 1;
    if (left->instance != right->instance)
        return left->instance < right->instance ? -1 : 1;
    return (left->primitive > right->primitive) - (left->primitive < right->primitive);
}

struct oracle_cube {
    uint32_t resolution;
    float lower_world[3], cell_world;
};

static inline void oracle_init(struct oracle *oracle, const struct oracle_scene *scene,
                               const struct oracle_cube *cube, enum oracle_images images,
                               const uint32_t *instances, uint32_t count)
{
    *oracle = (struct oracle){.resolution = cube->resolution, .cell_world = cube->cell_world, .images = images};
    for (int k = 0; k < 3; k++)
        oracle->lower_world[k] = cube->lower_world[k];
    size_t texels = (size_t)3 * cube->resolution * cube->resolution;
    oracle->texels = calloc(texels, sizeof(*oracle->texels));
    for (uint32_t i = 0; i < count; i++) {
        const struct geometry *g = &scene->gpu->geometries[scene->gpu->instances[instances[i]].geometry].device;
        for (uint32_t k = g->first_primitive; k < g->first_primitive + g->primitive_count; k++)
            if (g->kind == GEOMETRY_SPHERES)
                oracle_sphere(oracle, scene, instances[i], k);
            else
                oracle_triangle(oracle, scene, instances[i], k);
    }
    for (size_t i = 0; i < texels; i++)
        if (oracle->texels[i].count > 1)
            qsort(oracle->texels[i].samples, oracle->texels[i].count, sizeof(struct oracle_sample),
                  oracle_compare);
}

#endif
