/* SPDX-License-Identifier: MIT */
/* Small scenes made in C, for the tests of tracers and of the device's copy of a scene. */
#ifndef FARLIGHT_TESTS_TEST_SCENES_H
#define FARLIGHT_TESTS_TEST_SCENES_H

#include "scene/scene.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TEST_EDITS_MAX 64

/* Edits of one transaction; a failure ends the test program, since nothing after it would mean anything. */
struct test_edits {
    struct scene *scene;
    struct scene_edit edits[TEST_EDITS_MAX];
    size_t count;
};

static inline struct scene *test_scene_create(void)
{
    static const struct scene_limits limits = {.host_bytes = (uint64_t)1 << 32, .nodes = 100000};
    return scene_create("test", &limits);
}

static inline void test_commit(struct test_edits *edits)
{
    struct error error = {0};
    if (!scene_commit(edits->scene, edits->edits, edits->count, &error)) {
        fprintf(stderr, "the test's own scene is refused: %s: %s\n", error.field, error.text);
        exit(1);
    }
    for (size_t i = 0; i < edits->count; i++)
        scene_edit_finish(&edits->edits[i]);
    edits->count = 0;
}

static inline struct scene_edit *test_add(struct test_edits *edits, enum object_kind kind)
{
    if (edits->count == TEST_EDITS_MAX)
        test_commit(edits);
    struct scene_edit *edit = &edits->edits[edits->count++];
    memset(edit, 0, sizeof(*edit));
    edit->kind = EDIT_SET;
    edit->object = kind;
    return edit;
}

static inline struct blob *test_blob(const void *data, size_t size_bytes)
{
    struct blob *blob = blob_create(size_bytes);
    memcpy(blob->data, data, size_bytes);
    blob_hash(blob->hash, blob->data, size_bytes);
    return blob;
}

/* A generator of its own, so that a failure is the same everywhere (PCG, O'Neill 2014). */
static inline uint32_t test_random(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    uint32_t shifted = (uint32_t)(((*state >> 18) ^ *state) >> 27), turn = (uint32_t)(*state >> 59);
    return shifted >> turn | shifted << (-turn & 31);
}

static inline float test_uniform(uint64_t *state, float low, float high)
{
    return low + (high - low) * (float)((double)test_random(state) / 4294967296.0);
}

/* Materials: unique base colours tell them apart on the device. */
static inline struct scene_material *test_material(struct test_edits *edits, uint32_t id, float red, float green,
                                                   float blue)
{
    struct scene_material *material = &test_add(edits, OBJECT_MATERIAL)->set.material;
    material->base.id = id;
    material->value.base_colour[0] = red;
    material->value.base_colour[1] = green;
    material->value.base_colour[2] = blue;
    material->value.base_colour[3] = 1.0f;
    material->value.roughness = 1.0f;
    material->value.ior = 1.5f;
    material->value.alpha_cutoff = 0.5f;
    material->value.specular = material->value.specular_colour[0] = material->value.specular_colour[1] =
        material->value.specular_colour[2] = 1.0f;
    material->value.attenuation_colour[0] = material->value.attenuation_colour[1] =
        material->value.attenuation_colour[2] = 1.0f;
    material->value.iridescence_ior = 1.3f;
    material->value.diffuse_transmission_colour[0] = material->value.diffuse_transmission_colour[1] =
        material->value.diffuse_transmission_colour[2] = 1.0f;
    for (int i = 0; i < MATERIAL_TEXTURE_COUNT; i++) {
        material->textures[i].uv_transform[0] = 1.0f;
        material->textures[i].uv_transform[4] = 1.0f;
        material->textures[i].strength = 1.0f;
    }
    return material;
}

static inline struct record_material_range *test_ranges(const struct record_material_range *ranges, uint32_t count)
{
    struct record_material_range *copy = malloc((count ? count : 1) * sizeof(*copy));
    memcpy(copy, ranges, count * sizeof(*copy));
    return copy;
}

/* The caller adds further arrays to what is returned. */
static inline struct scene_mesh *test_mesh(struct test_edits *edits, uint32_t id, const float (*positions)[3],
                                           uint32_t vertex_count, const uint32_t *indices, uint32_t triangle_count)
{
    struct scene_mesh *mesh = &test_add(edits, OBJECT_MESH)->set.mesh;
    mesh->base.id = id;
    mesh->value.vertex_count = vertex_count;
    mesh->value.triangle_count = triangle_count;
    mesh->arrays[MESH_POSITIONS] = test_blob(positions, vertex_count * sizeof(*positions));
    mesh->arrays[MESH_INDICES] = test_blob(indices, (size_t)triangle_count * 3 * sizeof(*indices));
    return mesh;
}

