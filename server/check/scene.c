/* SPDX-License-Identifier: MIT */
/* Builds the generated scenes. */
#include "check/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EDITS_MAX 32
#define PI 3.14159265358979

/* Numbers of objects, by kind; a node has the number of its object, plus 100 times its kind. */
enum material { MATTE = 1, METAL, GLASS, HOLED };
enum { TORUS = 1, FLOOR, SCREEN };
static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* Edits of one transaction. A lack of memory is noted, and nothing is committed. */
struct builder {
    struct scene_edit edits[EDITS_MAX];
    size_t count;
    bool lacks_memory;
};

static struct scene_edit *add(struct builder *builder, enum object_kind object)
{
    struct scene_edit *edit = &builder->edits[builder->count++];
    *edit = (struct scene_edit){.kind = EDIT_SET, .object = object};
    return edit;
}

static struct blob *blob_of(struct builder *builder, const void *data, size_t size_bytes)
{
    struct blob *blob = blob_create(size_bytes);
    if (!blob) {
        builder->lacks_memory = true;
        return NULL;
    }
    memcpy(blob->data, data, size_bytes);
    blob_hash(blob->hash, blob->data, size_bytes);
    return blob;
}

static struct record_material_range *ranges_of(struct builder *builder, const struct record_material_range *ranges,
                                               uint32_t count)
{
    struct record_material_range *copy = malloc(count * sizeof(*copy));
    if (copy)
        memcpy(copy, ranges, count * sizeof(*copy));
    builder->lacks_memory |= !copy;
    return copy;
}

static void add_node(struct builder *builder, enum node_kind kind, uint32_t object, const float placed[12])
{
    struct scene_node *node = &add(builder, OBJECT_NODE)->set.node;
    node->base.id = 100 * (uint32_t)kind + object;
    node->value.kind = kind;
    node->value.object = object;
    memcpy(node->value.parent_from_node, placed, sizeof(node->value.parent_from_node));
}

static struct scene_material *add_material(struct builder *builder, enum material id, float red, float green,
                                           float blue)
{
    struct scene_material *material = &add(builder, OBJECT_MATERIAL)->set.material;
    *material = (struct scene_material){.base.id = id,
                                        .value.base_colour = {red, green, blue, 1},
                                        .value.roughness = 1,
                                        .value.ior = 1.5f,
                                        .value.alpha_cutoff = 0.5f,
                                        .value.specular = 1,
                                        .value.specular_colour = {1, 1, 1},
                                        .value.attenuation_colour = {1, 1, 1},
                                        .value.iridescence_ior = 1.3f,
                                        .value.diffuse_transmission_colour = {1, 1, 1}};
    for (int i = 0; i < MATERIAL_TEXTURE_COUNT; i++)
        material->textures[i] = (struct record_texture_use){.uv_transform = {1, 0, 0, 0, 1, 0}, .strength = 1};
    return material;
}

/* ---- shapes ---- */

struct arrays {
    float (*positions)[3];
    float (*texcoords)[2]; /* NULL: none */
    uint32_t (*indices)[3];
    uint32_t vertices, triangles;
};

static struct scene_mesh *add_mesh(struct builder *builder, uint32_t id, const struct arrays *arrays,
                                   enum material material)
{
    const struct record_material_range range = {0, arrays->triangles, material};
    struct scene_mesh *mesh = &add(builder, OBJECT_MESH)->set.mesh;
    mesh->base.id = id;
    mesh->value.vertex_count = arrays->vertices;
    mesh->value.triangle_count = arrays->triangles;
    mesh->arrays[MESH_POSITIONS] =
        blob_of(builder, arrays->positions, arrays->vertices * sizeof(*arrays->positions));
    mesh->arrays[MESH_INDICES] = blob_of(builder, arrays->indices, arrays->triangles * sizeof(*arrays->indices));
    if (arrays->texcoords)
        mesh->arrays[MESH_TEXCOORDS_0] =
            blob_of(builder, arrays->texcoords, arrays->vertices * sizeof(*arrays->texcoords));
    mesh->ranges = ranges_of(builder, &range, 1);
    mesh->range_count = 1;
    return mesh;
}

/* Makes a torus round the y axis. */
static void fill_torus(const struct arrays *arrays, uint32_t around, uint32_t across)
{
    for (uint32_t i = 0; i < around; i++)
        for (uint32_t j = 0; j < across; j++) {
            const double u = 2 * PI * i / around, v = 2 * PI * j / across, radius = 1 + 0.4 * cos(v);
            const uint32_t k = i * across + j, next_i = (i + 1) % around * across, next_j = (j + 1) % across;
            const float position[3] = {(float)(radius * cos(u)), (float)(0.4 * sin(v)), (float)(radius * sin(u))};
            const uint32_t corners[4] = {k, i * across + next_j, next_i + next_j, next_i + j};
            memcpy(arrays->positions[k], position, sizeof(position));
            memcpy(arrays->indices[2 * k], (uint32_t[3]){corners[0], corners[1], corners[2]},
                   3 * sizeof(uint32_t));
            memcpy(arrays->indices[2 * k + 1], (uint32_t[3]){corners[0], corners[2], corners[3]},
                   3 * sizeof(uint32_t));
        }
}

