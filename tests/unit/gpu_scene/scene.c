/* SPDX-License-Identifier: MIT */
/* The device's copy of a scene: what is there, and that an edit uploads no more than it changed. */
#include "tests/accuracy/test_scenes.h"

#include "shared/light.h"
#include "shared/material.h"
#include "gpu_scene/scene.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <epoxy/gl.h>
#include <stddef.h>

struct fixture {
    struct scene *scene;
    struct gpu_scene gpu;
    struct scene_changes changes;
    struct test_edits edits;
};

static void update(struct fixture *fixture)
{
    struct error error = {0};
    bool ok = gpu_scene_update(&fixture->gpu, fixture->scene, NULL, &fixture->changes, NULL, &error);
    assert_string_equal(error.text, "");
    assert_true(ok);
}

static void fixture_init(struct fixture *fixture, struct scene *scene)
{
    *fixture = (struct fixture){.scene = scene, .edits = {.scene = scene}};
    gpu_scene_init(&fixture->gpu, device);
    update(fixture);
}

static void fixture_finish(struct fixture *fixture)
{
    gpu_scene_finish(&fixture->gpu);
    gpu_scene_finish(&fixture->gpu); /* empty already */
    scene_destroy(fixture->scene);
}

static void expect_changes(const struct fixture *fixture, bool geometry, bool instances, bool shading, bool lights)
{
    assert_int_equal((fixture->changes.bits & CHANGED_GEOMETRY) != 0, geometry);
    assert_int_equal((fixture->changes.bits & CHANGED_INSTANCES) != 0, instances);
    assert_int_equal((fixture->changes.bits & CHANGED_SHADING) != 0, shading);
    assert_int_equal((fixture->changes.bits & CHANGED_LIGHTS) != 0, lights);
}

ALL_TESTS(open_device, close_device)

TEST(the_first_update_uploads_everything_and_the_next_nothing)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_translucent());
    expect_changes(&fixture, true, true, true, true);
    assert_in_range(fixture.changes.uploaded_bytes, 60 * 16 + 180 * 16 * 3, UINT64_MAX);
    assert_in_range(gpu_scene_device_bytes(&fixture.gpu), fixture.changes.uploaded_bytes, UINT64_MAX);
    update(&fixture);
    expect_changes(&fixture, false, false, false, false);
    assert_int_equal(fixture.changes.uploaded_bytes, 0);
    assert_true(fixture.gpu.has_spheres && fixture.gpu.has_cutout && fixture.gpu.has_translucent);
    assert_int_equal(fixture.gpu.disc_count, 1);
    fixture_finish(&fixture);
}

TEST(a_moved_node_uploads_its_instance_alone)
{
    struct fixture fixture;
    struct instance back;
    float m[12];
    fixture_init(&fixture, test_scene_soup());
    assert_int_equal(fixture.gpu.instance_count, 4); /* neither the flat nor the hidden one */
    test_transform(m, 1, 1, 1, 0, 0, 7, 8, 9);
    test_node(&fixture.edits, 2, 0, NODE_MESH, 10, m);
    test_commit(&fixture.edits);
    update(&fixture);
    expect_changes(&fixture, false, true, false, false);
    assert_int_equal(fixture.changes.uploaded_bytes, sizeof(struct instance));
    gpu_buffer_read(device, &fixture.gpu.instance_buffer, sizeof(back), &back, sizeof(back));
    assert_int_equal(back.node, 2);
    assert_float_equal(back.world_from_object[2][3], 9.0f, 0.0f);
    assert_float_equal(back.object_from_world[2][3], -9.0f, 0.0f);
    assert_int_equal(back.flags, 0);
    fixture_finish(&fixture);
}

TEST(an_edited_material_moves_no_geometry_and_no_texels)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_translucent());
    test_material(&fixture.edits, 5, 0.9f, 0.9f, 0.1f);
    test_commit(&fixture.edits);
    update(&fixture);
    expect_changes(&fixture, false, false, true, false);
    assert_false((fixture.changes.bits & CHANGED_SURFACES));
    assert_in_range(fixture.changes.uploaded_bytes, 1,
                    sizeof(struct material)); /* the different parts of the material */
    fixture_finish(&fixture);
}

