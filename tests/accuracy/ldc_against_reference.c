/* SPDX-License-Identifier: MIT */
/* The tracer `ldc` against the reference, at the resolution that is its default: on the same waves of secondary
 * rays, and on whole pictures. It samples, so it is held to the size of a cell and to what can be seen, not to
 * rounding. What is primary is rasterised in both pictures, as in every frame without a lens.
 *
 * Each test prints what it measured. FARLIGHT_TEST_PICTURES=folder keeps the pictures. */
#include "tests/accuracy/against_reference.h"
#include "tests/harness/test.h"

#define RESOLUTION 1024u
/* What is asked of the tracer's pictures, in dB. */
#define PSNR_MIN 38.0
#define PSNR_MIN_HOLES 34.0

/* ---- pictures ---- */

static void request_cubes(struct fixture *fixture)
{
    request_picture(fixture, 5);
    fixture->request.tracer_options.ldc.resolution = RESOLUTION;
}

static struct frame_result render(struct fixture *fixture, unsigned tracer, const char *name)
{
    char kept[128];
    fixture->request.tracer = tracer;
    struct frame_result result = fixture_render(fixture);
    snprintf(kept, sizeof(kept), "ldc_%s_%s", name, tracer == TRACER_LDC ? "ldc" : "exact");
    fixture_keep(&result, kept);
    return result;
}

static void expect_like_the_reference(struct fixture *fixture, const char *name, double psnr_min)
{
    struct frame_result got = render(fixture, TRACER_LDC, name), expected = render(fixture, exact_tracer(), name);
    double reached = psnr(&got, &expected);
    printf("%s: PSNR %.1f dB\n", name, reached);
    assert_int_equal(structure_row(&got.structure, "static/samples_lost").number, 0);
    assert_int_equal(structure_row(&got.structure, "dynamic/samples_lost").number, 0);
    frame_result_finish(&got);
    frame_result_finish(&expected);
    if (!(reached >= psnr_min))
        fail_msg("%s: PSNR %.2f dB, at least %.1f is asked for", name, reached, psnr_min);
}

static void expect_scene_like_the_reference(struct fixture *fixture, void (*add)(struct fixture *fixture),
                                            const char *name, double psnr_min)
{
    add(fixture);
    request_cubes(fixture);
    expect_like_the_reference(fixture, name, psnr_min);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(mirrors_are_like_the_references)
{
    expect_scene_like_the_reference(*state, add_mirrors, "mirrors", PSNR_MIN);
}

TEST(textures_in_a_mirror_are_like_the_references)
{
    expect_scene_like_the_reference(*state, add_textured, "textures in a mirror", PSNR_MIN);
}

TEST(every_sort_of_texture_is_stored)
{
    expect_scene_like_the_reference(*state, add_every_texture, "every texture", PSNR_MIN);
}

TEST(glass_is_like_the_references)
{
    expect_scene_like_the_reference(*state, add_glass, "glass", PSNR_MIN);
}

/* Whether there is a hole is decided for a cell as a whole, so its rims are a cell's steps, and each of many rims
 * shows. */
TEST(cutouts_are_like_the_references)
{
    expect_scene_like_the_reference(*state, add_cutout, "cutouts over a mirror", PSNR_MIN_HOLES);
}

TEST(spheres_are_like_the_references)
{
    expect_scene_like_the_reference(*state, add_spheres, "spheres", PSNR_MIN);
}

TEST(distributed_rays_see_what_the_references_see)
{
    struct fixture *fixture = *state;
    fixture->request.integrator = INTEGRATOR_DISTRIBUTED;
    fixture->request.samples = 4;
    expect_scene_like_the_reference(fixture, add_mirrors, "mirrors, distributed", PSNR_MIN);
}

/* What moved lies in a cube of its own: rays see both as one, and each other's reflections and shadows. */
TEST(what_moves_is_seen_with_what_stands_still)
{
    struct fixture *fixture = *state;
    float m[12];
    add_mirrors(fixture);
    uint32_t mesh = add_shape_mesh(fixture, SHAPE_BUMPY, 96, add_matte(fixture, 0.2f, 0.5f, 0.8f));
    turned(m, 0.4f, 0, 0, 0.6f, 0);
    uint32_t node = fixture_node(fixture, NODE_MESH, mesh, m);
    request_cubes(fixture);
    struct frame_result before = render(fixture, TRACER_LDC, "before it moves");
    assert_int_equal(structure_row(&before.structure, "dynamic/resolution").number, 0);
    frame_result_finish(&before);
    for (int step = 0; step < 2; step++) {
        turned(m, 0.4f, 0.3f, 0.4f, 0.3f + 0.2f * (float)step, 0.5f);
        set_node(fixture, node, mesh, m);
        struct frame_result after = render(fixture, TRACER_LDC, "after it moved");
        assert_int_equal(structure_row(&after.structure, "dynamic/resolution").number, RESOLUTION);
        assert_int_equal(structure_row(&after.structure, "static/built").number, step == 0);
        assert_true(structure_row(&after.structure, "dynamic/built").number);
        frame_result_finish(&after);
    }
    expect_like_the_reference(fixture, "two cubes", PSNR_MIN);
}

/* ---- frames ---- */

TEST(switching_to_another_tracer_and_back_builds_nothing)
{
    struct fixture *fixture = *state;
    static const struct {
        unsigned tracer;
        bool builds;
    } frames[] = {
        {TRACER_LDC, true}, {TRACER_BVH, false}, {TRACER_LDC, false}, {TRACER_BVH, false}, {TRACER_LDC, false}};
    add_mirrors(fixture);
    request_cubes(fixture);
    fixture->request.tracer_options.ldc.resolution = 128;
    for (size_t i = 0; i < sizeof(frames) / sizeof(frames[0]); i++) {
        struct frame_result result = render(fixture, frames[i].tracer, "switched");
        assert_int_equal(structure_row(&result.structure, "static/built").number, frames[i].builds);
        assert_int_equal(structure_row(&result.structure, "static/resolution").number,
                         frames[i].tracer == TRACER_LDC ? 128 : 0);
        frame_result_finish(&result);
    }
}

/* A picture that goes on does so only with what it was begun with. */
TEST(a_picture_of_other_cubes_begins_anew)
{
    struct fixture *fixture = *state;
    add_mirrors(fixture);
    fixture->request.tracer = TRACER_LDC;
    fixture->request.accumulate = true;
    fixture->request.tracer_options.ldc.resolution = 64;
    for (uint32_t i = 1; i <= 2; i++) {
        struct frame_result result = fixture_render(fixture);
        assert_int_equal(result.samples, i);
        frame_result_finish(&result);
    }
    fixture->request.tracer_options.ldc.resolution = 128;
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.samples, 1);
    frame_result_finish(&result);
}

