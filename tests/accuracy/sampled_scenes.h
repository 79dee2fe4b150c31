/* SPDX-License-Identifier: MIT */
/* Scenes for the tests of sampled tracers: closed shapes over a floor, in mirrors, glass and textures. */
#ifndef FARLIGHT_TESTS_SAMPLED_SCENES_H
#define FARLIGHT_TESTS_SAMPLED_SCENES_H

#include "tests/accuracy/render_fixture.h"

/* ---- shapes: closed, with smooth normals and texture coordinates ---- */

enum shape { SHAPE_SPHERE, SHAPE_TORUS, SHAPE_BUMPY };

static inline void place_on(enum shape shape, float u, float v, float p[3])
{
    float a = 6.28318531f * u, b = shape == SHAPE_TORUS ? 6.28318531f * v : 3.14159265f * v;
    if (shape == SHAPE_TORUS) {
        float across = 0.7f + 0.3f * cosf(b);
        p[0] = across * cosf(a);
        p[1] = 0.3f * sinf(b);
        p[2] = -across * sinf(a);
        return;
    }
    float radius = shape == SHAPE_BUMPY ? 0.9f + 0.06f * sinf(7 * b) * sinf(6 * a) * sinf(b) : 1.0f;
    p[0] = radius * sinf(b) * cosf(a);
    p[1] = radius * cosf(b);
    p[2] = -radius * sinf(b) * sinf(a);
}

static inline void normal_on(enum shape shape, float u, float v, float n[3])
{
    const float step = 1e-3f;
    float along_u[2][3], along_v[2][3], squared = 0;
    v = shape == SHAPE_TORUS ? v : fminf(fmaxf(v, 0.002f), 0.998f); /* at the poles, as beside them */
    for (int side = 0; side < 2; side++) {
        place_on(shape, u + (side ? step : -step), v, along_u[side]);
        place_on(shape, u, v + (side ? step : -step), along_v[side]);
    }
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = (along_v[1][j] - along_v[0][j]) * (along_u[1][k] - along_u[0][k]) -
               (along_v[1][k] - along_v[0][k]) * (along_u[1][j] - along_u[0][j]);
        n[i] *= shape == SHAPE_TORUS ? -1.0f : 1.0f;
        squared += n[i] * n[i];
    }
    for (int i = 0; i < 3; i++)
        n[i] /= sqrtf(squared);
}

/* Returns the mesh's number. */
static inline uint32_t add_shape_mesh(struct fixture *fixture, enum shape shape, uint32_t steps, uint32_t material)
{
    uint32_t each = steps + 1, vertices = each * each, triangles = 2 * steps * steps;
    float(*positions)[3] = malloc(vertices * sizeof(*positions)),
    (*normals)[3] = malloc(vertices * sizeof(*normals));
    float(*texcoords)[2] = malloc(vertices * sizeof(*texcoords));
    uint32_t *indices = malloc(3 * (size_t)triangles * sizeof(*indices)), *out = indices;
    for (uint32_t i = 0; i < vertices; i++) {
        float u = (float)(i % each) / (float)steps, v = (float)(i / each) / (float)steps;
        /* seams meet to the bit */
        place_on(shape, i % each == steps ? 0 : u, shape == SHAPE_TORUS && i / each == steps ? 0 : v,
                 positions[i]);
        if (shape != SHAPE_TORUS && (i / each == 0 || i / each == steps))
            positions[i][0] = positions[i][2] = 0;
        normal_on(shape, u, v, normals[i]);
        texcoords[i][0] = 4 * u;
        texcoords[i][1] = 2 * v;
    }
    for (uint32_t i = 0; i < steps * steps; i++, out += 6) {
        uint32_t a = i / steps * each + i % steps, b = a + each;
        if (shape == SHAPE_TORUS)
            memcpy(out, (uint32_t[6]){a, a + 1, b, a + 1, b + 1, b}, 6 * sizeof(*out));
        else
            memcpy(out, (uint32_t[6]){a, b, a + 1, a + 1, b, b + 1}, 6 * sizeof(*out));
    }
    struct scene_mesh *mesh = &fixture_edit(fixture, OBJECT_MESH)->set.mesh;
    mesh->base.id = fixture->next_id++;
    mesh->value.vertex_count = vertices;
    mesh->value.triangle_count = triangles;
    mesh->value.closed = true;
    mesh->arrays[MESH_POSITIONS] = fixture_blob(positions, vertices * sizeof(*positions));
    mesh->arrays[MESH_NORMALS] = fixture_blob(normals, vertices * sizeof(*normals));
    mesh->arrays[MESH_TEXCOORDS_0] = fixture_blob(texcoords, vertices * sizeof(*texcoords));
    mesh->arrays[MESH_INDICES] = fixture_blob(indices, 3 * (size_t)triangles * sizeof(*indices));
    mesh->ranges = calloc(1, sizeof(*mesh->ranges));
    assert_non_null(mesh->ranges);
    *mesh->ranges = (struct record_material_range){0, triangles, material};
    mesh->range_count = 1;
    free(positions);
    free(normals);
    free(texcoords);
    free(indices);
    return mesh->base.id;
}