TEST(what_surfaces_have_is_known_of_the_meshes_and_materials_in_use)
{
    static const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    static const uint32_t indices[3] = {0, 1, 2};
    struct fixture fixture;
    fixture_init(&fixture, test_scene_soup());
    assert_true(fixture.gpu.has_texcoords && fixture.gpu.has_colours && !fixture.gpu.has_tangents);
    test_material(&fixture.edits, 2, 0.4f, 0.5f, 0.6f)->value.anisotropy = 0.5f;
    test_commit(&fixture.edits);
    update(&fixture);
    assert_true(fixture.gpu.has_tangents);
    test_mesh(&fixture.edits, 10, corners, 3, indices, 1);
    test_commit(&fixture.edits);
    update(&fixture);
    assert_false(fixture.gpu.has_texcoords || fixture.gpu.has_colours || fixture.gpu.has_tangents);
    fixture_finish(&fixture);
}

/* Stored surfaces have their textures applied, and no holes; factors are multiplied later. */
TEST(only_what_is_more_than_a_factor_changes_surfaces)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_translucent());
    assert_true((fixture.changes.bits & CHANGED_SURFACES));
    struct scene_material glass = *scene_material(fixture.scene, 3), cutout = *scene_material(fixture.scene, 1);
    struct scene_material *edited = test_material(&fixture.edits, 3, 0.1f, 0.2f, 0.3f);
    memcpy(edited->textures, glass.textures, sizeof(glass.textures));
    edited->value.transmission = 0.5f;
    edited->value.roughness = 0.2f;
    edited->value.emission[0] = 3.0f;
    edited->value.base_colour[3] = 0.5f;
    test_commit(&fixture.edits);
    update(&fixture);
    assert_true((fixture.changes.bits & CHANGED_SHADING) && !(fixture.changes.bits & CHANGED_SURFACES));
    edited = test_material(&fixture.edits, 3, 0.1f, 0.2f, 0.3f);
    memcpy(edited->textures, glass.textures, sizeof(glass.textures));
    edited->textures[MATERIAL_TRANSMISSION].uv_transform[2] = 0.5f;
    test_commit(&fixture.edits);
    update(&fixture);
    assert_true((fixture.changes.bits & CHANGED_SURFACES));
    edited = test_material(&fixture.edits, 1, 0.1f, 0.2f, 0.3f);
    memcpy(edited->textures, cutout.textures, sizeof(cutout.textures));
    edited->value.alpha_mode = ALPHA_MASK;
    edited->value.alpha_cutoff = 0.25f;
    test_commit(&fixture.edits);
    update(&fixture);
    assert_true((fixture.changes.bits & CHANGED_SURFACES));
    test_texture(&fixture.edits, 2, 5, 5, TEXTURE_RGBA8_LINEAR, WRAP_CLAMP, WRAP_REPEAT, 20);
    test_commit(&fixture.edits);
    update(&fixture);
    assert_true((fixture.changes.bits & CHANGED_SURFACES));
    fixture_finish(&fixture);
}

static void read_table(const struct gpu_scene *gpu, uint32_t texel, void *data, size_t bytes)
{
    gpu_buffer_read(device, &gpu->tables, (size_t)texel * 16, data, bytes);
}

TEST(a_material_that_ceases_to_be_a_cutout_is_noticed)
{
    struct fixture fixture;
    struct geometry back[2];
    fixture_init(&fixture, test_scene_translucent());
    read_table(&fixture.gpu, TABLES_HEAD_TEXELS, back, sizeof(back));
    assert_int_equal(back[0].flags & GEOMETRY_HAS_CUTOUT, GEOMETRY_HAS_CUTOUT);
    assert_int_equal(back[1].flags & GEOMETRY_HAS_CUTOUT, 0);
    test_material(&fixture.edits, 1, 0.1f, 0.1f, 0.1f);
    test_commit(&fixture.edits);
    update(&fixture);
    assert_false(fixture.gpu.has_cutout);
    assert_true(fixture.gpu.has_translucent);
    read_table(&fixture.gpu, TABLES_HEAD_TEXELS, back, sizeof(back));
    assert_int_equal(back[0].flags & GEOMETRY_HAS_CUTOUT, 0);
    fixture_finish(&fixture);
}

