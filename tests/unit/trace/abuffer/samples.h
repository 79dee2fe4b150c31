/* SPDX-License-Identifier: MIT */
/* A-buffers made on the CPU from triangles, as abuffer/layout.h has them, and what rays meet of the triangles
 * themselves: for the tests of the traversal. */
#ifndef FARLIGHT_TESTS_ABUFFER_SAMPLES_H
#define FARLIGHT_TESTS_ABUFFER_SAMPLES_H

#include "abuffer/layout.h"
#include "raster/layout.h"
#include "trace/abuffer/store.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct abuffer_sample {
    uint32_t texel; /* of all three images, row after row */
    float depth;    /* cells */
    float normal[3];
    uint32_t id; /* triangle */
    bool is_body;
};

struct abuffer_triangle {
    double corners[3][3]; /* cells */
    float unit[3];
    bool is_body;
};

struct abuffer_samples {
    uint32_t resolution, voxels_along;
    bool all_of_one; /* primitive of the scene on the device, the first */
    struct abuffer_triangle *triangles;
    struct abuffer_sample *list;
    size_t triangle_count, triangle_room, count, room;
};

static inline void abuffer_free(struct abuffer_samples *s)
{
    free(s->triangles);
    free(s->list);
    *s = (struct abuffer_samples){0};
}

static inline void abuffer_add_sample(struct abuffer_samples *s, uint32_t texel, float depth, uint32_t id)
{
    const struct abuffer_triangle *t = &s->triangles[id];
    if (s->count == s->room) {
        s->room = s->room ? 2 * s->room : 1 << 16;
        s->list = realloc(s->list, s->room * sizeof(*s->list));
    }
    s->list[s->count++] =
        (struct abuffer_sample){texel, depth, {t->unit[0], t->unit[1], t->unit[2]}, id, t->is_body};
}

/* An edge that two share is one's only. */
static inline void abuffer_rasterise(struct abuffer_samples *s, int axis, const double normal[3], uint32_t id)
{
    const double(*p)[3] = (const double(*)[3])s->triangles[id].corners;
    const int iu = (axis + 1) % 3, iv = (axis + 2) % 3;
    const long n = (long)s->resolution;
    double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
    for (int c = 0; c < 3; c++) {
        low[0] = fmin(low[0], p[c][iu]), high[0] = fmax(high[0], p[c][iu]);
        low[1] = fmin(low[1], p[c][iv]), high[1] = fmax(high[1], p[c][iv]);
    }
    if (normal[axis] == 0)
        return;
    const double sign = normal[axis] > 0 ? 1 : -1;
    for (long v = lrint(fmax(ceil(low[1] - 0.5), 0)); v < n && (double)v + 0.5 <= high[1]; v++) {
        for (long u = lrint(fmax(ceil(low[0] - 0.5), 0)); u < n && (double)u + 0.5 <= high[0]; u++) {
            bool in = true;
            for (int c = 0; c < 3 && in; c++) {
                const double *a = p[c], *b = p[(c + 1) % 3];
                /* Told from the same end by both that share it. */
                bool turned = a[iu] > b[iu] || (a[iu] == b[iu] && a[iv] > b[iv]);
                const double *o = turned ? b : a;
                double du = b[iu] - a[iu], dv = b[iv] - a[iv];
                double edge = sign * (du * ((double)v + 0.5 - o[iv]) - dv * ((double)u + 0.5 - o[iu]));
                in = edge > 0 || (edge == 0 && (sign * dv > 0 || (dv == 0 && sign * du < 0)));
            }
            if (!in)
                continue;
            double depth = p[0][axis] - (normal[iu] * ((double)u + 0.5 - p[0][iu]) +
                                         normal[iv] * ((double)v + 0.5 - p[0][iv])) /
                                            normal[axis];
            if (depth >= 0 && depth <= (double)n)
                abuffer_add_sample(s, (uint32_t)((axis * n + v) * n + u), (float)depth, id);
        }
    }
}

