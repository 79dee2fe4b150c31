/* SPDX-License-Identifier: MIT */
/* A-buffers with many samples behind each other, with more than there was room for, with none; what is told where
 * they do not fit; what a build costs that has been done before. */
#include "tests/unit/trace/abuffer/fixture.h"
#include "tests/unit/trace/abuffer/scenes.h"
#include "tests/unit/trace/stack_scene.h"

#include "gpu/registry.h"
#include "abuffer/layout.h"
#include "trace/abuffer/build_state.h"
#include "tests/harness/test.h"

#include <epoxy/gl.h>

#define RESOLUTION 32u
#define VOXELS 16u

static void build_and_read(struct fixture *fixture, struct contents *contents, uint32_t resolution)
{
    build(fixture, resolution, VOXELS);
    contents_read(contents, &fixture->store);
    expect_consistent(contents);
}

ALL_TESTS(open_device, close_device)

/* Few, that are sorted as they are taken; more; many, for which there is a pass of its own; and more than a
 * device's loops may go over. */
TEST(many_layers_are_sorted)
{
    static const uint32_t counts[] = {4, 9, 33, ABUFFER_LIST_MAX, ABUFFER_LIST_MAX + 1};
    for (uint32_t i = 0; i < sizeof(counts) / sizeof(counts[0]); i++) {
        struct fixture fixture;
        struct contents contents;
        fixture_init(&fixture, stack_scene(counts[i], (enum stack_order)(i % (SHUFFLED + 1)), false));
        build_and_read(&fixture, &contents, RESOLUTION);
        assert_int_equal(contents.store.depth_max, counts[i]);
        /* Along z, all of them in all texels but those of the margin; along the others at least nothing more than
         * that. */
        assert_in_range(contents.store.sample_count, counts[i] * (RESOLUTION - 1) * (RESOLUTION - 1),
                        3 * counts[i] * RESOLUTION * RESOLUTION);
        for (uint32_t texel = 2 * RESOLUTION * RESOLUTION; texel < 3 * RESOLUTION * RESOLUTION; texel++)
            assert_true(contents.texels[texel][1] == 0 || contents.texels[texel][1] == counts[i]);
        contents_free(&contents);
        fixture_finish(&fixture);
    }
}

/* Bodies in each other, a thousand: 63 is the largest number that a sample can hold. */
TEST_LONG(windings_beyond_the_stored_range_are_clamped)
{
    struct test_edits edits = {.scene = test_scene_create()};
    struct fixture fixture;
    struct contents contents;
    const uint32_t bodies = 1000;
    add_box_mesh(&edits, 1);
    for (uint32_t i = 0; i < bodies; i++) {
        float m[12], size = 1 - 0.5f * (float)i / (float)bodies;
        test_transform(m, size, size, size, 0, 0, 0, 0, 0);
        test_node(&edits, i + 1, 0, NODE_MESH, 1, m);
    }
    test_commit(&edits);
    fixture_init(&fixture, edits.scene);
    build_and_read(&fixture, &contents, RESOLUTION);
    assert_int_equal(contents.store.depth_max, 2 * bodies);
    for (uint32_t i = 0; i < texel_count_of(&contents); i++)
        for (uint32_t k = 0; k < contents.texels[i][1]; k++) {
            int inside = (int)(k < contents.texels[i][1] / 2 ? k + 1 : contents.texels[i][1] - 1 - k);
            int told = ABUFFER_WINDING_ZERO - 1;
            assert_int_equal(winding_of(&contents, contents.texels[i][0] + k), inside < told ? inside : told);
        }
    contents_free(&contents);
    fixture_finish(&fixture);
}

/* The first of several samples at one place is that of the first instance, and within it of the first
 * primitive. */
TEST(coincident_surfaces_keep_their_order)
{
    struct fixture fixture;
    struct contents contents;
    uint32_t pairs = 0;
    fixture_init(&fixture, stack_scene(20, SHUFFLED, true));
    build_and_read(&fixture, &contents, RESOLUTION); /* which holds them to their order */
    for (uint32_t i = 0; i < texel_count_of(&contents); i++)
        for (uint32_t k = 1; k < contents.texels[i][1]; k++) {
            uint32_t sample = contents.texels[i][0] + k;
            pairs += depth_of(&contents, sample) == depth_of(&contents, sample - 1);
        }
    assert_in_range(pairs, 20 * (RESOLUTION - 1) * (RESOLUTION - 1), UINT32_MAX);
    contents_free(&contents);
    fixture_finish(&fixture);
}