static inline struct scene_spheres *test_spheres(struct test_edits *edits, uint32_t id,
                                                 const float (*centres_radii)[4], uint32_t count)
{
    struct scene_spheres *spheres = &test_add(edits, OBJECT_SPHERES)->set.spheres;
    spheres->base.id = id;
    spheres->value.sphere_count = count;
    spheres->centres_radii = test_blob(centres_radii, count * sizeof(*centres_radii));
    return spheres;
}

static inline struct scene_node *test_node(struct test_edits *edits, uint32_t id, uint32_t parent,
                                           enum node_kind kind, uint32_t object, const float parent_from_node[12])
{
    static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    struct scene_node *node = &test_add(edits, OBJECT_NODE)->set.node;
    node->base.id = id;
    node->value.parent = parent;
    node->value.kind = kind;
    node->value.object = object;
    memcpy(node->value.parent_from_node, parent_from_node ? parent_from_node : identity, sizeof(identity));
    return node;
}

/* Scale, then a turn about an axis (0 x, 1 y, 2 z), then a move. */
static inline void test_transform(float m[12], float sx, float sy, float sz, int axis, float radians, float x,
                                  float y, float z)
{
    float c = cosf(radians), s = sinf(radians);
    int a = (axis + 1) % 3, b = (axis + 2) % 3;
    float turn[3][3] = {{0}};
    const float scale[3] = {sx, sy, sz}, move[3] = {x, y, z};
    turn[axis][axis] = 1.0f;
    turn[a][a] = c;
    turn[a][b] = -s;
    turn[b][a] = s;
    turn[b][b] = c;
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++)
            m[4 * row + column] = turn[row][column] * scale[column];
        m[4 * row + 3] = move[row];
    }
}

/* `count` triangles of about `size` in the cube -1..1, with normals, two sets of texture coordinates and colours;
 * materials 1 and 2, the rest with the default one. */
static inline void test_soup_mesh(struct test_edits *edits, uint32_t id, uint32_t count, float size, uint64_t seed)
{
    float(*positions)[3] = malloc(count * 3 * sizeof(*positions)),
    (*normals)[3] = malloc(count * 3 * sizeof(*normals));
    float(*uv)[2] = malloc(count * 3 * sizeof(*uv));
    uint32_t *indices = malloc(count * 3 * sizeof(*indices)), *colours = malloc(count * 3 * sizeof(*colours));
    for (uint32_t i = 0; i < count; i++) {
        float centre[3];
        for (int k = 0; k < 3; k++)
            centre[k] = test_uniform(&seed, -1, 1);
        for (uint32_t v = 3 * i; v < 3 * i + 3; v++) {
            for (int k = 0; k < 3; k++) {
                positions[v][k] = centre[k] + test_uniform(&seed, -size, size);
                normals[v][k] = test_uniform(&seed, -1, 1);
            }
            uv[v][0] = test_uniform(&seed, -2, 2);
            uv[v][1] = test_uniform(&seed, -2, 2);
            colours[v] = test_random(&seed);
            indices[v] = v;
        }
    }
    const struct record_material_range ranges[] = {{0, count / 3, 1}, {count / 2, count / 4, 2}};
    struct scene_mesh *mesh = test_mesh(edits, id, (const float(*)[3])positions, count * 3, indices, count);
    mesh->arrays[MESH_NORMALS] = test_blob(normals, count * 3 * sizeof(*normals));
    mesh->arrays[MESH_TEXCOORDS_0] = test_blob(uv, count * 3 * sizeof(*uv));
    mesh->arrays[MESH_COLOURS] = test_blob(colours, count * 3 * sizeof(*colours));
    mesh->ranges = test_ranges(ranges, 2);
    mesh->range_count = 2;
    free(positions);
    free(normals);
    free(uv);
    free(indices);
    free(colours);
}

/* Random triangles once as they are, mirrored, scaled unevenly, and below two nested nodes; one flat (left out).
 */
static inline struct scene *test_scene_soup(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    float m[12];
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    test_soup_mesh(&edits, 10, 120, 0.3f, 1);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_transform(m, -1, 1, 1, 1, 0.7f, 2.5f, 0, 0);
    test_node(&edits, 2, 0, NODE_MESH, 10, m);
    test_transform(m, 0.5f, 1.5f, 1, 2, -0.4f, 0, 2.5f, 0);
    test_node(&edits, 3, 0, NODE_MESH, 10, m);
    test_transform(m, 0.7f, 0.7f, 0.7f, 0, 1.1f, -2.5f, 0, 0);
    test_node(&edits, 4, 0, NODE_GROUP, 0, m);
    test_transform(m, 1, 1, -1.2f, 1, 2.0f, 0, -1, 0.5f);
    test_node(&edits, 5, 4, NODE_MESH, 10, m);
    test_transform(m, 1, 0, 1, 1, 0, 0, 0, 0);
    test_node(&edits, 6, 0, NODE_MESH, 10, m);
    test_node(&edits, 7, 0, NODE_MESH, 10, NULL)->value.hidden = true;
    test_commit(&edits);
    return edits.scene;
}