static void expect_tables(const struct gpu_scene *gpu)
{
    struct table_starts head;
    struct geometry geometry;
    struct disc disc;
    read_table(gpu, 0, &head, sizeof(head));
    assert_memory_equal(&head, &gpu->table_starts, sizeof(head));
    read_table(gpu, TABLES_HEAD_TEXELS, &geometry, sizeof(geometry));
    assert_memory_equal(&geometry, &gpu->geometries[0].device, sizeof(geometry));
    read_table(gpu, head.discs, &disc, sizeof(disc));
    assert_memory_equal(&disc, &gpu->discs[0], sizeof(disc));
    assert_int_equal(gpu->tables.size_bytes, (head.discs + gpu->disc_count * DISC_TEXELS) * 16);
}

TEST(tables_move_on_behind_one_that_grows)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_translucent());
    expect_tables(&fixture.gpu);
    const struct table_starts before = fixture.gpu.table_starts;
    test_material(&fixture.edits, 50, 0.5f, 0.5f, 0.5f);
    test_commit(&fixture.edits);
    update(&fixture);
    assert_int_equal(fixture.gpu.table_starts.materials, before.materials);
    assert_int_equal(fixture.gpu.table_starts.discs, before.discs + MATERIAL_TEXELS);
    expect_tables(&fixture.gpu);
    fixture_finish(&fixture);
}

/* Materials come and go; the triangles that were not set again keep theirs. */
TEST(materials_keep_their_indices)
{
    struct fixture fixture;
    uint32_t first[4], last[4];
    struct material material;
    const struct table_starts *starts = &fixture.gpu.table_starts;
    fixture_init(&fixture, test_scene_soup());
    for (uint32_t id = 50; id < 60; id++)
        test_material(&fixture.edits, id, 0.5f, 0.5f, 0.5f);
    test_commit(&fixture.edits);
    update(&fixture);
    for (uint32_t id = 50; id < 60; id++)
        *test_add(&fixture.edits, OBJECT_MATERIAL) =
            (struct scene_edit){.kind = EDIT_REMOVE, .object = OBJECT_MATERIAL, .id = id};
    test_material(&fixture.edits, 70, 0.7f, 0.7f, 0.7f);
    test_commit(&fixture.edits);
    update(&fixture);
    expect_changes(&fixture, false, false, true, false);
    assert_in_range(fixture.gpu.material_count, 4, 13);
    gpu_buffer_read(device, &fixture.gpu.triangles, 0, first, sizeof(first));
    gpu_buffer_read(device, &fixture.gpu.triangles, 60 * 16, last, sizeof(last)); /* the second range */
    read_table(&fixture.gpu, starts->materials + first[3] * MATERIAL_TEXELS, &material, sizeof(material));
    assert_float_equal(material.base_colour[0], 0.1f, 0.0f);
    read_table(&fixture.gpu, starts->materials + last[3] * MATERIAL_TEXELS, &material, sizeof(material));
    assert_float_equal(material.base_colour[0], 0.4f, 0.0f);
    fixture_finish(&fixture);
}