/* ---- room ---- */

/* The next build has room for so many fragments, as if none had needed more so far. */
static void start_with(struct fixture *fixture, uint32_t fragments)
{
    struct abuffer_builder *builder = fixture->builder;
    struct error error = {0};
    gpu_buffer_finish(device, &builder->nodes);
    expect_ok(gpu_buffer_reserve(device, &builder->nodes, (size_t)fragments * ABUFFER_NODE_BYTES, &error), &error);
    builder->nodes_max = fragments;
}

/* Nothing is lost where the lists did not fit at first, and what was drawn for nothing leaves no trace. */
TEST(lists_that_do_not_fit_are_made_anew)
{
    struct fixture fixture;
    struct contents roomy, grown, again;
    fixture_init(&fixture, scene_of_bodies_and_others());
    start_with(&fixture, 1u << 20);
    build_and_read(&fixture, &roomy, 2 * RESOLUTION);
    assert_int_equal(fixture.builder->passes, 1);
    assert_in_range(roomy.store.sample_count, 1000, 1u << 20);
    for (uint32_t first = 1; first < roomy.store.sample_count; first = 60 * first + 1) {
        start_with(&fixture, first);
        build_and_read(&fixture, &grown, 2 * RESOLUTION);
        assert_int_equal(fixture.builder->passes, 2);
        expect_same(&roomy, &grown);
        contents_free(&grown);
    }
    /* Once there is room there stays room. */
    build_and_read(&fixture, &again, 2 * RESOLUTION);
    assert_int_equal(fixture.builder->passes, 1);
    expect_same(&roomy, &again);
    contents_free(&roomy);
    contents_free(&again);
    fixture_finish(&fixture);
}

/* ---- pieces ---- */

/* By units of so many items, each a piece; leaves after `pieces`. */
static enum tracer_progress build_in_units(struct fixture *fixture, uint32_t resolution, uint32_t items,
                                           uint32_t *pieces)
{
    struct error error = {0};
    enum tracer_progress progress = TRACER_MORE;
    const uint32_t maximum = *pieces;
    place(fixture, resolution, VOXELS);
    expect_ok(abuffer_build_begin(fixture->builder, &fixture->store, &fixture->gpu, fixture->instances,
                                  fixture->instance_count, &fixture->options, &error),
              &error);
    for (*pieces = 0; progress == TRACER_MORE && *pieces < maximum; ++*pieces) {
        for (int stage = 0; stage < ABUFFER_STAGES; stage++)
            fixture->builder->unit_items[stage] = items;
        /* Other work changes the bindings in between. */
        for (unsigned unit = 0; unit < 8; unit++) {
            gpu_buffer_bind_image(device, &fixture->gpu.positions, unit, GL_R32UI);
            gpu_buffer_bind_texels(device, &fixture->gpu.positions, unit, GL_R32UI);
            gpu_buffer_bind_storage(&fixture->gpu.positions, unit);
        }
        progress = abuffer_build_step(fixture->builder, 0, &error);
    }
    expect_ok(progress != TRACER_FAILED, &error);
    return progress;
}

/* However small they are, also where lists turn out to be too small in the middle. */
TEST(a_build_in_steps_is_the_same)
{
    static const uint32_t units[] = {64, 3001};
    struct scene *(*const scenes[])(void) = {scene_of_bodies_and_others, test_scene_translucent};
    for (size_t i = 0; i < sizeof(scenes) / sizeof(scenes[0]); i++) {
        struct fixture fixture;
        struct contents whole, pieces;
        fixture_init(&fixture, scenes[i]());
        build_and_read(&fixture, &whole, 2 * RESOLUTION);
        for (size_t u = 0; u < sizeof(units) / sizeof(units[0]); u++) {
            uint32_t count = UINT32_MAX;
            start_with(&fixture, u == 0 ? 1 << 20 : 100);
            assert_int_equal(build_in_units(&fixture, 2 * RESOLUTION, units[u], &count), TRACER_DONE);
            assert_int_equal(fixture.builder->passes, u == 0 ? 1 : 2);
            assert_in_range(count, ABUFFER_STAGES - 3, UINT32_MAX);
            contents_read(&pieces, &fixture.store);
            expect_consistent(&pieces);
            expect_same(&whole, &pieces);
            contents_free(&pieces);
        }
        contents_free(&whole);
        fixture_finish(&fixture);
    }
}