/* Spheres, small and large, as they are and squeezed, among a few triangles. */
static inline struct scene *test_scene_spheres(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    float spheres[40][4], m[12];
    uint64_t seed = 5;
    for (int i = 0; i < 40; i++) {
        for (int k = 0; k < 3; k++)
            spheres[i][k] = test_uniform(&seed, -1, 1);
        spheres[i][3] = test_uniform(&seed, 0.02f, 0.3f);
    }
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    const struct record_material_range ranges[] = {{5, 10, 2}, {20, 20, 1}};
    struct scene_spheres *set = test_spheres(&edits, 20, (const float(*)[4])spheres, 40);
    set->ranges = test_ranges(ranges, 2);
    set->range_count = 2;
    test_soup_mesh(&edits, 10, 20, 0.4f, 3);
    test_node(&edits, 1, 0, NODE_SPHERES, 20, NULL);
    test_transform(m, 1.3f, 0.6f, 0.9f, 0, 0.8f, 2.2f, 0.3f, 0);
    test_node(&edits, 2, 0, NODE_SPHERES, 20, m);
    test_transform(m, -0.5f, 0.5f, 0.5f, 1, 0.3f, -2, 0, 0);
    test_node(&edits, 3, 0, NODE_SPHERES, 20, m);
    test_node(&edits, 4, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    return edits.scene;
}

static inline void test_texture(struct test_edits *edits, uint32_t id, uint32_t width, uint32_t height,
                                enum texture_format format, enum wrap wrap_u, enum wrap wrap_v, uint64_t seed)
{
    uint32_t *texels = malloc((size_t)width * height * 4);
    for (uint32_t i = 0; i < width * height; i++)
        texels[i] = test_random(&seed);
    struct scene_texture *texture = &test_add(edits, OBJECT_TEXTURE)->set.texture;
    texture->base.id = id;
    texture->value.width = width;
    texture->value.height = height;
    texture->value.format = format;
    texture->value.wrap_u = wrap_u;
    texture->value.wrap_v = wrap_v;
    texture->texels = test_blob(texels, (size_t)width * height * 4);
    free(texels);
}

/* Cutouts by texture and by vertex colour, glass, blended panes, and a disc below it all. */
static inline struct scene *test_scene_translucent(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    float sphere[2][4] = {{0.3f, 0.2f, 0, 0.5f}, {-0.6f, 0.4f, 0.3f, 0.4f}}, m[12];
    test_texture(&edits, 1, 13, 8, TEXTURE_RGBA8_SRGB, WRAP_REPEAT, WRAP_MIRROR, 17);
    test_texture(&edits, 2, 5, 5, TEXTURE_RGBA8_LINEAR, WRAP_CLAMP, WRAP_REPEAT, 19);
    struct scene_material *cutout = test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    cutout->value.alpha_mode = ALPHA_MASK;
    cutout->textures[MATERIAL_BASE_COLOUR].texture = 1;
    cutout->textures[MATERIAL_BASE_COLOUR].uv_transform[1] = 0.5f;
    cutout->textures[MATERIAL_BASE_COLOUR].uv_transform[2] = 0.25f;
    cutout->textures[MATERIAL_BASE_COLOUR].uv_transform[3] = -0.3f;
    struct scene_material *pane = test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.6f;
    struct scene_material *glass = test_material(&edits, 3, 0.9f, 0.8f, 0.7f);
    glass->value.transmission = 0.9f;
    glass->textures[MATERIAL_TRANSMISSION].texture = 2;
    struct scene_material *clear = test_material(&edits, 4, 0.95f, 0.75f, 0.85f);
    clear->value.transmission = 1.0f;
    test_material(&edits, 5, 0.05f, 0.15f, 0.25f);
    test_soup_mesh(&edits, 10, 60, 0.5f, 7);
    const struct record_material_range ranges[] = {{0, 1, 3}, {1, 1, 4}};
    struct scene_spheres *set = test_spheres(&edits, 20, (const float(*)[4])sphere, 2);
    set->ranges = test_ranges(ranges, 2);
    set->range_count = 2;
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_node(&edits, 2, 0, NODE_SPHERES, 20, NULL);
    test_transform(m, 1, -0.8f, 1.1f, 2, 0.5f, 1.5f, 0.5f, 0);
    test_node(&edits, 3, 0, NODE_MESH, 10, m);
    struct scene_disc *disc = &test_add(&edits, OBJECT_DISC)->set.disc;
    disc->base.id = 1;
    disc->value.material = 5;
    disc->value.centre_world[1] = -1.2f;
    disc->value.normal_world[1] = 1.0f;
    disc->value.radius = 3.0f;
    test_commit(&edits);
    return edits.scene;
}

#endif
