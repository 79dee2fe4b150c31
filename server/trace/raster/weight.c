/* SPDX-License-Identifier: MIT */
#include "trace/raster/weight.h"

#include <math.h>
#include <string.h>

/* A ball in view space, and the area of the surfaces in it. */
struct ball {
    float centre[3], radius, area;
};

void raster_sight_begin(struct raster_sight *sight, const struct frame_uniforms *frame)
{
    *sight = (struct raster_sight){.near = frame->extent_near[2],
                                   .orthographic = frame->extent_near[3] != 0.0f,
                                   .pixels = (float)frame->view_width * (float)frame->view_height};
    for (int axis = 0; axis < 2; axis++)
        sight->extent[axis] = frame->extent_near[axis];
    sight->unit_area = sight->pixels / (4.0f * sight->extent[0] * sight->extent[1]);
    if (!sight->orthographic) /* a surface at the picture's corner may face the eye */
        sight->unit_area *=
            sqrtf(1.0f + sight->extent[0] * sight->extent[0] + sight->extent[1] * sight->extent[1]);
    float *m = sight->view_from_world;
    for (int row = 0; row < 3; row++) {
        m[4 * row + 3] = 0.0f;
        for (int k = 0; k < 3; k++) {
            m[4 * row + k] = frame->world_from_view[k][row];
            m[4 * row + 3] -= frame->world_from_view[k][row] * frame->world_from_view[k][3];
        }
    }
}

static float diagonal_squared(const float lower[3], const float upper[3])
{
    float sum = 0.0f;
    for (int k = 0; k < 3; k++)
        sum += (upper[k] - lower[k]) * (upper[k] - lower[k]);
    return sum;
}

void raster_sight_take(struct raster_sight *sight, const struct gpu_scene *scene, uint32_t instance)
{
    const struct instance *placed = &scene->instances[instance];
    const struct gpu_scene_geometry *geometry = &scene->geometries[placed->geometry];
    const float *view = sight->view_from_world;
    float squared = 0.0f;
    for (int column = 0; column < 4; column++) {
        float length = 0.0f;
        for (int row = 0; row < 3; row++) {
            float sum = column == 3 ? view[4 * row + 3] : 0.0f;
            for (int k = 0; k < 3; k++)
                sum += view[4 * row + k] * placed->world_from_object[k][column];
            sight->from_object[4 * row + column] = sum;
            length += sum * sum;
        }
        if (column < 3 && length > squared)
            squared = length;
    }
    sight->scale = sqrtf(squared);
    sight->geometry = geometry;
    sight->swelling = 1.0f;
    if (geometry->node) {
        const float rest = diagonal_squared(geometry->mesh->lower, geometry->mesh->upper);
        sight->swelling = rest > 0.0f ? diagonal_squared(geometry->lower, geometry->upper) / rest : INFINITY;
    }
}

/* Share of the picture's width or height between two tangents. */
static float share(float from, float to, float extent)
{
    from = fmaxf(from, -extent);
    to = fminf(to, extent);
    return to > from ? (to - from) / (2.0f * extent) : 0.0f;
}

/* Pixels of all surfaces in a ball; *each: maximum that one of them may cover. */
static float pixels_of(const struct raster_sight *sight, const struct ball *ball, float *each)
{
    const float first = -ball->centre[2] - ball->radius, last = -ball->centre[2] + ball->radius;
    float all = INFINITY;
    *each = sight->pixels;
    if (last < sight->near)
        return *each = 0.0f;
    if (!sight->orthographic && !(first > sight->near))
        return all;
    const float nearest = sight->orthographic ? 1.0f : first, farthest = sight->orthographic ? 1.0f : last;
    for (int axis = 0; axis < 2; axis++) {
        const float from = ball->centre[axis] - ball->radius, to = ball->centre[axis] + ball->radius;
        *each *=
            share(fminf(from / nearest, from / farthest), fmaxf(to / nearest, to / farthest), sight->extent[axis]);
    }
    return sight->unit_area * ball->area / (nearest * nearest);
}

/* The smaller of both bounds; values that are not finite count as the whole picture. */
static float pixels_each(const struct raster_sight *sight, const struct ball *ball, uint32_t count)
{
    float each, all = pixels_of(sight, ball, &each) / (float)count;
    each = each >= 0.0f ? each : sight->pixels;
    return all < each ? all : each;
}

static void to_view(const float m[12], const float point[3], float out[3])
{
    for (int row = 0; row < 3; row++)
        out[row] = m[4 * row] * point[0] + m[4 * row + 1] * point[1] + m[4 * row + 2] * point[2] + m[4 * row + 3];
}

float raster_pixels_of_run(const struct raster_sight *sight, uint32_t run)
{
    const struct gpu_scene_geometry *geometry = sight->geometry;
    const struct geometry_run *own = &geometry->runs[run];
    const uint32_t left = geometry->device.primitive_count - run * GEOMETRY_RUN;
    struct ball ball = {.radius = own->radius * sight->scale,
                        .area = own->area * sight->scale * sight->scale * sight->swelling};
    float centre[3];
    memcpy(centre, own->centre, sizeof(centre));
    if (geometry->node) { /* a run of a deforming mesh may be anywhere in the bounds */
        for (int k = 0; k < 3; k++)
            centre[k] = 0.5f * (geometry->lower[k] + geometry->upper[k]);
        ball.radius = 0.5f * sqrtf(diagonal_squared(geometry->lower, geometry->upper)) * sight->scale;
    }
    to_view(sight->from_object, centre, ball.centre);
    return pixels_each(sight, &ball, left < GEOMETRY_RUN ? left : GEOMETRY_RUN);
}

/* A disc is drawn as a square. */
float raster_pixels_of_disc(const struct raster_sight *sight, const struct disc *disc)
{
    const float radius = disc->centre_radius[3];
    struct ball ball = {.radius = radius * 1.4143f, .area = 4.0f * radius * radius};
    to_view(sight->view_from_world, disc->centre_radius, ball.centre);
    return pixels_each(sight, &ball, 1);
}