/* A few triangles that take long are cut, too, and no row is left out or drawn twice. */
TEST(what_covers_much_is_drawn_in_bands)
{
    enum { LAYERS = 3, FINE = 1000 };
    struct fixture fixture;
    struct contents whole, pieces;
    uint32_t count = UINT32_MAX;
    fixture_init(&fixture, stack_scene(LAYERS, SHUFFLED, false));
    build_and_read(&fixture, &whole, FINE);
    assert_int_equal(build_in_units(&fixture, FINE, UINT32_MAX / 2, &count), TRACER_DONE);
    /* The other stages are one piece each. On a GPU it takes no time. */
    if (device->facts.software)
        assert_in_range(count, ABUFFER_STAGES - 3 + 4 * LAYERS, UINT32_MAX);
    contents_read(&pieces, &fixture.store);
    expect_same(&whole, &pieces);
    contents_free(&whole);
    contents_free(&pieces);
    fixture_finish(&fixture);
}

/* The host's part of it, too. */
TEST(deep_texels_are_sorted_in_steps)
{
    struct fixture fixture;
    struct contents whole, pieces;
    uint32_t count = UINT32_MAX, left;
    fixture_init(&fixture, stack_scene(ABUFFER_LIST_MAX + 1, SHUFFLED, false));
    build_and_read(&fixture, &whole, RESOLUTION);
    assert_int_equal(build_in_units(&fixture, RESOLUTION, 1000, &count), TRACER_DONE);
    contents_read(&pieces, &fixture.store);
    expect_same(&whole, &pieces);
    left = count - 5; /* in the middle of them: after them come four passes over voxels */
    assert_int_equal(build_in_units(&fixture, RESOLUTION, 1000, &left), TRACER_MORE);
    assert_non_null(fixture.builder->task.deep);
    abuffer_build_abandon(fixture.builder);
    contents_free(&whole);
    contents_free(&pieces);
    fixture_finish(&fixture);
}

static void expect_refused(struct fixture *fixture, enum error_code kind, const char *field)
{
    struct error error = {0};
    assert_false(try_build(fixture, &error));
    assert_int_equal(error.kind, kind);
    if (field)
        assert_string_equal(error.field, field);
    if (kind == ERROR_LIMIT && strcmp(error.field, "abuffer") == 0)
        assert_non_null(strstr(error.remedy, "memory.abuffer"));
    assert_int_equal(fixture->store.resolution, 0);
    assert_int_equal(fixture->store.sample_count, 0);
    assert_int_equal(abuffer_store_bytes(&fixture->store), 0);
}

/* Lists and samples: 28 bytes a sample, 16 a texel. */
TEST(more_than_is_allowed_is_refused_with_what_it_needs)
{
    struct fixture fixture;
    struct contents all, some;
    fixture_init(&fixture, stack_scene(200, SHUFFLED, false));
    build_and_read(&fixture, &all, 2 * RESOLUTION);
    uint64_t bytes = 28 * all.store.sample_count + 16 * texel_count_of(&all);
    uint32_t needed = (uint32_t)((bytes + (1 << 20) - 1) >> 20);
    assert_in_range(needed, 10, 100);
    fixture.options.limits.abuffer_mebibytes = needed;
    start_with(&fixture, 1000);
    build_and_read(&fixture, &some, 2 * RESOLUTION);
    expect_same(&all, &some);
    assert_in_range(some.store.sample_count * 28, 1, (uint64_t)needed << 20);
    contents_free(&some);
    for (uint32_t allowed = needed - 1; allowed > 0; allowed /= 2) {
        struct error error = {0};
        char expected[64];
        fixture.options.limits.abuffer_mebibytes = allowed;
        place(&fixture, 2 * RESOLUTION, VOXELS);
        expect_refused(&fixture, ERROR_LIMIT, "abuffer");
        place(&fixture, 2 * RESOLUTION, VOXELS);
        assert_false(try_build(&fixture, &error));
        snprintf(expected, sizeof(expected), "need %u MiB; %u MiB", needed, allowed);
        assert_non_null(strstr(error.text, expected));
    }
    /* The failure does not harm the next build. */
    fixture.options.limits.abuffer_mebibytes = 0;
    build_and_read(&fixture, &some, 2 * RESOLUTION);
    expect_same(&all, &some);
    contents_free(&all);
    contents_free(&some);
    fixture_finish(&fixture);
}