/* In cells. */
static inline void abuffer_add_triangle(struct abuffer_samples *s, const double corners[3][3], bool is_body)
{
    double normal[3], length = 0;
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        normal[k] = (corners[1][i] - corners[0][i]) * (corners[2][j] - corners[0][j]) -
                    (corners[1][j] - corners[0][j]) * (corners[2][i] - corners[0][i]);
        length += normal[k] * normal[k];
    }
    length = sqrt(length);
    if (!(length > 0))
        return;
    if (s->triangle_count == s->triangle_room) {
        s->triangle_room = s->triangle_room ? 2 * s->triangle_room : 1 << 12;
        s->triangles = realloc(s->triangles, s->triangle_room * sizeof(*s->triangles));
    }
    struct abuffer_triangle *t = &s->triangles[s->triangle_count];
    memcpy(t->corners, corners, sizeof(t->corners));
    for (int k = 0; k < 3; k++)
        t->unit[k] = (float)(normal[k] / length);
    t->is_body = is_body;
    for (int axis = 0; axis < 3; axis++)
        abuffer_rasterise(s, axis, normal, (uint32_t)s->triangle_count);
    s->triangle_count++;
}

static inline int abuffer_by_texel(const void *a, const void *b)
{
    const struct abuffer_sample *x = a, *y = b;
    if (x->texel != y->texel)
        return x->texel < y->texel ? -1 : 1;
    if (x->depth != y->depth)
        return x->depth < y->depth ? -1 : 1;
    return x->id < y->id ? -1 : x->id > y->id;
}

static inline uint32_t abuffer_pack_normal(const float n[3])
{
    float sum = fabsf(n[0]) + fabsf(n[1]) + fabsf(n[2]), p[2] = {n[0] / sum, n[1] / sum};
    if (n[2] < 0) {
        float x = (1 - fabsf(p[1])) * (p[0] >= 0 ? 1.0f : -1.0f),
              y = (1 - fabsf(p[0])) * (p[1] >= 0 ? 1.0f : -1.0f);
        p[0] = x;
        p[1] = y;
    }
    return ((uint32_t)lrintf(p[0] * 2047) & 0xfff) | ((uint32_t)lrintf(p[1] * 2047) & 0xfff) << 12;
}

static inline void abuffer_sum(const struct abuffer_samples *s, int32_t (*sums)[4],
                               uint32_t (*subvoxels)[ABUFFER_SUBVOXELS_TEXELS][2], const struct abuffer_sample *at)
{
    const uint32_t n = s->resolution, axis = at->texel / (n * n), iu = (axis + 1) % 3, iv = (axis + 2) % 3;
    const float voxel = (float)n / (float)s->voxels_along;
    float size[3], maximum = 0, low[3], high[3], middle[3];
    int first[3], last[3], own[3], inner_first[3], inner_last[3];
    uint32_t dominant_axis = 0;
    for (uint32_t k = 0; k < 3; k++) {
        size[k] = fabsf(at->normal[k]);
        if (size[k] > maximum) {
            maximum = size[k];
            dominant_axis = k;
        }
    }
    middle[iu] = (float)(at->texel % n) + 0.5f;
    middle[iv] = (float)(at->texel / n % n) + 0.5f;
    middle[axis] = at->depth;
    const float half = 0.5f + ABUFFER_SLACK;
    const float span = (1 + 2 * ABUFFER_SLACK) / AXES_OVERLAP;
    float reach = half * (size[iu] + size[iv]) / size[axis];
    reach = reach < span ? reach : span;
    for (uint32_t k = 0; k < 3; k++) {
        low[k] = middle[k] - (k == axis ? reach : half);
        high[k] = middle[k] + (k == axis ? reach : half);
        const float end = (float)(s->voxels_along - 1);
        first[k] = (int)fminf(fmaxf(low[k] / voxel, 0), end);
        last[k] = (int)fminf(fmaxf(high[k] / voxel, 0), end);
        inner_first[k] = (int)fminf(fmaxf(4 * low[k] / voxel, 0), 4 * end + 3);
        inner_last[k] = (int)fminf(fmaxf(4 * high[k] / voxel, 0), 4 * end + 3);
        own[k] = (int)fminf(fmaxf(middle[k] / voxel, 0), end);
    }
    uint32_t bits = at->is_body ? 0 : ABUFFER_SUM_OPEN;
    for (uint32_t k = 0; k < 3; k++) {
        if (size[k] >= AXES_OVERLAP * maximum)
            bits |= (ABUFFER_SUM_LEANS | (at->normal[k] > 0 ? ABUFFER_SUM_UP : ABUFFER_SUM_DOWN)) << k;
        bits |= size[k] < ABUFFER_STEEP ? ABUFFER_SUM_STEEP << k : 0;
    }
    const int along = (int)s->voxels_along;
    for (int z = inner_first[2]; z <= inner_last[2]; z++)
        for (int y = inner_first[1]; y <= inner_last[1]; y++)
            for (int x = inner_first[0]; x <= inner_last[0]; x++)
                subvoxels[(z / 4 * along + y / 4) * along + x / 4][dominant_axis][z / 2 % 2] |=
                    1u << (x % 4 + 4 * (y % 4) + 16 * (z % 2));
    for (int z = first[2]; z <= last[2]; z++)
        for (int y = first[1]; y <= last[1]; y++)
            for (int x = first[0]; x <= last[0]; x++) {
                int32_t *sum = sums[(z * along + y) * along + x];
                sum[3] |= (int32_t)bits;
                if (axis == dominant_axis && x == own[0] && y == own[1] && z == own[2])
                    for (int k = 0; k < 3; k++)
                        sum[k] += (int32_t)lrintf(at->normal[k] * ABUFFER_NORMAL_UNIT);
            }
}

