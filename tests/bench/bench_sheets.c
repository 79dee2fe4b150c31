/* SPDX-License-Identifier: MIT */
#include "tests/bench/bench_sheets.h"

#include "tests/accuracy/test_scenes.h"

#include <math.h>

#define STEPS 32u /* of a sheet, each way */
#define WAVE 0.004f
#define MATERIAL_ID 0xfffffff0u
#define COLOUR 0.85f
#define INDEX_OF_REFRACTION 1.5f

/* ---- sheets ---- */

static void add_sheet(struct test_edits *edits, uint32_t number, uint32_t count)
{
    static float vertices[(STEPS + 1) * (STEPS + 1)][3];
    static uint32_t indices[STEPS * STEPS * 6];
    uint32_t *next = indices;
    for (uint32_t i = 0; i <= STEPS; i++) {
        for (uint32_t j = 0; j <= STEPS; j++) {
            const float x = (float)i / STEPS, y = (float)j / STEPS;
            float *v = vertices[i * (STEPS + 1) + j];
            v[0] = x;
            v[1] = y;
            /* Slopes of a twentieth: along z is what it leans to. */
            v[2] = ((float)number + 0.5f) / (float)count + WAVE * sinf(12 * x + (float)number) * cosf(12 * y);
        }
    }
    for (uint32_t i = 0; i < STEPS; i++) {
        for (uint32_t j = 0; j < STEPS; j++, next += 6) {
            const uint32_t a = i * (STEPS + 1) + j, b = a + STEPS + 1;
            memcpy(next, (uint32_t[6]){a, b, a + 1, a + 1, b, b + 1}, 6 * sizeof(*next));
        }
    }
    test_mesh(edits, number + 1, (const float(*)[3])vertices, (STEPS + 1) * (STEPS + 1), indices,
              STEPS * STEPS * 2);
    test_node(edits, number + 1, 0, NODE_MESH, number + 1, NULL);
}

struct scene *bench_sheets_scene(uint32_t count)
{
    struct test_edits edits = {.scene = test_scene_create()};
    for (uint32_t i = 0; edits.scene && i < count; i++)
        add_sheet(&edits, i, count);
    if (edits.scene)
        test_commit(&edits);
    return edits.scene;
}

/* ---- one material for all ---- */

static void add_glass(struct test_edits *edits)
{
    struct scene_material *glass = test_material(edits, MATERIAL_ID, COLOUR, COLOUR, COLOUR);
    glass->metallic = 0;
    glass->roughness = 0;
    glass->transmission = 1;
    glass->ior = INDEX_OF_REFRACTION;
    glass->double_sided = true;
}

static void add_mirror(struct test_edits *edits)
{
    struct scene_material *mirror = test_material(edits, MATERIAL_ID, COLOUR, COLOUR, COLOUR);
    mirror->metallic = 1;
    mirror->roughness = 0;
    mirror->double_sided = true;
}

static float *copy_weights(const float *weights, uint32_t count)
{
    float *copy = count > 0 ? malloc(count * sizeof(*copy)) : NULL;
    if (copy)
        memcpy(copy, weights, count * sizeof(*copy));
    return copy;
}

static void remake_mesh(struct test_edits *edits, const struct scene_mesh *from)
{
    struct scene_mesh *mesh = &test_add(edits, OBJECT_MESH)->set.mesh;
    *mesh = *from;
    for (int i = 0; i < MESH_ARRAY_COUNT; i++)
        mesh->arrays[i] = blob_ref(from->arrays[i]);
    mesh->weights = copy_weights(from->weights, from->weight_count);
    mesh->ranges = test_ranges(&(struct material_range){0, from->triangle_count, MATERIAL_ID}, 1);
    mesh->range_count = 1;
}

static void remake_spheres(struct test_edits *edits, const struct scene_spheres *from)
{
    struct scene_spheres *spheres = &test_add(edits, OBJECT_SPHERES)->set.spheres;
    *spheres = *from;
    spheres->centres_radii = blob_ref(from->centres_radii);
    spheres->ranges = test_ranges(&(struct material_range){0, from->sphere_count, MATERIAL_ID}, 1);
    spheres->range_count = 1;
}

/* In several transactions, if it is many: each stands on what is there. */
bool bench_make_alike(struct scene *scene, enum bench_material material, struct error *error)
{
    static const enum object_kind kinds[] = {OBJECT_MESH, OBJECT_SPHERES};
    struct test_edits edits = {.scene = scene};
    if (material == BENCH_MIRROR)
        add_mirror(&edits);
    else
        add_glass(&edits);
    test_commit(&edits);
    for (int i = 0; i < 2; i++) {
        const size_t count = scene->objects[kinds[i]].count;
        uint64_t *ids = calloc(count + 1, sizeof(*ids)), key;
        void *value;
        size_t cursor = 0, found = 0;
        if (!ids)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the scene's objects");
        while (found < count && hashmap_next(&scene->objects[kinds[i]], &cursor, &key, &value))
            ids[found++] = key;
        for (size_t k = 0; k < found; k++) {
            if (kinds[i] == OBJECT_MESH)
                remake_mesh(&edits, scene_mesh(scene, (uint32_t)ids[k]));
            else
                remake_spheres(&edits, scene_spheres(scene, (uint32_t)ids[k]));
        }
        test_commit(&edits);
        free(ids);
    }
    return true;
}