/* Texels are most of the memory at a high resolution, and are refused before anything is reserved. */
TEST(texels_alone_may_be_more_than_is_allowed)
{
    const uint32_t resolution = 512; /* 12 MiB */
    struct fixture fixture;
    fixture_init(&fixture, stack_scene(1, FRONT_TO_BACK, false));
    fixture.options.limits.abuffer_mebibytes = 11;
    place(&fixture, resolution, VOXELS);
    uint64_t before = device->memory_used_bytes;
    expect_refused(&fixture, ERROR_LIMIT, "abuffer");
    assert_in_range(device->memory_used_bytes, before, before + ((uint64_t)1 << 20)); /* the list of instances */
    fixture.options.limits.abuffer_mebibytes = 64;
    build(&fixture, resolution, VOXELS);
    assert_in_range(fixture.store.sample_count, (resolution - 1) * (resolution - 1), UINT32_MAX);
    fixture_finish(&fixture);
}

/* Each device has a size beyond which it reads nothing of a buffer, and only so much memory. */
TEST(what_a_device_cannot_hold_is_refused)
{
    const uint64_t texels_max = device->facts.texture_buffer_texels_max, limit = device->memory_limit_bytes;
    struct fixture fixture;
    fixture_init(&fixture, stack_scene(100, SHUFFLED, false));
    device->facts.texture_buffer_texels_max = 4 * VOXELS * VOXELS * VOXELS;
    place(&fixture, RESOLUTION, VOXELS); /* images of 3072 texels, 102,400 samples in the third */
    expect_refused(&fixture, ERROR_LIMIT, "abuffer");
    place(&fixture, 96, VOXELS);
    expect_refused(&fixture, ERROR_LIMIT, "options.abuffer_resolution");
    place(&fixture, RESOLUTION, 2 * VOXELS);
    expect_refused(&fixture, ERROR_LIMIT, "options.abuffer_voxels");
    device->facts.texture_buffer_texels_max = texels_max;
    device->memory_limit_bytes = device->memory_used_bytes + ((uint64_t)2 << 20);
    place(&fixture, RESOLUTION, VOXELS);
    expect_refused(&fixture, ERROR_OUT_OF_MEMORY, NULL);
    device->memory_limit_bytes = limit;
    build(&fixture, RESOLUTION, VOXELS);
    assert_int_equal(fixture.store.depth_max, 100);
    fixture_finish(&fixture);
}

/* ---- little ---- */

TEST(what_lies_beside_the_cube_is_not_in_it)
{
    struct fixture fixture;
    struct contents contents;
    struct error error = {0};
    fixture_init(&fixture, test_scene_soup());
    place(&fixture, RESOLUTION, VOXELS);
    fixture.store.lower_world[2] += 100;
    expect_ok(try_build(&fixture, &error), &error);
    contents_read(&contents, &fixture.store);
    expect_consistent(&contents);
    assert_int_equal(contents.store.sample_count, 0);
    for (uint32_t i = 0; i < VOXELS * VOXELS * VOXELS; i++)
        assert_int_equal(contents.sums[i][3], 0);
    contents_free(&contents);
    fixture_finish(&fixture);
}

/* Squares on the very sides of a cube: rounding does not take them out of it. */
TEST(what_lies_on_a_side_is_there)
{
    struct test_edits edits = {.scene = test_scene_create()};
    struct fixture fixture;
    struct contents contents;
    add_box_mesh(&edits, 1);
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    fixture_init(&fixture, edits.scene);
    place(&fixture, 30, VOXELS);
    fixture.store.cell_world = 2.0f / 30;
    for (int k = 0; k < 3; k++)
        fixture.store.lower_world[k] = -1;
    struct error error = {0};
    expect_ok(try_build(&fixture, &error), &error);
    contents_read(&contents, &fixture.store);
    expect_consistent(&contents);
    assert_int_equal(contents.store.sample_count, 3 * 2 * 30 * 30);
    assert_int_equal(contents.store.depth_max, 2);
    contents_free(&contents);
    fixture_finish(&fixture);
}