TEST(what_moves_while_the_shutter_is_open_is_refused_at_once)
{
    struct fixture *fixture = *state;
    float m[12];
    uint32_t mesh = add_shape_mesh(fixture, SHAPE_SPHERE, 16, add_matte(fixture, 0.5f, 0.5f, 0.5f));
    uint32_t node = fixture_node(fixture, NODE_MESH, mesh, NULL);
    fixture_commit(fixture);
    struct pose_node places[2] = {{.node = node}, {.node = node}};
    struct scene_pose poses[2] = {{.nodes = &places[0], .node_count = 1}, {.nodes = &places[1], .node_count = 1}};
    for (int i = 0; i < 2; i++) {
        turned(m, 1, 0, (float)i, 0, 0);
        memcpy(places[i].parent_from_node, m, sizeof(m));
    }
    const struct scene_motion open = {.poses = poses, .pose_count = 2}, closed = {.poses = poses, .pose_count = 1};
    fixture->request.tracer_options.ldc.resolution = 64;
    for (int compare = 0; compare < 2; compare++) {
        struct error error = {0};
        fixture->request.tracer = compare ? TRACER_BVH : TRACER_LDC;
        fixture->request.compare = compare;
        fixture->request.compare_with = TRACER_LDC;
        assert_false(frame_begin(fixture->renderer, fixture->scene, &open, &fixture->request, &error));
        assert_int_equal(error.kind, ERROR_UNSUPPORTED);
        assert_string_equal(error.field, "shutter");
        struct frame_result result = fixture_render_motion(fixture, &closed);
        frame_result_finish(&result);
    }
}

/* ---- rays ---- */

static void expect_rays_agree(struct fixture *fixture, const char *name, float cell_metres)
{
    static const struct agreement asked = {.agreed = 0.99, .median_cells = 0.25, .most_cells = INFINITY};
    struct agreement found = compare_rays(fixture, TRACER_LDC, name, cell_metres);
    expect_agreement(name, &found, &asked);
}

TEST(secondary_rays_agree_with_the_reference)
{
    with_pairs_of_shapes(state, TRACER_LDC, request_cubes, expect_rays_agree);
}
