/* SPDX-License-Identifier: MIT */
/* Drawing in parts: how much a part draws goes by the pixels that its primitives cover, not by their number. */
#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/waves.h"
#include "tests/harness/test.h"

#include "shared/bindings.h"
#include "trace/raster/view.h"

#include <epoxy/gl.h>

ALL_TESTS(open_device, close_device)

#define SIZE 512u
#define DISTANCE 10.0f
#define SHEETS 1000u
/* Pixels of plain triangles, and of spheres and discs, that a part may have before anything is learnt. */
#define PART_PIXELS (3u << 21)
#define PART_PIXELS_DECIDED ((3u << 15) * 6u)

/* Triangles behind one another about the origin, which each cover `share` of a picture's side. */
static void add_sheets(struct test_edits *edits, uint32_t id, uint32_t count, float share)
{
    float(*positions)[3] = malloc(3 * count * sizeof(*positions));
    uint32_t *indices = malloc(3 * count * sizeof(*indices));
    const float half = 0.5f * DISTANCE * share;
    for (uint32_t i = 0; i < 3 * count; i++) {
        indices[i] = i;
        positions[i][0] = i % 3 == 1 ? 3 * half : -half;
        positions[i][1] = i % 3 == 2 ? 3 * half : -half;
        positions[i][2] = -1e-4f * (float)(i / 3);
    }
    test_mesh(edits, id, (const float(*)[3])positions, 3 * count, indices, count);
    free(positions);
    free(indices);
}

static void add_spheres(struct test_edits *edits, uint32_t count, float radius)
{
    float(*spheres)[4] = calloc(count, sizeof(*spheres));
    for (uint32_t i = 0; i < count; i++)
        spheres[i][3] = radius;
    test_spheres(edits, 1, (const float(*)[4])spheres, count);
    free(spheres);
}

/* Draws from `DISTANCE` in front of the origin, with a half extent of 0.5 at distance 1. Takes the scene. */
static uint32_t parts_of(struct scene *scene)
{
    struct error error = {0};
    struct gpu_scene gpu;
    struct scene_changes changes;
    struct gpu_texture visible = {0}, depth = {0};
    struct gpu_framebuffer framebuffer = {0};
    struct gpu_buffer uniforms_buffer = {0};
    struct frame_uniforms uniforms = {.sample_places = {{0.5f, 0.5f}}};
    const struct raster_camera camera = {.world_from_view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, DISTANCE},
                                         .extent = {0.5f, 0.5f},
                                         .near = 0.01f,
                                         .width = SIZE,
                                         .height = SIZE};
    gpu_scene_init(&gpu, device);
    raster_camera_fill(&uniforms, &camera);
    expect_ok(gpu_scene_update(&gpu, scene, NULL, &changes, NULL, &error) &&
                  gpu_texture_reserve_array(device, &visible, GL_RG32UI, SIZE, SIZE, 1, &error) &&
                  gpu_texture_reserve(device, &depth, GL_DEPTH_COMPONENT32F, SIZE, SIZE, &error) &&
                  gpu_buffer_upload(device, &uniforms_buffer, &uniforms, sizeof(uniforms), &error),
              &error);
    const struct gpu_layer_target target = {.colours = &visible, .count = 1, .depth = &depth};
    expect_ok(gpu_framebuffer_create_layers(device, &framebuffer, &target, &error), &error);
    gpu_scene_bind(&gpu);
    gpu_buffer_bind_uniform(&uniforms_buffer, UNIFORM_FRAME);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name);
    glViewport(0, 0, SIZE, SIZE);
    struct raster_view view = {0};
    const struct raster_view_target drawn = {.device = device, .scene = &gpu, .frame = &uniforms};
    raster_view_begin(&view);
    uint32_t parts = 0;
    for (bool whole = false; !whole; parts++)
        expect_ok(raster_view_draw(&view, &drawn, &whole, &error), &error);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    gpu_framebuffer_finish(device, &framebuffer);
    gpu_texture_finish(device, &visible);
    gpu_texture_finish(device, &depth);
    gpu_buffer_finish(device, &uniforms_buffer);
    gpu_scene_finish(&gpu);
    scene_destroy(scene);
    return parts * device->facts.step_scale;
}

static struct scene *sheets(uint32_t count, float share)
{
    struct test_edits edits = {.scene = test_scene_create()};
    add_sheets(&edits, 1, count, share);
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    return edits.scene;
}

TEST(triangles_that_fill_the_picture_are_drawn_in_parts_of_some_million_pixels)
{
    const uint32_t parts = parts_of(sheets(SHEETS, 1.0f)), least = SHEETS * SIZE * SIZE / PART_PIXELS;
    assert_in_range(parts, least, 3 * least);
}

TEST(many_small_triangles_are_one_part)
{
    assert_int_equal(parts_of(sheets(16000, 0.001f)), device->facts.step_scale);
}

TEST(few_triangles_that_fill_the_picture_after_many_small_ones_are_parts_of_their_own)
{
    struct test_edits edits = {.scene = test_scene_create()};
    add_sheets(&edits, 1, 8000, 0.001f);
    add_sheets(&edits, 2, SHEETS, 1.0f);
    for (uint32_t i = 1; i <= 2; i++)
        test_node(&edits, i, 0, NODE_MESH, i, NULL);
    test_commit(&edits);
    const uint32_t parts = parts_of(edits.scene), least = SHEETS * SIZE * SIZE / PART_PIXELS;
    assert_in_range(parts, least, 3 * least);
}

TEST(instances_that_fill_the_picture_count_each)
{
    struct test_edits edits = {.scene = test_scene_create()};
    add_sheets(&edits, 1, 1, 1.0f);
    for (uint32_t i = 1; i <= SHEETS; i++)
        test_node(&edits, i, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    const uint32_t parts = parts_of(edits.scene), least = SHEETS * SIZE * SIZE / PART_PIXELS;
    assert_in_range(parts, least, 3 * least);
}

TEST(large_spheres_are_drawn_in_smaller_parts_and_small_ones_together)
{
    const uint32_t count = 100, least = count * SIZE * SIZE / PART_PIXELS_DECIDED;
    for (int is_large = 0; is_large < 2; is_large++) {
        struct test_edits edits = {.scene = test_scene_create()};
        add_spheres(&edits, count, is_large ? 5.0f : 0.01f);
        test_node(&edits, 1, 0, NODE_SPHERES, 1, NULL);
        test_commit(&edits);
        const uint32_t parts = parts_of(edits.scene);
        assert_in_range(parts, is_large ? least : 1, is_large ? count : device->facts.step_scale);
    }
}

TEST(what_lies_behind_the_eye_costs_its_vertices_alone)
{
    struct test_edits edits = {.scene = test_scene_create()};
    float m[12];
    test_transform(m, 1, 1, 1, 0, 0, 0, 0, 100);
    add_sheets(&edits, 1, SHEETS, 1.0f);
    test_node(&edits, 1, 0, NODE_MESH, 1, m);
    test_commit(&edits);
    assert_int_equal(parts_of(edits.scene), device->facts.step_scale);
}
