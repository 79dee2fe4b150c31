/* SPDX-License-Identifier: MIT */
#include "shape.h"

#include <assert.h>

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static const float two_pi = 6.28318530718f;

void shape_finish(struct shape *shape)
{
    free(shape->positions);
    free(shape->normals);
    free(shape->indices);
    memset(shape, 0, sizeof(*shape));
}

static bool grow(void **array, size_t count, size_t element_bytes)
{
    void *grown = realloc(*array, count * element_bytes);
    if (!grown)
        return false;
    *array = grown;
    return true;
}

static uint32_t add_vertex(struct shape *shape, const float position[3], const float normal[3])
{
    if (shape->vertex_count == shape->vertex_capacity) {
        const uint32_t capacity = shape->vertex_capacity ? shape->vertex_capacity * 2 : 256;
        if (!grow((void **)&shape->positions, capacity, 3 * sizeof(float)) ||
            !grow((void **)&shape->normals, capacity, 3 * sizeof(float))) {
            shape->out_of_memory = true;
            return 0;
        }
        shape->vertex_capacity = capacity;
    }
    memcpy(shape->positions + 3 * (size_t)shape->vertex_count, position, 3 * sizeof(float));
    memcpy(shape->normals + 3 * (size_t)shape->vertex_count, normal, 3 * sizeof(float));
    return shape->vertex_count++;
}

static void add_triangle(struct shape *shape, uint32_t a, uint32_t b, uint32_t c)
{
    if (shape->index_count + 3 > shape->index_capacity) {
        const uint32_t capacity = shape->index_capacity ? shape->index_capacity * 2 : 768;
        if (!grow((void **)&shape->indices, capacity, sizeof(uint32_t))) {
            shape->out_of_memory = true;
            return;
        }
        shape->index_capacity = capacity;
    }
    uint32_t *index = shape->indices + shape->index_count;
    index[0] = a;
    index[1] = b;
    index[2] = c;
    shape->index_count += 3;
}

static void subtract(float out[3], const float a[3], const float b[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] - b[i];
}