static inline void set_node(struct fixture *fixture, uint32_t node, uint32_t mesh,
                            const float parent_from_node[12])
{
    struct scene_node *edit = &fixture_edit(fixture, OBJECT_NODE)->set.node;
    edit->base.id = node;
    edit->value.kind = NODE_MESH;
    edit->value.object = mesh;
    memcpy(edit->value.parent_from_node, parent_from_node, sizeof(edit->value.parent_from_node));
}

/* Turned about x, scaled and moved. */
static inline void turned(float m[12], float scale, float radians, float x, float y, float z)
{
    float c = scale * cosf(radians), s = scale * sinf(radians);
    memcpy(m, (float[12]){scale, 0, 0, x, 0, c, -s, y, 0, s, c, z}, 12 * sizeof(float));
}

static inline uint32_t add_shape(struct fixture *fixture, enum shape shape, uint32_t steps, uint32_t material,
                                 float scale, float radians, float x, float y, float z)
{
    float m[12];
    uint32_t mesh = add_shape_mesh(fixture, shape, steps, material);
    turned(m, scale, radians, x, y, z);
    return fixture_node(fixture, NODE_MESH, mesh, m);
}

/* A floor of some size below it all, and two lights. */
static inline void add_floor_and_lights(struct fixture *fixture, uint32_t material)
{
    const float floor[12] = {1, 0, 0, 0, 0, 0, 1, -1.05f, 0, -1, 0, 0};
    fixture_square(fixture, 3.0f, material, floor);
    fixture_light(fixture, LIGHT_POINT, 2.5f, 4, 3, 300);
    fixture_light(fixture, LIGHT_POINT, -3, 3, 2, 120);
    fixture_environment(fixture, 0.3f, 0.4f, 0.5f);
}

static inline uint32_t add_texture(struct fixture *fixture, bool holes)
{
    enum { TEXELS = 64 };
    static uint8_t texels[TEXELS][TEXELS][4];
    for (int y = 0; y < TEXELS; y++) {
        for (int x = 0; x < TEXELS; x++) {
            bool odd = ((x / 16) + (y / 16)) % 2 != 0;
            texels[y][x][0] = odd ? 220 : (uint8_t)(40 + 3 * x);
            texels[y][x][1] = odd ? (uint8_t)(60 + 2 * y) : 200;
            texels[y][x][2] = (uint8_t)(80 + x + y);
            texels[y][x][3] = holes && odd ? 0 : 255;
        }
    }
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->value.width = texture->value.height = TEXELS;
    texture->value.format = TEXTURE_RGBA8_SRGB;
    texture->texels = fixture_blob(texels, sizeof(texels));
    return texture->base.id;
}

static inline void use_texture(struct scene_material *material, enum material_texture use, uint32_t texture)
{
    material->textures[use] = (struct record_texture_use){.texture = texture, .strength = 1.0f};
    material->textures[use].uv_transform[0] = material->textures[use].uv_transform[4] = 1.0f;
}