/* All but the voxels. A cell is `cell_world` wide, and the cube begins at the origin. */
static inline bool abuffer_upload(struct abuffer_samples *s, struct abuffer_store *store, float cell_world,
                                  struct error *error)
{
    const uint32_t n = s->resolution, tiles = ABUFFER_TILES_ALONG(n);
    const size_t texel_count = 3 * (size_t)tiles * tiles * ABUFFER_TILE_TEXELS;
    const size_t voxel_count = (size_t)s->voxels_along * s->voxels_along * s->voxels_along;
    uint32_t(*texels)[2] = calloc(texel_count, sizeof(*texels));
    uint32_t(*samples)[2] = calloc(s->count + 1, sizeof(*samples)), *ids = calloc(s->count + 1, sizeof(*ids));
    int32_t(*sums)[4] = calloc(voxel_count, sizeof(*sums));
    uint32_t(*subvoxels)[ABUFFER_SUBVOXELS_TEXELS][2] = calloc(voxel_count, sizeof(*subvoxels));
    const uint32_t drawn[4] = {0, 0, 0,
                               DRAWN_SPHERES}; /* no triangles that an intersection would be held against */
    store->cell_world = cell_world;
    store->resolution = s->resolution;
    store->voxels_along = s->voxels_along;
    store->sample_count = s->count;
    store->depth_max = 0;
    store->drawn_count = 1;
    if (s->count > 1)
        qsort(s->list, s->count, sizeof(*s->list), abuffer_by_texel);
    for (size_t t = 0, i = 0; t < 3 * (size_t)n * n; t++) {
        const size_t first = i, axis = t / ((size_t)n * n);
        uint32_t *words = texels[ABUFFER_TEXEL(tiles, (uint32_t)axis, (uint32_t)(t % n), (uint32_t)(t / n % n))];
        int winding = 0;
        for (; i < s->count && s->list[i].texel == t; i++) {
            const struct abuffer_sample *at = &s->list[i];
            winding += at->is_body ? (at->normal[axis] < 0 ? 1 : -1) : 0;
            memcpy(&samples[i][0], &at->depth, 4);
            samples[i][1] = abuffer_pack_normal(at->normal) |
                            (uint32_t)(winding + ABUFFER_WINDING_ZERO) << ABUFFER_WINDING_SHIFT |
                            (at->is_body ? ABUFFER_SAMPLE_BODY : 0);
            ids[i] = s->all_of_one ? 0 : at->id;
            abuffer_sum(s, sums, subvoxels, at);
        }
        words[0] = (uint32_t)first;
        words[1] = (uint32_t)(i - first);
        if (words[1] > store->depth_max)
            store->depth_max = words[1];
    }
    const bool has_subvoxels = abuffer_has_subvoxels(store);
    if (!has_subvoxels)
        memset(subvoxels, 0xff, sizeof(*subvoxels));
    bool ok = gpu_buffer_upload(store->device, &store->texels, texels, texel_count * sizeof(*texels), error) &&
              gpu_buffer_upload(store->device, &store->samples, samples,
                                (s->count + s->count % 2) * sizeof(*samples), error) &&
              gpu_buffer_upload(store->device, &store->ids, ids, s->count * sizeof(*ids), error) &&
              gpu_buffer_upload(store->device, &store->drawn, drawn, sizeof(drawn), error) &&
              gpu_buffer_upload(store->device, &store->subvoxels, subvoxels,
                                (has_subvoxels ? voxel_count : 1) * sizeof(*subvoxels), error) &&
              gpu_buffer_upload(store->device, &store->sums, sums, voxel_count * sizeof(*sums), error);
    free(texels);
    free(samples);
    free(ids);
    free(sums);
    free(subvoxels);
    return ok;
}

