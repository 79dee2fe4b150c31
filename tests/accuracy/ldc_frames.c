/* SPDX-License-Identifier: MIT */
/* Frames of the tracer `ldc`: what moves has a cube of its own, what stands still is sampled once, and what it
 * cannot show is refused.
 *
 * Each test prints what it measured. FARLIGHT_TEST_PICTURES=folder keeps the pictures. */
#include "tests/accuracy/against_reference.h"
#include "tests/harness/test.h"

#define RESOLUTION 1024u
/* dB. First hits of its own: the errors of planes alone are below it. Behind mirrors an edge is magnified. */
#define PSNR_MIN 42.0
#define PSNR_MIRRORS_MIN 41.0

static void request_cubes(struct fixture *fixture)
{
    request_picture(fixture, 5);
    fixture->request.tracer_options.ldc.resolution = RESOLUTION;
}

static struct frame_result render(struct fixture *fixture, unsigned tracer, const char *name)
{
    char kept[128];
    fixture->request.tracing.tracer = tracer;
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

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* Moved geometry is in a cube of its own: rays see both as one, and their reflections and shadows. */
TEST_LONG(what_moves_is_seen_with_what_stands_still)
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
    expect_like_the_reference(fixture, "two cubes", PSNR_MIRRORS_MIN);
}

/* ---- first hits of its own ---- */

/* Facets of some cells, as of a scan: all bend at their edges, and there is a shadow on them. */
static void add_facets(struct fixture *fixture)
{
    float m[12];
    uint32_t matte = add_matte(fixture, 0.7f, 0.7f, 0.7f);
    for (int i = 0; i < 2; i++) {
        uint32_t mesh = add_shape_mesh(fixture, i ? SHAPE_TORUS : SHAPE_BUMPY, 128, matte);
        struct scene_mesh *facets = &fixture->edits[fixture->edit_count - 1].set.mesh;
        blob_unref(facets->arrays[MESH_NORMALS]);
        facets->arrays[MESH_NORMALS] = NULL;
        turned(m, 0.9f, 0.5f, 0.8f * (float)i, 0.9f * (float)i, 0.3f * (float)i);
        fixture_node(fixture, NODE_MESH, mesh, m);
    }
    fixture_light(fixture, LIGHT_POINT, 2.5f, 4, 3, 300);
}

static double share(uint64_t part, const struct record_wave_comparison *wave)
{
    const uint64_t hits = wave->kind == RAY_SHADOW ? wave->rays : wave->both_hit + wave->only_reference;
    assert_true(hits > 5000);
    return (double)part / (double)hits;
}

/* The planes of samples alone give 0.06 % of these hits far off, 0.9 % with another facet's normal, and 41 dB.
 * What is left are triangles without samples, and silhouettes of surfaces that are within a cell of each other. */
TEST_LONG(first_hits_are_those_of_triangles)
{
    struct fixture *fixture = *state;
    add_facets(fixture);
    request_cubes(fixture);
    fixture->request.picture.width = fixture->request.picture.height = 256;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.tracing.tracer = TRACER_LDC;
    fixture->request.comparison.compare = true;
    fixture->request.comparison.compare_with = exact_tracer();
    struct frame_result result = fixture_render(fixture);
    assert_true(result.comparison_count >= 2);
    for (uint32_t i = 0; i < result.comparison_count; i++) {
        const struct record_wave_comparison *wave = &result.comparisons[i];
        const bool is_shadow = wave->kind == RAY_SHADOW;
        printf("wave %u %s: %.3f %% only ldc, %.3f %% only the reference, %.3f %% far, %.3f %% normals\n",
               wave->wave, is_shadow ? "shadow" : "hits", 100 * share(wave->only_tracer, wave),
               100 * share(wave->only_reference, wave), 100 * share(wave->far, wave),
               100 * share(wave->other_surface, wave));
        assert_true(share(wave->only_reference, wave) < 0.002);
        assert_true(is_shadow || (share(wave->far, wave) < 0.0005 && share(wave->other_surface, wave) < 0.002));
    }
    frame_result_finish(&result);
    fixture->request.comparison.compare = false;
    expect_like_the_reference(fixture, "facets, all traced", PSNR_MIN);
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
    fixture->request.tracing.tracer = TRACER_LDC;
    fixture->request.sampling.accumulate = true;
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
        fixture->request.tracing.tracer = compare ? TRACER_BVH : TRACER_LDC;
        fixture->request.comparison.compare = (uint32_t)compare;
        fixture->request.comparison.compare_with = TRACER_LDC;
        assert_false(frame_begin(fixture->renderer, fixture->scene, &open, &fixture->request, &error));
        assert_int_equal(error.kind, ERROR_UNSUPPORTED);
        assert_string_equal(error.field, "shutter");
        struct frame_result result = fixture_render_motion(fixture, &closed);
        frame_result_finish(&result);
    }
}