static inline uint32_t add_matte(struct fixture *fixture, float r, float g, float b)
{
    struct scene_material *material = fixture_material(fixture);
    memcpy(material->value.base_colour, (float[3]){r, g, b}, 3 * sizeof(float));
    material->value.ior = 1.5f;
    return material->base.id;
}

static inline uint32_t add_mirror(struct fixture *fixture, float r, float g, float b)
{
    struct scene_material *material = fixture_material(fixture);
    memcpy(material->value.base_colour, (float[3]){r, g, b}, 3 * sizeof(float));
    material->value.metallic = 1.0f;
    material->value.roughness = 0.05f;
    return material->base.id;
}

/* ---- scenes ---- */

static inline void add_mirrors(struct fixture *fixture)
{
    uint32_t gold = add_mirror(fixture, 1.0f, 0.8f, 0.4f), silver = add_mirror(fixture, 0.9f, 0.9f, 0.95f);
    add_floor_and_lights(fixture, add_matte(fixture, 0.6f, 0.6f, 0.5f));
    add_shape(fixture, SHAPE_SPHERE, 96, silver, 0.8f, 0, -1.3f, -0.2f, 0);
    add_shape(fixture, SHAPE_TORUS, 96, gold, 0.9f, 0.9f, 1.2f, -0.1f, 0.2f);
    add_shape(fixture, SHAPE_BUMPY, 160, add_matte(fixture, 0.8f, 0.3f, 0.2f), 0.5f, 0.3f, 0, -0.5f, 1.2f);
}

/* The mirror is smooth: an exact tracer filters textures by the roughness of the mirror that shows them, but the
 * stored samples of ldc are filtered before any ray is known. */
static inline void add_textured(struct fixture *fixture)
{
    uint32_t texture = add_texture(fixture, false), mirror = add_mirror(fixture, 0.9f, 0.9f, 0.9f);
    fixture->edits[fixture->edit_count - 1].set.material.value.roughness = 0.0f;
    struct scene_material *checked = fixture_material(fixture);
    use_texture(checked, MATERIAL_BASE_COLOUR, texture);
    use_texture(checked, MATERIAL_EMISSION, texture);
    checked->value.emission[0] = 0.2f;
    add_floor_and_lights(fixture, mirror);
    add_shape(fixture, SHAPE_SPHERE, 96, checked->base.id, 0.9f, 0.5f, -1.1f, 0, 0);
    add_shape(fixture, SHAPE_TORUS, 96, checked->base.id, 0.9f, 1.2f, 1.2f, 0, 0);
}

/* Hills, as a normal map or as heights: smooth, so that the size of a cell does not matter. */
static inline uint32_t add_hills(struct fixture *fixture, bool normals)
{
    enum { TEXELS = 64 };
    static uint8_t texels[TEXELS][TEXELS][4];
    for (int y = 0; y < TEXELS; y++) {
        for (int x = 0; x < TEXELS; x++) {
            float a = 6.28318531f * (float)x / TEXELS, b = 6.28318531f * (float)y / TEXELS;
            float slope_x = 0.4f * cosf(a), slope_y = 0.4f * sinf(b);
            float length = sqrtf(slope_x * slope_x + slope_y * slope_y + 1);
            const float n[3] = {slope_x / length, slope_y / length, 1 / length};
            for (int k = 0; k < 3; k++)
                texels[y][x][k] =
                    (uint8_t)lrintf(normals ? 127.5f + 127.5f * n[k] : 127.5f + 100.0f * sinf(a) * cosf(b));
            texels[y][x][3] = 255;
        }
    }
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->value.width = texture->value.height = TEXELS;
    texture->value.format = TEXTURE_RGBA8_LINEAR;
    texture->texels = fixture_blob(texels, sizeof(texels));
    return texture->base.id;
}