TEST(a_material_asks_for_tangents_of_the_coordinates_of_the_first_texture_that_needs_them)
{
    struct fixture fixture;
    struct material back;
    fixture_init(&fixture, test_scene_create());
    test_texture(&fixture.edits, 1, 1, 1, TEXTURE_RGBA8_LINEAR, WRAP_REPEAT, WRAP_REPEAT, 1);
    for (uint32_t second = 0; second < 2; second++) {
        struct record_texture_use *uses = test_material(&fixture.edits, 1, 0.5f, 0.5f, 0.5f)->textures;
        uses[MATERIAL_NORMAL].texture = uses[MATERIAL_BUMP].texture = 1;
        uses[MATERIAL_NORMAL].texcoord_set = second;
        uses[MATERIAL_BUMP].texcoord_set = !second;
        test_commit(&fixture.edits);
        update(&fixture);
        read_table(&fixture.gpu, fixture.gpu.table_starts.materials + MATERIAL_TEXELS, &back, sizeof(back));
        assert_int_equal(back.flags & (MATERIAL_TANGENT | MATERIAL_TANGENT_SECOND),
                         MATERIAL_TANGENT | (second ? MATERIAL_TANGENT_SECOND : 0));
    }
    fixture_finish(&fixture);
}

TEST(a_texture_is_halved_in_linear_light_down_to_one_texel)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_create());
    static const uint8_t texels[3][2][4] = {
        {{0, 0, 0, 0}, {255, 255, 255, 255}}, {{255, 10, 0, 255}, {0, 10, 0, 0}}, {{0, 0, 0, 0}, {0, 0, 0, 0}}};
    for (uint32_t id = 1; id <= 2; id++) {
        struct scene_texture *texture = &test_add(&fixture.edits, OBJECT_TEXTURE)->set.texture;
        texture->base.id = id;
        texture->value.width = 2;
        texture->value.height = 3;
        texture->value.format = id == 1 ? TEXTURE_RGBA8_SRGB : TEXTURE_RGBA8_LINEAR;
        texture->value.wrap_u = WRAP_MIRROR;
        texture->texels = test_blob(texels, sizeof(texels));
    }
    test_commit(&fixture.edits);
    update(&fixture);
    struct texture_info infos[2];
    uint8_t back[2][7][4];
    read_table(&fixture.gpu, fixture.gpu.table_starts.textures, infos, sizeof(infos));
    gpu_buffer_read(device, &fixture.gpu.texels, 0, back, sizeof(back));
    assert_int_equal(infos[0].flags, TEXTURE_SRGB | 2u << TEXTURE_WRAP_U_SHIFT | 2u << TEXTURE_LEVELS_SHIFT);
    assert_int_equal(infos[1].first_texel, 7);
    assert_memory_equal(back[0], texels, sizeof(texels));
    /* Two of six texels are white in red: a third of the light, which is 156 in sRGB. */
    assert_int_equal(back[0][6][0], 156);
    assert_int_equal(back[1][6][0], 85);
    assert_int_equal(back[0][6][3], 85); /* alpha is linear always */
    fixture_finish(&fixture);
}

TEST(the_last_column_of_an_odd_width_counts_in_the_next_level)
{
    static const uint8_t texels[5][4] = {[4] = {255, 255, 255, 255}};
    struct fixture fixture;
    uint8_t back[2][4];
    fixture_init(&fixture, test_scene_create());
    struct scene_texture *texture = &test_add(&fixture.edits, OBJECT_TEXTURE)->set.texture;
    *texture = (struct scene_texture){.base.id = 1,
                                      .value.width = 5,
                                      .value.height = 1,
                                      .value.format = TEXTURE_RGBA8_LINEAR,
                                      .texels = test_blob(texels, sizeof(texels))};
    test_commit(&fixture.edits);
    update(&fixture);
    gpu_buffer_read(device, &fixture.gpu.texels, sizeof(texels), back, sizeof(back));
    for (int k = 0; k < 4; k++) {
        assert_int_equal(back[0][k], 0);
        assert_int_equal(back[1][k], 85); /* mean of three texels */
    }
    fixture_finish(&fixture);
}

