/* SPDX-License-Identifier: MIT */
/* The sky of models without an environment. */
#include "sky.h"

#include "import/image/half.h"
#include "import/model/placement.h"
#include "shaders/shared/sky.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ROWS 64u
#define COLUMNS 2u
#define DEPTH_MAX 1000 /* nesting of nodes, limited for hostile files */
/* Rays from a camera: up, and a little upward to each side. In a room all but one hit a surface. */
#define RAYS 5
#define RAYS_OF_A_ROOM 4
#define SLOPE 0.2
#define PI 3.14159265358979323846

/* ---- rooms ---- */

struct ray {
    double origin[3], direction[3];
};

static const struct message_set_node *node_of(const struct import_scene *scene, const size_t *edits, uint32_t node)
{
    const uint32_t last = scene->last_id[PROTOCOL_OBJECT_NODE];
    return node > 0 && node <= last && edits[node] > 0 ? &scene->edits[edits[node] - 1].message.set_node : NULL;
}

static struct placement world_from(const struct import_scene *scene, const size_t *edits,
                                   const struct message_set_node *node)
{
    struct placement world = placement_identity();
    for (int depth = 0; node && depth < DEPTH_MAX; depth++) {
        struct placement parent;
        for (int i = 0; i < 12; i++)
            parent.m[i] = (double)node->value.parent_from_node[i];
        world = placement_product(&parent, &world);
        node = node_of(scene, edits, node->value.parent);
    }
    return world;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Moller, Trumbore. Fast, Minimum Storage Ray/Triangle Intersection. 1997. */
static bool meets(const struct ray *ray, double corners[3][3])
{
    double edges[2][3], from[3], across[3], other[3];
    for (int i = 0; i < 3; i++) {
        edges[0][i] = corners[1][i] - corners[0][i];
        edges[1][i] = corners[2][i] - corners[0][i];
        from[i] = ray->origin[i] - corners[0][i];
    }
    cross(ray->direction, edges[1], across);
    cross(from, edges[0], other);
    const double determinant = dot(edges[0], across), u = dot(from, across) / determinant,
                 v = dot(ray->direction, other) / determinant;
    return u >= 0 && v >= 0 && u + v <= 1 && dot(edges[1], other) / determinant > 0; /* false for NaN */
}

static void mark_rays(const struct import_scene *scene, const struct import_edit *edit,
                      const struct placement *world, const struct ray rays[RAYS], bool met[RAYS])
{
    const struct message_set_mesh *mesh = &edit->message.set_mesh;
    if (edit->blobs[0] == 0 || edit->blobs[1] == 0)
        return;
    const float *positions = (const float *)(const void *)scene->blobs[edit->blobs[0] - 1].bytes;
    const uint32_t *indices = (const uint32_t *)(const void *)scene->blobs[edit->blobs[1] - 1].bytes;
    for (size_t i = 0; i < mesh->value.triangle_count; i++) {
        double corners[3][3];
        for (int k = 0; k < 3; k++)
            for (int row = 0; row < 3; row++) {
                const float *position = positions + (size_t)indices[3 * i + (size_t)k] * 3;
                corners[k][row] = world->m[row * 4 + 3];
                for (int c = 0; c < 3; c++)
                    corners[k][row] += world->m[row * 4 + c] * (double)position[c];
            }
        for (int ray = 0; ray < RAYS; ray++)
            met[ray] = met[ray] || meets(&rays[ray], corners);
    }
}

static bool is_in_a_room(const struct import_scene *scene, const size_t *node_edits, const size_t *mesh_edits,
                         const struct message_set_node *camera)
{
    static const double directions[RAYS][3] = {
        {0, 1, 0}, {1, SLOPE, 0}, {-1, SLOPE, 0}, {0, SLOPE, 1}, {0, SLOPE, -1}};
    const struct placement eye = world_from(scene, node_edits, camera);
    struct ray rays[RAYS];
    bool met[RAYS] = {false};
    int count = 0;
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            rays[i].origin[c] = eye.m[c * 4 + 3];
            rays[i].direction[c] = directions[i][c];
        }
    for (size_t i = 0; i < scene->edit_count; i++) {
        const struct message_set_node *node = &scene->edits[i].message.set_node;
        if (scene->edits[i].message.type != MESSAGE_SET_NODE || node->value.kind != PROTOCOL_NODE_MESH ||
            node->value.object > scene->last_id[PROTOCOL_OBJECT_MESH] || mesh_edits[node->value.object] == 0)
            continue;
        const struct placement world = world_from(scene, node_edits, node);
        mark_rays(scene, &scene->edits[mesh_edits[node->value.object] - 1], &world, rays, met);
    }
    for (int i = 0; i < RAYS; i++)
        count += met[i];
    return count >= RAYS_OF_A_ROOM;
}

static bool looks_from_a_room(const struct import_scene *scene)
{
    size_t *node_edits = calloc((size_t)scene->last_id[PROTOCOL_OBJECT_NODE] + 1, sizeof(*node_edits));
    size_t *mesh_edits = calloc((size_t)scene->last_id[PROTOCOL_OBJECT_MESH] + 1, sizeof(*mesh_edits));
    const struct message_set_node *camera = NULL;
    for (size_t i = 0; i < scene->edit_count && node_edits && mesh_edits; i++) {
        const struct message *message = &scene->edits[i].message;
        if (message->type == MESSAGE_SET_MESH)
            mesh_edits[message->set_mesh.mesh] = i + 1;
        if (message->type != MESSAGE_SET_NODE)
            continue;
        node_edits[message->set_node.node] = i + 1;
        if (!camera && message->set_node.value.kind == PROTOCOL_NODE_CAMERA)
            camera = &message->set_node;
    }
    const bool is = camera && node_edits && mesh_edits && is_in_a_room(scene, node_edits, mesh_edits, camera);
    free(node_edits);
    free(mesh_edits);
    return is;
}

/* ---- the sky ---- */

static bool has_environment(const struct import_scene *scene)
{
    for (size_t i = 0; i < scene->edit_count; i++)
        if (scene->edits[i].message.type == MESSAGE_SET_ENVIRONMENT)
            return true;
    return false;
}

static void sky_at(double up, float radiance[3])
{
    static const float zenith[3] = {SKY_ZENITH}, horizon[3] = {SKY_HORIZON}, ground[3] = {SKY_GROUND};
    const float share = (float)(up < 0 ? fmin(-up * (double)SKY_GROUND_SLOPE, 1) : up),
                *end = up < 0 ? ground : zenith;
    for (int c = 0; c < 3; c++)
        radiance[c] = horizon[c] + (end[c] - horizon[c]) * share;
}

void import_add_sky(struct import_scene *scene)
{
    const struct message_set_environment environment = {
        .value.colour = {1, 1, 1}, .value.width = COLUMNS, .value.height = ROWS};
    if (scene->failed || scene->last_id[PROTOCOL_OBJECT_LIGHT] == 0 || has_environment(scene) ||
        looks_from_a_room(scene))
        return;
    uint16_t *texels = calloc((size_t)ROWS * COLUMNS * 4, sizeof(*texels));
    for (uint32_t i = 0; texels && i < ROWS * COLUMNS; i++) {
        float radiance[3];
        sky_at(cos(PI * (i / COLUMNS + 0.5) / ROWS), radiance);
        for (int c = 0; c < 3; c++)
            texels[i * 4 + (uint32_t)c] = half_of_radiance(radiance[c]);
    }
    import_set_environment(scene, &environment,
                           import_add_blob(scene, texels, (uint64_t)ROWS * COLUMNS * 4 * sizeof(*texels)));
}