/* Adds a surface with every kind of texture that can be combined, and one with a bump map. */
static inline void add_every_texture(struct fixture *fixture)
{
    uint32_t hills = add_hills(fixture, false), normals = add_hills(fixture, true);
    struct scene_material *rich = fixture_material(fixture);
    rich->value.metallic = 1.0f;
    rich->value.roughness = 0.9f;
    rich->value.ior = 1.5f;
    rich->value.emission[1] = 0.3f;
    use_texture(rich, MATERIAL_BASE_COLOUR, hills);
    use_texture(rich, MATERIAL_NORMAL, normals);
    use_texture(rich, MATERIAL_METALLIC_ROUGHNESS, hills);
    use_texture(rich, MATERIAL_OCCLUSION, hills);
    use_texture(rich, MATERIAL_EMISSION, hills);
    use_texture(rich, MATERIAL_TRANSMISSION, hills);
    uint32_t rich_id = rich->base.id;
    struct scene_material *bumpy = fixture_material(fixture);
    memcpy(bumpy->value.base_colour, (float[3]){0.8f, 0.5f, 0.3f}, 3 * sizeof(float));
    use_texture(bumpy, MATERIAL_BUMP, hills);
    bumpy->textures[MATERIAL_BUMP].strength = 0.1f;
    uint32_t bumpy_id = bumpy->base.id;
    add_floor_and_lights(fixture, add_mirror(fixture, 0.9f, 0.9f, 0.9f));
    add_shape(fixture, SHAPE_SPHERE, 96, rich_id, 0.9f, 0.5f, -1.1f, 0, 0);
    add_shape(fixture, SHAPE_TORUS, 96, bumpy_id, 0.9f, 1.2f, 1.2f, 0, 0);
}

static inline void add_glass(struct fixture *fixture)
{
    struct scene_material *glass = fixture_material(fixture);
    memcpy(glass->value.base_colour, (float[3]){0.8f, 0.95f, 0.9f}, 3 * sizeof(float));
    glass->value.transmission = 1.0f;
    glass->value.roughness = 0.0f;
    glass->value.ior = 1.5f;
    add_floor_and_lights(fixture, add_matte(fixture, 0.7f, 0.6f, 0.5f));
    add_shape(fixture, SHAPE_SPHERE, 96, glass->base.id, 0.9f, 0, -1.1f, 0, 0.6f);
    add_shape(fixture, SHAPE_TORUS, 96, glass->base.id, 0.9f, 1.0f, 1.2f, 0, 0.4f);
    add_shape(fixture, SHAPE_BUMPY, 96, add_matte(fixture, 0.2f, 0.4f, 0.8f), 0.6f, 0, 0, -0.3f, -1.2f);
}

static inline void add_cutout(struct fixture *fixture)
{
    struct scene_material *fence = fixture_material(fixture);
    use_texture(fence, MATERIAL_BASE_COLOUR, add_texture(fixture, true));
    fence->value.alpha_mode = ALPHA_MASK;
    add_floor_and_lights(fixture, add_mirror(fixture, 0.8f, 0.8f, 0.8f));
    add_shape(fixture, SHAPE_SPHERE, 64, fence->base.id, 0.9f, 0.4f, -0.9f, 0, 0);
    const float pane[12] = {0.8f, 0, 0.6f, 1.3f, 0, 1, 0, 0, -0.6f, 0, 0.8f, 0};
    fixture_square(fixture, 0.9f, fence->base.id, pane);
}

static inline void add_spheres(struct fixture *fixture)
{
    uint32_t silver = add_mirror(fixture, 0.9f, 0.9f, 0.95f), red = add_matte(fixture, 0.8f, 0.2f, 0.2f);
    add_floor_and_lights(fixture, add_matte(fixture, 0.6f, 0.6f, 0.5f));
    for (int i = 0; i < 9; i++)
        fixture_sphere(fixture, -1.4f + 1.4f * (float)(i % 3), -0.6f + 0.1f * (float)i,
                       1.2f - 1.1f * (float)(i / 3), 0.45f, i % 2 ? red : silver);
}

#endif
