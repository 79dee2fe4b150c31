/* SPDX-License-Identifier: MIT */
/* A cube made on the CPU, sample by sample as ldc/layout.h has it: what the traversal's tests compare with. */
#ifndef FARLIGHT_TESTS_LDC_SAMPLES_H
#define FARLIGHT_TESTS_LDC_SAMPLES_H

#include "ldc/layout.h"
#include "trace/ldc/store.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct ldc_sample {
    uint32_t texel; /* within the cube */
    float depth;    /* cells */
    uint32_t normal, surface[4];
};

struct ldc_samples {
    float lower[3], cell;
    uint32_t resolution;
    struct ldc_sample *list;
    size_t count, room;
};

static inline uint32_t ldc_pack_unit(const float n[3])
{
    float sum = fabsf(n[0]) + fabsf(n[1]) + fabsf(n[2]), p[2] = {n[0] / sum, n[1] / sum};
    if (n[2] < 0) {
        float x = (1 - fabsf(p[1])) * (p[0] >= 0 ? 1.0f : -1.0f),
              y = (1 - fabsf(p[0])) * (p[1] >= 0 ? 1.0f : -1.0f);
        p[0] = x;
        p[1] = y;
    }
    return (uint32_t)(uint16_t)lrintf(p[0] * 32767) | (uint32_t)(uint16_t)lrintf(p[1] * 32767) << 16;
}

static inline void ldc_unpack_unit(float n[3], uint32_t bits)
{
    float x = (float)(int16_t)(bits & 0xffff) / 32767, y = (float)(int16_t)(bits >> 16) / 32767;
    n[2] = 1 - fabsf(x) - fabsf(y);
    n[0] = n[2] < 0 ? (1 - fabsf(y)) * (x >= 0 ? 1.0f : -1.0f) : x;
    n[1] = n[2] < 0 ? (1 - fabsf(x)) * (y >= 0 ? 1.0f : -1.0f) : y;
    float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; k++)
        n[k] /= length;
}

static inline void ldc_add_sample(struct ldc_samples *s, int axis, uint32_t u, uint32_t v, float depth,
                                  const float normal[3], uint32_t material)
{
    if (s->count == s->room) {
        s->room = s->room ? 2 * s->room : 1 << 16;
        s->list = realloc(s->list, s->room * sizeof(*s->list));
    }
    struct ldc_sample *sample = &s->list[s->count++];
    *sample = (struct ldc_sample){((uint32_t)axis * s->resolution + v) * s->resolution + u,
                                  depth,
                                  ldc_pack_unit(normal),
                                  {0xffffffffu, ldc_pack_unit(normal), material | 0xff000000u, 0}};
}

/* Whether a surface with this normal is in the image of an axis. */
static inline bool ldc_is_in_image(const float normal[3], int axis)
{
    float maximum = fmaxf(fabsf(normal[0]), fmaxf(fabsf(normal[1]), fabsf(normal[2])));
    return fabsf(normal[axis]) >= AXES_OVERLAP * maximum;
}

/* An edge that two share is one's only. */
static inline void ldc_add_to_image(struct ldc_samples *s, int axis, double p[3][3], const double normal[3],
                                    const float unit[3], uint32_t material)
{
    const int iu = (axis + 1) % 3, iv = (axis + 2) % 3;
    double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
    for (int c = 0; c < 3; c++) {
        low[0] = fmin(low[0], p[c][iu]), high[0] = fmax(high[0], p[c][iu]);
        low[1] = fmin(low[1], p[c][iv]), high[1] = fmax(high[1], p[c][iv]);
    }
    const long last = (long)s->resolution - 1;
    const double sign = normal[axis] > 0 ? 1 : -1;
    for (long v = lrint(fmax(ceil(low[1] - 0.5), 0)); v <= last && (double)v + 0.5 <= high[1]; v++) {
        for (long u = lrint(fmax(ceil(low[0] - 0.5), 0)); u <= last && (double)u + 0.5 <= high[0]; u++) {
            bool in = true;
            for (int c = 0; c < 3 && in; c++) {
                const double *a = p[c], *b = p[(c + 1) % 3];
                double du = (b[iu] - a[iu]) * sign, dv = (b[iv] - a[iv]) * sign;
                double edge = du * ((double)v + 0.5 - a[iv]) - dv * ((double)u + 0.5 - a[iu]);
                in = edge > 0 || (edge == 0 && (dv > 0 || (dv == 0 && du < 0)));
            }
            if (!in)
                continue;
            double depth = p[0][axis] - (normal[iu] * ((double)u + 0.5 - p[0][iu]) +
                                         normal[iv] * ((double)v + 0.5 - p[0][iv])) /
                                            normal[axis];
            if (depth >= 0 && depth <= (double)s->resolution)
                ldc_add_sample(s, axis, (uint32_t)u, (uint32_t)v, (float)depth, unit, material);
        }
    }
}