TEST(lights_go_along_minus_z_of_their_nodes)
{
    struct fixture fixture;
    struct light back[2];
    float m[12];
    fixture_init(&fixture, test_scene_create());
    struct scene_light *spot = &test_add(&fixture.edits, OBJECT_LIGHT)->set.light;
    *spot = (struct scene_light){.base.id = 1,
                                 .value.kind = LIGHT_SPOT,
                                 .value.colour = {1, 2, 3},
                                 .value.range = 9,
                                 .value.inner_cone = 0.3f,
                                 .value.outer_cone = 0.6f};
    struct scene_light *rectangle = &test_add(&fixture.edits, OBJECT_LIGHT)->set.light;
    *rectangle = (struct scene_light){.base.id = 2, .value.kind = LIGHT_RECTANGLE, .value.size = {2, 4}};
    test_transform(m, 2, 2, 2, 1, 1.5707963f, 5, 6, 7); /* z to x */
    test_node(&fixture.edits, 1, 0, NODE_LIGHT, 1, m);
    test_node(&fixture.edits, 2, 0, NODE_LIGHT, 2, m);
    test_commit(&fixture.edits);
    update(&fixture);
    expect_changes(&fixture, false, false, false, true);
    assert_int_equal(fixture.gpu.light_count, 2);
    gpu_buffer_read(device, &fixture.gpu.lights, 0, back, sizeof(back));
    assert_float_equal(back[0].position_kind[0], 5, 0);
    assert_float_equal(back[0].position_kind[3], LIGHT_KIND_SPOT, 0);
    assert_float_equal(back[0].direction_range[0], -1, 1e-6);
    assert_float_equal(back[0].direction_range[3], 9, 0);
    assert_float_equal(back[0].half_u_inner[3], cosf(0.3f), 1e-6);
    assert_float_equal(back[0].half_v_outer[3], cosf(0.6f), 1e-6);
    assert_float_equal(fabsf(back[1].half_u_inner[2]), 2, 1e-6);
    assert_float_equal(back[1].half_v_outer[1], 4, 1e-6);
    assert_float_equal(fixture.gpu.lower_world[1], 0, 1e-5); /* 6 - (2 + 4): the rectangle in any position */
    fixture_finish(&fixture);
}

TEST(a_light_is_in_the_group_of_the_nearest_node_that_has_one)
{
    struct fixture fixture;
    struct light back[3];
    const float groups[3] = {5, 2, 0};
    fixture_init(&fixture, test_scene_create());
    test_add(&fixture.edits, OBJECT_LIGHT)->set.light =
        (struct scene_light){.base.id = 1, .value.kind = LIGHT_SPHERE, .value.size = {1}};
    test_node(&fixture.edits, 1, 4, NODE_LIGHT, 1, NULL)->value.light_group = 5;
    test_node(&fixture.edits, 2, 4, NODE_LIGHT, 1, NULL);
    test_node(&fixture.edits, 3, 0, NODE_LIGHT, 1, NULL);
    test_node(&fixture.edits, 4, 5, NODE_GROUP, 0, NULL);
    test_node(&fixture.edits, 5, 0, NODE_GROUP, 0, NULL)->value.light_group = 2;
    test_commit(&fixture.edits);
    update(&fixture);
    gpu_buffer_read(device, &fixture.gpu.lights, 0, back, sizeof(back));
    for (int i = 0; i < 3; i++)
        assert_float_equal(back[i].position_kind[3], LIGHT_KIND_SPHERE + groups[i] / LIGHT_GROUPS_MAX, 0);
    fixture_finish(&fixture);
}

TEST(the_radius_of_a_sphere_light_is_scaled_by_the_mean_of_its_node)
{
    struct fixture fixture;
    struct light back;
    float m[12];
    fixture_init(&fixture, test_scene_create());
    test_add(&fixture.edits, OBJECT_LIGHT)->set.light =
        (struct scene_light){.base.id = 1, .value.kind = LIGHT_SPHERE, .value.size = {0.5f}};
    test_transform(m, 1, 2, 4, 1, 0.7f, 5, 6, 7);
    test_node(&fixture.edits, 1, 0, NODE_LIGHT, 1, m);
    test_commit(&fixture.edits);
    update(&fixture);
    gpu_buffer_read(device, &fixture.gpu.lights, 0, &back, sizeof(back));
    assert_float_equal(back.position_kind[3], LIGHT_KIND_SPHERE, 0);
    assert_float_equal(back.colour[3], 1, 1e-5); /* the cube root of 8 times as large */
    fixture_finish(&fixture);
}