static void cross(float out[3], const float a[3], const float b[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void normalise(float v[3])
{
    const float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++)
        v[i] = length > 0 ? v[i] / length : 0;
}

void shape_quad(struct shape *shape, const float a[3], const float b[3], const float c[3], const float d[3])
{
    float ab[3], ad[3], normal[3];
    subtract(ab, b, a);
    subtract(ad, d, a);
    cross(normal, ab, ad);
    normalise(normal);
    const uint32_t ia = add_vertex(shape, a, normal), ib = add_vertex(shape, b, normal);
    const uint32_t ic = add_vertex(shape, c, normal), id = add_vertex(shape, d, normal);
    add_triangle(shape, ia, ib, ic);
    add_triangle(shape, ia, ic, id);
}

void shape_box(struct shape *shape, const float centre[3], const float half_size[3], float turn)
{
    float corners[8][3];
    for (int i = 0; i < 8; i++) {
        const float x = i & 1 ? half_size[0] : -half_size[0], z = i & 4 ? half_size[2] : -half_size[2];
        corners[i][0] = centre[0] + x * cosf(turn) + z * sinf(turn);
        corners[i][1] = centre[1] + (i & 2 ? half_size[1] : -half_size[1]);
        corners[i][2] = centre[2] - x * sinf(turn) + z * cosf(turn);
    }
    static const int faces[6][4] = {{4, 5, 7, 6}, {1, 0, 2, 3}, {5, 1, 3, 7},
                                    {0, 4, 6, 2}, {6, 7, 3, 2}, {0, 1, 5, 4}};
    for (int i = 0; i < 6; i++)
        shape_quad(shape, corners[faces[i][0]], corners[faces[i][1]], corners[faces[i][2]], corners[faces[i][3]]);
}

/* Joins a grid of `rows` x (columns + 1) vertices that begins at `first`; the last column repeats the first. */
static void join_grid(struct shape *shape, uint32_t first, uint32_t rows, uint32_t columns)
{
    for (uint32_t row = 0; row + 1 < rows; row++) {
        for (uint32_t column = 0; column < columns; column++) {
            const uint32_t a = first + row * (columns + 1) + column, b = a + 1;
            const uint32_t c = b + columns + 1, d = a + columns + 1;
            add_triangle(shape, a, c, b);
            add_triangle(shape, a, d, c);
        }
    }
}

/* Closes a grid's first or last row, of vertices from `first` on, with a flat disc. */
static void close_end(struct shape *shape, uint32_t first, uint32_t columns, const float centre[3],
                      const float normal[3], bool is_last)
{
    const uint32_t middle = add_vertex(shape, centre, normal);
    for (uint32_t i = 0; i <= columns && !shape->out_of_memory; i++) {
        float position[3];
        memcpy(position, shape->positions + 3 * (size_t)(first + i), sizeof(position));
        add_vertex(shape, position, normal);
    }
    for (uint32_t i = 1; i <= columns; i++)
        add_triangle(shape, middle, is_last ? middle + i + 1 : middle + i, is_last ? middle + i : middle + i + 1);
}

void shape_lathe(struct shape *shape, const float (*profile)[2], uint32_t profile_count, uint32_t segments)
{
    const uint32_t first = shape->vertex_count;
    for (uint32_t row = 0; row < profile_count; row++) {
        const uint32_t before = row ? row - 1 : 0, after = row + 1 < profile_count ? row + 1 : row;
        const float d_radius = profile[after][0] - profile[before][0];
        const float d_height = profile[after][1] - profile[before][1];
        for (uint32_t i = 0; i <= segments; i++) {
            const float angle = two_pi * (float)(i % segments) / (float)segments;
            const float position[3] = {profile[row][0] * cosf(angle), profile[row][1],
                                       profile[row][0] * sinf(angle)};
            float normal[3] = {d_height * cosf(angle), -d_radius, d_height * sinf(angle)};
            normalise(normal);
            add_vertex(shape, position, normal);
        }
    }
    join_grid(shape, first, profile_count, segments);
    const float *bottom = profile[0], *top = profile[profile_count - 1];
    if (bottom[0] > 0)
        close_end(shape, first, segments, (const float[3]){0, bottom[1], 0}, (const float[3]){0, -1, 0}, false);
    if (top[0] > 0)
        close_end(shape, first + (profile_count - 1) * (segments + 1), segments, (const float[3]){0, top[1], 0},
                  (const float[3]){0, 1, 0}, true);
}

void shape_sphere(struct shape *shape, const float centre[3], float radius, uint32_t segments)
{
    const uint32_t first = shape->vertex_count, rows = segments / 2 + 1;
    for (uint32_t row = 0; row < rows; row++) {
        const float polar = two_pi / 2 * (float)row / (float)(rows - 1);
        const float across =
            row + 1 < rows ? sinf(polar) : 0; /* a pole is one place: sinf() of PI leaves a hole */
        for (uint32_t i = 0; i <= segments; i++) {
            const float angle = two_pi * (float)(i % segments) / (float)segments;
            const float normal[3] = {across * cosf(angle), -cosf(polar), across * sinf(angle)};
            const float position[3] = {centre[0] + radius * normal[0], centre[1] + radius * normal[1],
                                       centre[2] + radius * normal[2]};
            add_vertex(shape, position, normal);
        }
    }
    join_grid(shape, first, rows, segments);
}

void shape_tube(struct shape *shape, const float (*path)[3], const float *radii, uint32_t path_count,
                uint32_t segments)
{
    const uint32_t first = shape->vertex_count;
    for (uint32_t row = 0; row < path_count; row++) {
        const uint32_t before = row ? row - 1 : 0, after = row + 1 < path_count ? row + 1 : row;
        float along[3], side[3], up[3];
        subtract(along, path[after], path[before]);
        normalise(along);
        /* The paths of the bundled scenes lie in planes of constant z. */
        cross(side, along, (const float[3]){0, 0, 1});
        normalise(side);
        cross(up, side, along);
        for (uint32_t i = 0; i <= segments; i++) {
            const float angle = two_pi * (float)(i % segments) / (float)segments;
            float normal[3], position[3];
            for (int axis = 0; axis < 3; axis++) {
                normal[axis] = cosf(angle) * side[axis] + sinf(angle) * up[axis];
                position[axis] = path[row][axis] + radii[row] * normal[axis];
            }
            add_vertex(shape, position, normal);
        }
    }
    join_grid(shape, first, path_count, segments);
    const uint32_t last = path_count - 1;
    float backwards[3], forwards[3];
    subtract(backwards, path[0], path[1]);
    subtract(forwards, path[last], path[last - 1]);
    normalise(backwards);
    normalise(forwards);
    close_end(shape, first, segments, path[0], backwards, false);
    close_end(shape, first + last * (segments + 1), segments, path[last], forwards, true);
}

/* Rings of the body and along spout and handle, enough for facets about as long as wide. */
#define MAX_RINGS 160

void shape_teapot(struct shape *shape, uint32_t segments)
{
    const uint32_t rings = segments > 96 ? segments * 5 / 12 : 40, steps = segments > 96 ? segments / 4 : 24;
    float profile[MAX_RINGS][2];
    assert(rings <= MAX_RINGS);
    for (uint32_t i = 0; i < rings; i++) { /* a squashed ball with a flat foot, its lid, and a knob */
        const float t = (float)i / (float)(rings - 1);
        const float body = powf(sinf(3.14159265f * (0.12f + 0.80f * t)), 0.8f);
        const float knob = t > 0.86f ? 0.13f * sqrtf(fmaxf(0, sinf(3.14159265f * (t - 0.86f) / 0.14f))) : 0;
        profile[i][0] = t > 0.86f ? knob + 0.02f * (1 - t) : body * (1 - 0.18f * t);
        profile[i][1] = t > 0.86f ? 0.98f + (t - 0.86f) * 1.6f : t * 1.14f;
    }
    shape_lathe(shape, (const float(*)[2])profile, rings, segments);
    float path[MAX_RINGS][3], radii[MAX_RINGS];
    for (uint32_t i = 0; i < steps; i++) { /* spout */
        const float t = (float)i / (float)(steps - 1);
        path[i][0] = 0.75f + 0.85f * t;
        path[i][1] = 0.38f + 0.62f * t * t * (3 - 2 * t);
        path[i][2] = 0;
        radii[i] = 0.2f - 0.12f * t;
    }
    shape_tube(shape, (const float(*)[3])path, radii, steps, segments / 3);
    for (uint32_t i = 0; i < steps; i++) { /* handle */
        const float angle = 1.0f + 3.9f * (float)i / (float)(steps - 1);
        path[i][0] = -0.72f + 0.62f * cosf(angle);
        path[i][1] = 0.58f + 0.36f * sinf(angle);
        radii[i] = 0.07f;
    }
    shape_tube(shape, (const float(*)[3])path, radii, steps, segments / 3);
}