/* World space. */
static inline void ldc_add_triangle(struct ldc_samples *s, const float corners[3][3], uint32_t material)
{
    double p[3][3], normal[3];
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++)
            p[c][k] = ((double)corners[c][k] - s->lower[k]) / s->cell;
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        normal[k] = (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) - (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
    }
    double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    if (!(length > 0))
        return;
    const float unit[3] = {(float)(normal[0] / length), (float)(normal[1] / length), (float)(normal[2] / length)};
    for (int axis = 0; axis < 3; axis++)
        if (ldc_is_in_image(unit, axis))
            ldc_add_to_image(s, axis, p, normal, unit, material);
}

static inline int ldc_by_texel(const void *a, const void *b)
{
    const struct ldc_sample *x = a, *y = b;
    if (x->texel != y->texel)
        return x->texel < y->texel ? -1 : 1;
    return x->depth < y->depth ? -1 : x->depth > y->depth;
}

static inline bool ldc_append(struct gpu_device *on, struct gpu_buffer *buffer, size_t kept_bytes,
                              const void *data, size_t bytes, struct error *error)
{
    char *whole = malloc(kept_bytes + bytes + 16);
    if (kept_bytes)
        gpu_buffer_read(on, buffer, 0, whole, kept_bytes);
    memcpy(whole + kept_bytes, data, bytes);
    bool ok = gpu_buffer_upload(on, buffer, whole, kept_bytes + bytes, error);
    free(whole);
    return ok;
}

/* Sorts the list and writes it as cube `which`, behind the one before it. */
static inline bool ldc_upload(struct ldc_samples *s, struct ldc_store *store, unsigned which, struct error *error)
{
    struct ldc_cube *cube = &store->cubes[which];
    const struct ldc_cube *before = which ? &store->cubes[which - 1] : NULL;
    *cube =
        (struct ldc_cube){.cell_world = s->cell, .resolution = s->resolution, .sample_count = (uint32_t)s->count};
    memcpy(cube->lower_world, s->lower, sizeof(s->lower));
    if (before && before->resolution) {
        cube->first_texel = before->first_texel + 3 * before->resolution * before->resolution;
        cube->first_sample = before->first_sample + before->sample_count;
        cube->first_quad = before->first_quad + before->quad_count;
    }
    if (s->count > 1)
        qsort(s->list, s->count, sizeof(*s->list), ldc_by_texel);
    const size_t texel_count = 3 * (size_t)s->resolution * s->resolution;
    uint32_t(*texels)[4] = calloc(texel_count, sizeof(*texels)),
    (*geometry)[2] = malloc((s->count + 1) * sizeof(*geometry));
    uint32_t(*surface)[4] = malloc((s->count + 1) * sizeof(*surface));
    float(*quads)[4] = malloc((s->count + 1) * sizeof(*quads));
    uint32_t quad = 0;
    for (size_t t = 0, i = 0; t < texel_count; t++) {
        const size_t first = i;
        for (; i < s->count && s->list[i].texel == t; i++) {
            memcpy(&geometry[i][0], &s->list[i].depth, 4);
            geometry[i][1] = s->list[i].normal;
            memcpy(surface[i], s->list[i].surface, sizeof(surface[i]));
        }
        const size_t count = i - first;
        const float range[2] = {count ? s->list[first].depth : LDC_NO_DEPTH,
                                count ? s->list[i - 1].depth : -LDC_NO_DEPTH};
        texels[t][0] = cube->first_sample + (uint32_t)first;
        texels[t][1] = (uint32_t)count | (cube->first_quad + quad) << LDC_TEXEL_QUAD_SHIFT;
        memcpy(&texels[t][2], range, sizeof(range));
        for (size_t k = 0; k < (count + 3) / 4 * 4; k++)
            quads[quad + k / 4][k % 4] = k < count ? s->list[first + k].depth : LDC_NO_DEPTH;
        quad += (uint32_t)(count + 3) / 4;
    }
    cube->quad_count = quad;
    bool ok = ldc_append(store->device, &store->texels, cube->first_texel * sizeof(*texels), texels,
                         texel_count * sizeof(*texels), error) &&
              ldc_append(store->device, &store->quads, cube->first_quad * sizeof(*quads), quads,
                         quad * sizeof(*quads), error) &&
              ldc_append(store->device, &store->geometry, cube->first_sample * sizeof(*geometry), geometry,
                         s->count * sizeof(*geometry), error) &&
              ldc_append(store->device, &store->surface, cube->first_sample * sizeof(*surface), surface,
                         s->count * sizeof(*surface), error);
    free(texels);
    free(geometry);
    free(surface);
    free(quads);
    return ok;
}

#endif