/* Two texels, of which the first is as red as `half` says. */
static void bring_environment_image(struct fixture *fixture, uint16_t half)
{
    uint16_t half_floats[2 * 1 * 4] = {half};
    struct scene_edit *edit = test_add(&fixture->edits, OBJECT_NODE);
    edit->kind = EDIT_SET_ENVIRONMENT;
    edit->set.environment = (struct scene_environment){.value.colour = {1, 1, 1},
                                                       .value.width = 2,
                                                       .value.height = 1,
                                                       .texels = test_blob(half_floats, sizeof(half_floats))};
    test_commit(&fixture->edits);
    update(fixture);
    assert_true(fixture->gpu.has_environment_image && (fixture->changes.bits & CHANGED_LIGHTS));
    bool done = false;
    assert_true(gpu_scene_upload_environment(&fixture->gpu, UINT64_MAX, &done, NULL) && done);
    assert_int_equal(fixture->gpu.environment.width, 2);
    glGetTextureImage(fixture->gpu.environment.name, 0, GL_RGBA, GL_HALF_FLOAT, sizeof(half_floats), half_floats);
    assert_int_equal(half_floats[0], half);
}

TEST(an_environment_image_is_replaced_by_one_of_the_same_size)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_create());
    bring_environment_image(&fixture, 0x3c00);
    bring_environment_image(&fixture, 0x4000);
    fixture_finish(&fixture);
}

TEST(an_environment_image_stays_until_it_is_removed)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_create());
    bring_environment_image(&fixture, 0x3c00);
    struct scene_edit *edit = test_add(&fixture.edits, OBJECT_NODE);
    edit->kind = EDIT_SET_ENVIRONMENT;
    edit->set.environment = (struct scene_environment){.value.colour = {0.5f, 0.5f, 0.5f}, .value.rotation = 1};
    test_commit(&fixture.edits);
    update(&fixture);
    assert_false(fixture.gpu.has_environment_image);
    assert_int_equal(fixture.gpu.environment.name, 0);
    assert_float_equal(fixture.gpu.environment_colour[0], 0.5f, 0);
    fixture_finish(&fixture);
}

TEST(a_scene_beyond_the_device_is_refused_and_the_next_update_starts_anew)
{
    struct fixture fixture;
    struct error error = {0};
    fixture_init(&fixture, test_scene_soup());
    uint64_t max = device->facts.texture_buffer_texels_max;
    test_soup_mesh(&fixture.edits, 10, 200, 0.1f, 3);
    test_commit(&fixture.edits);
    device->facts.texture_buffer_texels_max = 300;
    assert_false(gpu_scene_update(&fixture.gpu, fixture.scene, NULL, &fixture.changes, NULL, &error));
    device->facts.texture_buffer_texels_max = max;
    assert_int_equal(error.kind, ERROR_LIMIT);
    assert_string_equal(error.text, "600 vertices; this device's texel buffers hold at most 300");
    assert_int_equal(fixture.gpu.instance_count, 0);
    assert_int_equal(gpu_scene_device_bytes(&fixture.gpu), 0);
    update(&fixture);
    expect_changes(&fixture, true, true, true, true);
    assert_int_equal(fixture.gpu.instance_count, 4);
    fixture_finish(&fixture);
}

TEST(bounds_hold_all_that_is_visible)
{
    struct fixture fixture;
    float lower[3], upper[3];
    fixture_init(&fixture, test_scene_soup());
    assert_true(scene_bounds(fixture.scene, NULL, lower, upper));
    for (int k = 0; k < 3; k++) {
        assert_float_equal(fixture.gpu.lower_world[k], lower[k], 1e-4);
        assert_float_equal(fixture.gpu.upper_world[k], upper[k], 1e-4);
    }
    assert_in_range((unsigned)fixture.gpu.diagonal, 4, 12);
    fixture_finish(&fixture);
}

