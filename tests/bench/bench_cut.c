/* SPDX-License-Identifier: MIT */
#include "tests/bench/bench_cut.h"

#include "tests/accuracy/test_scenes.h"

#include <stdlib.h>
#include <string.h>

#define TRIANGLES_MAX ((size_t)1 << 23)

struct corner {
    float at[3];
};

struct cutter {
    float longest_squared;
    struct corner (*triangles)[3];
    size_t count, capacity;
};

static float squared_length(struct corner a, struct corner b)
{
    float sum = 0;
    for (int k = 0; k < 3; k++)
        sum += (b.at[k] - a.at[k]) * (b.at[k] - a.at[k]);
    return sum;
}

/* The same to the bit from either side of the edge. */
static struct corner middle(struct corner a, struct corner b)
{
    for (int k = 0; k < 3; k++)
        a.at[k] = (a.at[k] + b.at[k]) / 2;
    return a;
}

static bool keep(struct cutter *cutter, const struct corner t[3])
{
    if (cutter->count == cutter->capacity) {
        const size_t capacity = cutter->capacity ? 2 * cutter->capacity : 1024;
        if (capacity > TRIANGLES_MAX)
            return false;
        void *grown = realloc(cutter->triangles, capacity * sizeof(*cutter->triangles));
        if (!grown)
            return false;
        cutter->triangles = grown;
        cutter->capacity = capacity;
    }
    memcpy(cutter->triangles[cutter->count++], t, sizeof(*cutter->triangles));
    return true;
}

static bool cut(struct cutter *cutter, const struct corner t[3])
{
    int longest = 0; /* the edge from this corner to the next */
    float lengths[3];
    for (int k = 0; k < 3; k++) {
        lengths[k] = squared_length(t[k], t[(k + 1) % 3]);
        longest = lengths[k] > lengths[longest] ? k : longest;
    }
    if (lengths[longest] <= cutter->longest_squared)
        return keep(cutter, t);
    const struct corner a = t[longest], b = t[(longest + 1) % 3], c = t[(longest + 2) % 3], m = middle(a, b);
    return cut(cutter, (const struct corner[3]){a, m, c}) && cut(cutter, (const struct corner[3]){m, b, c});
}

static struct corner in_world(const float m[12], const float p[3])
{
    struct corner corner;
    for (int k = 0; k < 3; k++)
        corner.at[k] = m[4 * k] * p[0] + m[4 * k + 1] * p[1] + m[4 * k + 2] * p[2] + m[4 * k + 3];
    return corner;
}

static bool cut_instance(struct cutter *cutter, const struct gpu_scene *scene, const struct instance *instance)
{
    const struct scene_mesh *mesh = scene->geometries[instance->geometry].mesh;
    uint32_t poses;
    const float *world_from_object = gpu_scene_poses(scene, instance, &poses)[0];
    bool fits = true;
    for (uint32_t i = 0; mesh && fits && i < mesh->triangle_count; i++) {
        const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data + 3 * (size_t)i;
        struct corner t[3];
        for (int k = 0; k < 3; k++) {
            float p[3];
            memcpy(p, mesh->arrays[MESH_POSITIONS]->data + indices[k] * sizeof(p), sizeof(p));
            t[k] = in_world(world_from_object, p);
        }
        fits = cut(cutter, t);
    }
    return fits;
}

static struct scene *scene_of(const struct cutter *cutter)
{
    struct test_edits edits = {.scene = test_scene_create()};
    const uint32_t count = (uint32_t)cutter->count;
    uint32_t *indices = malloc(3 * (size_t)count * sizeof(*indices));
    if (edits.scene && indices) {
        for (uint32_t i = 0; i < 3 * count; i++)
            indices[i] = i;
        test_mesh(&edits, 1, (const float(*)[3])(const void *)cutter->triangles, 3 * count, indices, count);
        test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
        test_commit(&edits);
    }
    free(indices);
    return edits.scene;
}

struct scene *bench_cut_scene(const struct gpu_scene *scene, float edge_world, uint64_t *triangles,
                              struct error *error)
{
    struct cutter cutter = {.longest_squared = edge_world * edge_world};
    bool fits = true;
    for (uint32_t i = 0; fits && i < scene->instance_count; i++)
        fits = cut_instance(&cutter, scene, &scene->instances[i]);
    struct scene *made = fits && cutter.count > 0 ? scene_of(&cutter) : NULL;
    *triangles = cutter.count;
    free(cutter.triangles);
    if (!made)
        error_set(error, ERROR_LIMIT, "--cut", "no triangles, or more than %zu", TRIANGLES_MAX);
    return made;
}
