/* SPDX-License-Identifier: MIT */
#include "animated_parts.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265f

const struct glb_material parts_materials[PARTS_MATERIALS] = {
    [SLATE] = {"slate", {0.10f, 0.12f, 0.15f, 1}, 0, 0.22f, 0, 0, {0, 0, 0}},
    [CREAM] = {"cream", {0.66f, 0.58f, 0.45f, 1}, 0, 0.6f, 0, 0, {0, 0, 0}},
    [BLUE] = {"blue glaze", {0.05f, 0.17f, 0.50f, 1}, 0, 0.08f, 0, 0, {0, 0, 0}},
    [RED] = {"red glaze", {0.60f, 0.04f, 0.03f, 1}, 0, 0.12f, 0, 0, {0, 0, 0}},
    [GOLD] = {"gold", {1.0f, 0.77f, 0.34f, 1}, 1, 0.1f, 0, 0, {0, 0, 0}},
    [COPPER] = {"brushed copper", {0.95f, 0.60f, 0.45f, 1}, 1, 0.35f, 0, 0, {0, 0, 0}},
    [BRASS] = {"brass", {0.85f, 0.68f, 0.38f, 1}, 1, 0.25f, 0, 0, {0, 0, 0}},
    [JADE] = {"jade", {0.10f, 0.42f, 0.22f, 1}, 0, 0.3f, 0, 0, {0, 0, 0}},
    [GLOW] = {"glow", {0, 0, 0, 1}, 0, 1, 0, 0, {5, 3.4f, 1.6f}},
    [DARK] = {"iron", {0.12f, 0.12f, 0.13f, 1}, 0, 0.7f, 0, 0, {0, 0, 0}},
};

unsigned parts_mesh(struct gltf_writer *writer, const char *name, struct shape *shape,
                    enum parts_material material)
{
    const struct gltf_geometry geometry = gltf_geometry(writer, shape);
    shape_finish(shape);
    return gltf_mesh(writer, name, &geometry, material);
}

unsigned parts_lathe(struct gltf_writer *writer, const char *name, const float (*profile)[2], uint32_t count,
                     enum parts_material material)
{
    struct shape shape = {0};
    shape_lathe(&shape, profile, count, 64);
    return parts_mesh(writer, name, &shape, material);
}

unsigned parts_platform(struct gltf_writer *writer)
{
    /* Twice the same place makes an edge: normals are taken from the neighbours. */
    static const float profile[][2] = {{2.25f, 0},    {2.25f, 0.1f}, {2.25f, 0.1f},  {2.1f, 0.1f},   {2.1f, 0.1f},
                                       {2.1f, 0.24f}, {2.1f, 0.24f}, {2.06f, 0.27f}, {2.06f, 0.27f}, {0, 0.27f}};
    return parts_lathe(writer, "platform", profile, sizeof(profile) / sizeof(*profile), CREAM);
}

/* Rows of a ball about the axis, from where it is as wide as the neck that carries it. */
static void end_in_ball(float (*profile)[2], int rows, float centre_y, float radius, float neck)
{
    const float begin = asinf(neck / radius);
    for (int i = 0; i < rows; i++) {
        const float polar = begin + (PI - begin) * (float)i / (float)(rows - 1);
        profile[i][0] = i + 1 < rows ? radius * sinf(polar) : 0;
        profile[i][1] = centre_y - radius * cosf(polar);
    }
}

unsigned parts_column(struct gltf_writer *writer)
{
    enum { BALUSTER = 40, BALL = 24 };
    float profile[BALUSTER + BALL][2];
    for (int i = 0; i < BALUSTER; i++) {
        const float t = (float)i / BALUSTER;
        profile[i][0] = 0.36f - 0.26f * t + 0.09f * sinf(4.5f * PI * t) * (1 - t);
        profile[i][1] = 0.27f + 1.6f * t;
    }
    end_in_ball(profile + BALUSTER, BALL, 2.06f, 0.22f, 0.1f);
    return parts_lathe(writer, "column", (const float(*)[2])profile, BALUSTER + BALL, BRASS);
}

unsigned parts_balls(struct gltf_writer *writer, const char *name, const float circle[2], const float angles[2],
                     int count, float radius, enum parts_material material)
{
    struct shape shape = {0};
    for (int i = 0; i < count; i++) {
        const float angle = angles[0] + (angles[1] - angles[0]) * (float)i / (float)count;
        shape_sphere(&shape, (const float[3]){circle[0] * cosf(angle), circle[1], circle[0] * sinf(angle)}, radius,
                     20);
    }
    return parts_mesh(writer, name, &shape, material);
}

unsigned parts_wheel(struct gltf_writer *writer)
{
    enum { STEPS = 72, SPOKES = 6 };
    struct shape shape = {0};
    float path[STEPS + 1][3], radii[STEPS + 1];
    for (int i = 0; i <= STEPS; i++) {
        const float angle = 2 * PI * (float)i / STEPS;
        path[i][0] = 0.85f * cosf(angle);
        path[i][1] = 0.85f * sinf(angle);
        path[i][2] = 0;
        radii[i] = 0.06f;
    }
    shape_tube(&shape, (const float(*)[3])path, radii, STEPS + 1, 16);
    for (int i = 0; i < SPOKES; i++) {
        const float angle = 2 * PI * (float)i / SPOKES;
        const float spoke[2][3] = {{0, 0, 0}, {0.85f * cosf(angle), 0.85f * sinf(angle), 0}};
        shape_tube(&shape, spoke, (const float[2]){0.045f, 0.03f}, 2, 12);
    }
    shape_sphere(&shape, (const float[3]){0, 0, 0}, 0.13f, 24);
    return parts_mesh(writer, "wheel", &shape, RED);
}