/* ---- what is large ---- */

#define LARGE_TRIANGLES 200000u /* 3.2 MB of them, and 9.6 MB of each array of vertices */

static struct scene *large_scene(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    test_soup_mesh(&edits, 1, LARGE_TRIANGLES, 0.01f, 5);
    test_texture(&edits, 1, 300, 200, TEXTURE_RGBA8_SRGB, WRAP_REPEAT, WRAP_REPEAT, 7);
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    return edits.scene;
}

/* Makes one step, which has no time and reserves next to nothing; true: it was the last one. */
static bool bring(struct gpu_scene *gpu, const struct scene *scene)
{
    struct error error = {0};
    bool done = false;
    gpu_reserve_begin(device, 1);
    bool brought = gpu_scene_bring(gpu, scene, 0, &done, NULL, &error);
    bool put_off = gpu_reserve_end(device);
    assert_true(brought ? !put_off : put_off && error.kind == ERROR_BUSY);
    return brought && done;
}

static void expect_same_bytes(const struct gpu_buffer *a, const struct gpu_buffer *b)
{
    assert_int_equal(a->size_bytes, b->size_bytes);
    char *of_a = malloc(a->size_bytes), *of_b = malloc(b->size_bytes);
    gpu_buffer_read(device, a, 0, of_a, a->size_bytes);
    gpu_buffer_read(device, b, 0, of_b, b->size_bytes);
    assert_memory_equal(of_a, of_b, a->size_bytes);
    free(of_a);
    free(of_b);
}

static void expect_same_copies(const struct gpu_scene *a, const struct gpu_scene *b)
{
    assert_int_equal(a->triangles.size_bytes, LARGE_TRIANGLES * 16);
    expect_same_bytes(&a->triangles, &b->triangles);
    expect_same_bytes(&a->positions, &b->positions);
    expect_same_bytes(&a->normals, &b->normals);
    expect_same_bytes(&a->texcoords, &b->texcoords);
    expect_same_bytes(&a->texels, &b->texels);
    expect_same_bytes(&a->tables, &b->tables);
}

TEST(what_is_large_comes_in_steps_and_is_the_same_as_at_once)
{
    struct fixture at_once, in_steps = {.scene = large_scene()};
    fixture_init(&at_once, large_scene());
    gpu_scene_init(&in_steps.gpu, device);
    unsigned steps = 1;
    while (!bring(&in_steps.gpu, in_steps.scene))
        steps++;
    assert_in_range(steps, 2, UINT32_MAX); /* a step does not wait for megabytes */
    assert_false(gpu_scene_bring_waits(&in_steps.gpu));
    update(&in_steps);
    expect_changes(&in_steps, true, true, true, true);
    assert_int_equal(in_steps.changes.uploaded_bytes, at_once.changes.uploaded_bytes);
    expect_same_copies(&in_steps.gpu, &at_once.gpu);
    assert_true(bring(&in_steps.gpu, in_steps.scene));
    update(&in_steps);
    assert_int_equal(in_steps.changes.uploaded_bytes, 0);
    fixture_finish(&in_steps);
    fixture_finish(&at_once);
}

TEST(what_is_being_brought_may_be_given_up_at_any_time)
{
    struct fixture expected, fixture = {.scene = large_scene()};
    fixture_init(&expected, large_scene());
    for (int way = 0; way < 16; way += 5) {
        gpu_scene_init(&fixture.gpu, device);
        for (int step = 0; step < way; step++)
            bring(&fixture.gpu, fixture.scene);
        gpu_scene_bring_abandon(&fixture.gpu);
        update(&fixture);
        expect_same_copies(&fixture.gpu, &expected.gpu);
        gpu_scene_finish(&fixture.gpu);
        bring(&fixture.gpu, fixture.scene);
        gpu_scene_finish(&fixture.gpu);
        assert_int_equal(gpu_scene_device_bytes(&fixture.gpu), 0);
    }
    fixture_finish(&fixture);
    fixture_finish(&expected);
}