static void add_torus(struct builder *builder, uint32_t around, uint32_t across)
{
    const uint32_t vertices = around * across;
    struct arrays arrays = {.positions = malloc(vertices * sizeof(*arrays.positions)),
                            .indices = malloc((size_t)2 * vertices * sizeof(*arrays.indices)),
                            .vertices = vertices,
                            .triangles = 2 * vertices};
    if (arrays.positions && arrays.indices) {
        fill_torus(&arrays, around, across);
        add_mesh(builder, TORUS, &arrays, MATTE)->value.closed = true;
        add_node(builder, NODE_MESH, TORUS, identity);
    } else {
        builder->lacks_memory = true;
    }
    free(arrays.positions);
    free(arrays.indices);
}

/* Adds a square in the plane z = 0 of its node. */
static void add_square(struct builder *builder, uint32_t id, float half, enum material material,
                       const float placed[12])
{
    float positions[4][3] = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
    float texcoords[4][2] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    uint32_t indices[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const struct arrays arrays = {positions, texcoords, indices, 4, 2};
    add_mesh(builder, id, &arrays, material);
    add_node(builder, NODE_MESH, id, placed);
}

static void add_spheres(struct builder *builder)
{
    static const float centres_radii[][4] = {
        {-1.5f, 0.1f, 0.8f, 0.5f}, {1.6f, 0.2f, 0.4f, 0.6f}, {0.1f, 0, 1.7f, 0.3f}};
    static const struct record_material_range ranges[] = {{0, 1, GLASS}, {1, 1, METAL}, {2, 1, MATTE}};
    struct scene_spheres *spheres = &add(builder, OBJECT_SPHERES)->set.spheres;
    spheres->base.id = 1;
    spheres->value.sphere_count = 3;
    spheres->centres_radii = blob_of(builder, centres_radii, sizeof(centres_radii));
    spheres->ranges = ranges_of(builder, ranges, 3);
    spheres->range_count = 3;
    add_node(builder, NODE_SPHERES, 1, identity);
}

/* Adds a texture whose every second texel is open. */
static void add_holes(struct builder *builder)
{
    uint8_t texels[4][4][4];
    for (int y = 0; y < 4; y++)
        for (int x = 0; x < 4; x++)
            memset(texels[y][x], (x + y) % 2 ? 255 : 0, 4);
    struct scene_texture *texture = &add(builder, OBJECT_TEXTURE)->set.texture;
    texture->base.id = 1;
    texture->value.width = texture->value.height = 4;
    texture->value.nearest = true;
    texture->texels = blob_of(builder, texels, sizeof(texels));
    struct scene_material *material = add_material(builder, HOLED, 0.8f, 0.7f, 0.2f);
    material->value.alpha_mode = ALPHA_MASK;
    material->value.double_sided = true;
    material->textures[MATERIAL_BASE_COLOUR].texture = 1;
}

static void add_disc_light_and_sky(struct builder *builder)
{
    static const float above[12] = {1, 0, 0, -2, 0, 1, 0, 4, 0, 0, 1, 3};
    struct scene_disc *disc = &add(builder, OBJECT_DISC)->set.disc;
    *disc = (struct scene_disc){.base.id = 1,
                                .value.material = MATTE,
                                .value.centre_world = {0, 0.5f, -3},
                                .value.normal_world = {0, 0, 1},
                                .value.radius = 1.2f};
    struct scene_light *light = &add(builder, OBJECT_LIGHT)->set.light;
    *light = (struct scene_light){.base.id = 1, .value.kind = LIGHT_POINT, .value.colour = {40, 40, 40}};
    add_node(builder, NODE_LIGHT, 1, above);
    struct scene_edit *sky = add(builder, OBJECT_NODE);
    sky->kind = EDIT_SET_ENVIRONMENT;
    sky->set.environment = (struct scene_environment){.value.colour = {0.3f, 0.4f, 0.5f}};
}

/* ---- scenes ---- */

static struct scene *commit(struct builder *builder, struct error *error)
{
    const struct scene_limits limits = {.host_bytes = (uint64_t)1 << 28};
    struct scene *scene = builder->lacks_memory ? NULL : scene_create("check", &limits);
    bool committed = scene && scene_commit(scene, builder->edits, builder->count, error);
    for (size_t i = 0; i < builder->count; i++)
        scene_edit_finish(&builder->edits[i]);
    if (committed)
        return scene;
    scene_destroy(scene);
    error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a scene"); /* unless a reason is set already */
    return NULL;
}

struct scene *check_scene_small(struct error *error)
{
    static const float floor[12] = {1, 0, 0, 0, 0, 0, 1, -0.5f, 0, -1, 0, 0};
    static const float screen[12] = {1, 0, 0, 1.1f, 0, 1, 0, 0.4f, 0, 0, 1, 1.5f};
    struct builder builder = {.count = 0};
    add_material(&builder, MATTE, 0.6f, 0.5f, 0.4f);
    struct scene_material *metal = add_material(&builder, METAL, 0.9f, 0.9f, 0.6f);
    metal->value.metallic = 1;
    metal->value.roughness = 0;
    struct scene_material *glass = add_material(&builder, GLASS, 1, 1, 1);
    glass->value.transmission = 1;
    glass->value.roughness = 0;
    add_holes(&builder);
    add_torus(&builder, 24, 16);
    add_square(&builder, FLOOR, 3, MATTE, floor);
    add_square(&builder, SCREEN, 0.4f, HOLED, screen);
    add_spheres(&builder);
    add_disc_light_and_sky(&builder);
    return commit(&builder, error);
}

struct scene *check_scene_torus(uint32_t around, uint32_t across, struct error *error)
{
    struct builder builder = {.count = 0};
    add_material(&builder, MATTE, 0.6f, 0.5f, 0.4f);
    add_torus(&builder, around, across);
    return commit(&builder, error);
}