/* ---- the triangles themselves ---- */

/* Places and direction in cells; distance in lengths of the direction, infinite: nothing is met. `side` > 0: from
 * behind. */
struct exact_hit {
    double distance, side;
    size_t triangle;
};

/* So many triangles in a row lie in a ball, past which most rays go. */
#define BALL_TRIANGLES ((size_t)16)

struct abuffer_ball {
    double centre[3], radius;
};

/* free() */
static inline struct abuffer_ball *abuffer_balls(const struct abuffer_samples *s)
{
    const size_t count = (s->triangle_count + BALL_TRIANGLES - 1) / BALL_TRIANGLES;
    struct abuffer_ball *balls = calloc(count + 1, sizeof(*balls));
    for (size_t i = 0; balls && i < s->triangle_count; i++) {
        struct abuffer_ball *ball = &balls[i / BALL_TRIANGLES];
        if (i % BALL_TRIANGLES == 0) /* as good as any */
            memcpy(ball->centre, s->triangles[i].corners[0], sizeof(ball->centre));
        for (int c = 0; c < 3; c++) {
            const double *p = s->triangles[i].corners[c];
            const double away[3] = {p[0] - ball->centre[0], p[1] - ball->centre[1], p[2] - ball->centre[2]};
            const double length = sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]);
            ball->radius = fmax(ball->radius, length + 1e-3); /* far more than is lost by rounding */
        }
    }
    return balls;
}

static inline bool passes_ball(const struct abuffer_ball *ball, const double o[3], const double d[3])
{
    double across = 0, along = 0;
    for (int k = 0; k < 3; k++) {
        const int x = (k + 1) % 3, y = (k + 2) % 3;
        const double part = (ball->centre[x] - o[x]) * d[y] - (ball->centre[y] - o[y]) * d[x];
        across += part * part;
        along += d[k] * d[k];
    }
    return across > ball->radius * ball->radius * along;
}

static inline void meet_triangle(const struct abuffer_samples *s, size_t i, const double o[3], const double d[3],
                                 double t_min, double t_max, struct exact_hit *best)
{
    const struct abuffer_triangle *t = &s->triangles[i];
    double slope = 0, height = 0;
    for (int k = 0; k < 3; k++) {
        slope += (double)t->unit[k] * d[k];
        height += (double)t->unit[k] * (t->corners[0][k] - o[k]);
    }
    const double distance = height / slope;
    if (!(distance > t_min && distance < t_max && distance < best->distance))
        return;
    for (int c = 0; c < 3; c++) {
        const double *a = t->corners[c], *b = t->corners[(c + 1) % 3];
        double inside = 0;
        for (int k = 0; k < 3; k++) {
            int x = (k + 1) % 3, y = (k + 2) % 3;
            inside += (double)t->unit[k] * ((b[x] - a[x]) * (o[y] + distance * d[y] - a[y]) -
                                            (b[y] - a[y]) * (o[x] + distance * d[x] - a[x]));
        }
        if (!(inside >= -1e-9))
            return;
    }
    *best = (struct exact_hit){distance, slope, i};
}

/* Brute force, but for balls that the ray passes. */
static inline struct exact_hit abuffer_exact(const struct abuffer_samples *s, const struct abuffer_ball *balls,
                                             const double o[3], const double d[3], double t_min, double t_max)
{
    struct exact_hit best = {.distance = INFINITY};
    for (size_t first = 0; first < s->triangle_count; first += BALL_TRIANGLES) {
        const size_t left = s->triangle_count - first, count = left < BALL_TRIANGLES ? left : BALL_TRIANGLES;
        for (size_t i = 0; i < count && (i > 0 || !passes_ball(&balls[first / BALL_TRIANGLES], o, d)); i++)
            meet_triangle(s, first + i, o, d, t_min, t_max, &best);
    }
    return best;
}

#endif