static float smooth(float t)
{
    const float inside = fminf(fmaxf(t, 0), 1);
    return inside * inside * (3 - 2 * inside);
}

unsigned parts_reed(struct gltf_writer *writer)
{
    enum { STEM = 56, BALL = 24 };
    const float ball_radius = 0.19f;
    float profile[STEM + BALL][2];
    for (int i = 0; i < STEM; i++) {
        const float t = (float)i / STEM;
        profile[i][0] = 0.085f - 0.035f * t + 0.09f * expf(-18 * t);
        profile[i][1] = (PARTS_REED_HEIGHT - 1.97f * ball_radius) * t;
    }
    end_in_ball(profile + STEM, BALL, PARTS_REED_HEIGHT - ball_radius, ball_radius, 0.05f);
    struct shape shape = {0};
    shape_lathe(&shape, (const float(*)[2])profile, STEM + BALL, 32);
    struct gltf_geometry geometry = gltf_geometry(writer, &shape);
    uint8_t(*joints)[4] = calloc(shape.vertex_count, sizeof(*joints));
    float(*weights)[4] = calloc(shape.vertex_count, sizeof(*weights));
    if (joints && weights && !writer->failed) {
        for (uint32_t i = 0; i < shape.vertex_count; i++) {
            const float at = shape.positions[3 * (size_t)i + 1] * PARTS_JOINTS / PARTS_REED_HEIGHT - 0.5f;
            const float first = fminf(fmaxf(floorf(at), 0), PARTS_JOINTS - 2);
            const float second_weight = smooth(at - first);
            /* A joint that has no weight is to be joint 0. */
            joints[i][0] = second_weight < 1 ? (uint8_t)first : 0;
            joints[i][1] = second_weight > 0 ? (uint8_t)(first + 1) : 0;
            weights[i][0] = 1 - second_weight;
            weights[i][1] = second_weight;
        }
        geometry.joints = (int)gltf_joints(writer, (const uint8_t(*)[4])joints, shape.vertex_count);
        geometry.weights = (int)gltf_floats(writer, &weights[0][0], shape.vertex_count, 4, GLTF_VERTICES);
    }
    writer->failed |= !joints || !weights;
    free(joints);
    free(weights);
    shape_finish(&shape);
    return gltf_mesh(writer, "reed", &geometry, JADE);
}

/* Where the blob's skin in direction n is, as a target says. */
static void blob_place(float place[3], const float n[3], unsigned target)
{
    const float radius = 0.42f;
    if (target == 0) {
        const float waist = 0.62f + 0.2f * n[1] * n[1] + 0.16f * n[1];
        place[0] = radius * n[0] * waist;
        place[1] = radius * n[1] * 1.6f;
        place[2] = radius * n[2] * waist;
    } else {
        const float lobes = 1 + 0.55f * sinf(4.2f * n[0] + 0.6f) * sinf(4.2f * n[1]) * sinf(4.2f * n[2] + 0.9f);
        const float wide = 1.15f * radius * lobes;
        place[0] = wide * n[0];
        place[1] = 0.8f * wide * n[1];
        place[2] = wide * n[2];
    }
}

static void cross(float out[3], const float a[3], const float b[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static void normalise(float v[3])
{
    const float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

/* Normal of the target's surface, from places a little aside. */
static void blob_normal(float normal[3], const float n[3], unsigned target)
{
    const float aside = 0.01f;
    float u[3], v[3], ends[4][3], along_u[3], along_v[3];
    cross(u, fabsf(n[1]) < 0.9f ? (const float[3]){0, 1, 0} : (const float[3]){1, 0, 0}, n);
    normalise(u);
    cross(v, n, u);
    for (int i = 0; i < 4; i++) {
        const float *direction = i < 2 ? u : v;
        float beside[3];
        for (int c = 0; c < 3; c++)
            beside[c] = n[c] + (i % 2 ? aside : -aside) * direction[c];
        normalise(beside);
        blob_place(ends[i], beside, target);
    }
    for (int c = 0; c < 3; c++) {
        along_u[c] = ends[1][c] - ends[0][c];
        along_v[c] = ends[3][c] - ends[2][c];
    }
    cross(normal, along_u, along_v);
    normalise(normal);
}

unsigned parts_blob(struct gltf_writer *writer)
{
    struct shape shape = {0};
    shape_sphere(&shape, (const float[3]){0, 0, 0}, 0.42f, 64);
    struct gltf_geometry geometry = gltf_geometry(writer, &shape);
    float *offsets = malloc((size_t)shape.vertex_count * 6 * sizeof(*offsets));
    writer->failed |= !offsets;
    geometry.target_count = 2;
    for (unsigned target = 0; target < 2 && !writer->failed; target++) {
        float *to_places = offsets, *to_normals = offsets + 3 * (size_t)shape.vertex_count;
        for (size_t i = 0; i < 3 * (size_t)shape.vertex_count; i += 3) {
            blob_place(to_places + i, shape.normals + i, target);
            blob_normal(to_normals + i, shape.normals + i, target);
            for (size_t c = i; c < i + 3; c++) {
                to_places[c] -= shape.positions[c];
                to_normals[c] -= shape.normals[c];
            }
        }
        geometry.targets[target][0] = gltf_floats(writer, to_places, shape.vertex_count, 3, GLTF_VERTICES);
        geometry.targets[target][1] = gltf_floats(writer, to_normals, shape.vertex_count, 3, GLTF_VERTICES);
    }
    free(offsets);
    shape_finish(&shape);
    return gltf_mesh(writer, "blob", &geometry, GOLD);
}
