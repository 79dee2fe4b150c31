/* SPDX-License-Identifier: MIT */
/* Renderers that share a scene on the device: frames that are stepped in turns show what each shows alone, and
 * none begins that would change what another one in progress looks at. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "render/frame/state.h"
#include "tests/harness/test.h"

static uint32_t build_scene(struct fixture *fixture)
{
    struct scene_material *ground = fixture_material(fixture), *mirror = fixture_material(fixture),
                          *glass = fixture_material(fixture);
    ground->value.roughness = 0.4f;
    ground->value.ior = 1.5f;
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.1f;
    glass->value.transmission = 1.0f;
    glass->value.roughness = 0.0f;
    glass->value.ior = 1.5f;
    fixture_square(fixture, 6.0f, ground->base.id, NULL);
    uint32_t node = fixture->next_id - 1;
    fixture_sphere(fixture, -0.7f, 0.2f, 0.7f, 0.6f, mirror->base.id);
    fixture_sphere(fixture, 0.8f, -0.2f, 0.7f, 0.6f, glass->base.id);
    fixture_light(fixture, LIGHT_POINT, 1.0f, 2.0f, 3.0f, 20.0f);
    fixture_light(fixture, LIGHT_RECTANGLE, -1.0f, 1.0f, 3.0f, 5.0f);
    fixture_environment(fixture, 0.2f, 0.2f, 0.3f);
    fixture_commit(fixture);
    return node;
}

static struct frame_renderer *another_renderer(struct fixture *fixture)
{
    struct error error = {0};
    struct frame_renderer *renderer = frame_renderer_create(fixture->shared, &error);
    assert_non_null(renderer);
    return renderer;
}

static void begin(struct fixture *fixture, struct frame_renderer *renderer, const struct frame_request *request)
{
    struct error error = {0};
    assert_true(frame_may_begin(renderer, fixture->scene, NULL, request));
    if (!frame_begin(renderer, fixture->scene, NULL, request, &error))
        fail_msg("frame_begin: %s: %s", error.field, error.text);
}

static struct frame_result finish(struct frame_renderer *renderer)
{
    struct frame_result result = {0};
    struct error error = {0};
    enum frame_progress progress;
    while ((progress = frame_step(renderer, &result, &error)) == FRAME_MORE)
        continue;
    if (progress != FRAME_DONE)
        fail_msg("frame_step: %s: %s", error.field, error.text);
    return result;
}

/* ---- the same to the bit ------------------------------------------------------------------------- */

enum { VIEWS = 6, VIEWS_SHORT = 2, PASSES = 2 };

/* Every integrator and primary way, sizes of several slices, cameras of their own, layers, a comparison. */
static struct frame_request view_request(struct fixture *fixture, uint32_t view)
{
    static const struct {
        enum integrator_kind integrator;
        enum primary_kind primary;
        unsigned tracer;
        uint32_t width, height, samples, layers;
        bool accumulate, compare;
    } views[VIEWS] = {
        {INTEGRATOR_WHITTED, PRIMARY_RASTER, TRACER_BVH, 200, 150, 2, 0, true, false},
        {INTEGRATOR_PATH, PRIMARY_TRACE, TRACER_BVH, 150, 100, 4, 0, true, false},
        {INTEGRATOR_AO, PRIMARY_RASTER, TRACER_NAIVE, 90, 70, 1, 0, false, false},
        {INTEGRATOR_DISTRIBUTED, PRIMARY_TRACE, TRACER_LDC, 120, 100, 3, 0, true, false},
        {INTEGRATOR_RAYCAST, PRIMARY_RASTER, TRACER_BVH, 110, 90, 2, 1u << LAYER_BEAUTY | 1u << LAYER_NORMAL, true,
         false},
        {INTEGRATOR_WHITTED, PRIMARY_TRACE, TRACER_BVH, 80, 60, 1, 0, false, true},
    };
    struct frame_request request = fixture->request;
    request.light.integrator = views[view].integrator;
    request.tracing.primary = views[view].primary;
    request.tracing.tracer = views[view].tracer;
    request.picture.width = views[view].width;
    request.picture.height = views[view].height;
    request.sampling.samples = views[view].samples;
    request.picture.layers = views[view].layers;
    request.sampling.accumulate = views[view].accumulate;
    request.comparison.compare = views[view].compare;
    request.comparison.compare_with = TRACER_NAIVE;
    request.sampling.seed = view;
    request.tracer_options.ldc.resolution = 64;
    const float eye[3] = {(float)view - 2.5f, 0.5f, 5.0f}, target[3] = {0}, up[3] = {0, 1, 0};
    assert_true(frame_camera_look_at(&request.camera, eye, target, up, 0.6f));
    return request;
}

static void keep(struct frame_result *kept, struct frame_result *result)
{
    free(result->comparisons);
    result->comparisons = NULL;
    *kept = *result;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static void expect_same_in_turns(struct fixture *fixture, uint32_t views)
{
    struct frame_result alone[VIEWS][PASSES] = {0};
    struct frame_renderer *renderers[VIEWS];
    struct frame_request requests[VIEWS];
    build_scene(fixture);
    for (uint32_t view = 0; view < views; view++) {
        requests[view] = view_request(fixture, view);
        renderers[view] = another_renderer(fixture);
        for (int pass = 0; pass < PASSES; pass++) {
            begin(fixture, renderers[view], &requests[view]);
            struct frame_result result = finish(renderers[view]);
            keep(&alone[view][pass], &result);
        }
        frame_renderer_destroy(renderers[view]);
        renderers[view] = another_renderer(fixture);
    }
    int passes[VIEWS] = {0};
    bool running[VIEWS] = {false};
    for (uint32_t left = views; left > 0;) {
        for (uint32_t view = 0; view < views; view++) {
            struct frame_result result = {0};
            struct error error = {0};
            if (passes[view] == PASSES)
                continue;
            if (!running[view])
                begin(fixture, renderers[view], &requests[view]);
            running[view] = true;
            enum frame_progress progress = frame_step(renderers[view], &result, &error);
            if (progress == FRAME_FAILED)
                fail_msg("frame_step: %s: %s", error.field, error.text);
            if (progress == FRAME_MORE)
                continue;
            const struct frame_result *own = &alone[view][passes[view]];
            assert_int_equal(result.samples, own->samples);
            assert_int_equal(result.size_bytes, own->size_bytes);
            if (memcmp(result.pixels, own->pixels, own->size_bytes) != 0)
                fail_msg("frame %d of view %u shows something else beside others", passes[view], view);
            frame_result_finish(&result);
            running[view] = false;
            left -= ++passes[view] == PASSES;
        }
    }
    for (uint32_t view = 0; view < views; view++) {
        for (int pass = 0; pass < PASSES; pass++)
            frame_result_finish(&alone[view][pass]);
        frame_renderer_destroy(renderers[view]);
    }
}

TEST(frames_in_turns_are_those_of_each_alone)
{
    expect_same_in_turns(*state, VIEWS_SHORT);
}

TEST_LONG(so_are_those_of_all_integrators_tracers_layers_and_comparisons)
{
    expect_same_in_turns(*state, VIEWS);
}

/* ---- who may begin ------------------------------------------------------------------------------- */

TEST(what_moves_is_alone)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    uint32_t node = build_scene(fixture);
    struct frame_renderer *first = fixture->renderer, *second = another_renderer(fixture);
    const float raised[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.3f};
    struct pose_node place = {.node = node};
    memcpy(place.parent_from_node, raised, sizeof(raised));
    struct scene_pose pose = {.nodes = &place, .node_count = 1};
    const struct scene_motion motion = {.poses = &pose, .pose_count = 1};
    const struct frame_request *request = &fixture->request;

    begin(fixture, first, request);
    assert_true(frame_may_begin(first, fixture->scene, &motion, request)); /* in place of the one in progress */
    assert_false(frame_may_begin(second, fixture->scene, &motion, request));
    assert_false(frame_begin(second, fixture->scene, &motion, request, &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    struct frame_result at_rest = finish(first);
    error = (struct error){0};
    assert_true(frame_may_begin(second, fixture->scene, &motion, request));
    assert_true(frame_begin(second, fixture->scene, &motion, request, &error));
    assert_false(frame_may_begin(first, fixture->scene, NULL, request));
    assert_false(frame_may_begin(first, fixture->scene, &motion, request));
    struct frame_result moved = finish(second);
    /* The first frame still has it moved: the next one puts it back, and until then nothing can begin beside
     * others. */
    begin(fixture, first, request);
    begin(fixture, second, request);
    struct frame_result back[2] = {finish(second), finish(first)};
    assert_memory_not_equal(at_rest.pixels, moved.pixels, moved.size_bytes);
    for (int i = 0; i < 2; i++) {
        assert_memory_equal(at_rest.pixels, back[i].pixels, moved.size_bytes);
        frame_result_finish(&back[i]);
    }
    frame_result_finish(&at_rest);
    frame_result_finish(&moved);
    frame_renderer_destroy(second);
}

TEST(another_revision_waits_for_the_frames_of_the_one_before)
{
    struct fixture *fixture = *state;
    uint32_t node = build_scene(fixture);
    struct frame_renderer *first = fixture->renderer, *second = another_renderer(fixture);
    struct scene *other = fixture->scene;
    begin(fixture, first, &fixture->request);
    assert_true(frame_may_begin(second, fixture->scene, NULL, &fixture->request));
    /* The scene itself is not edited meanwhile; a later revision is one of a second scene here. */
    fixture->scene = scene_create("later", &(struct scene_limits){.host_bytes = 1u << 30});
    assert_non_null(fixture->scene);
    fixture->next_id = 1;
    assert_int_equal(build_scene(fixture), node);
    struct scene_edit *edit = fixture_edit(fixture, OBJECT_NODE);
    edit->kind = EDIT_REMOVE;
    edit->id = node;
    fixture_commit(fixture);
    assert_true(fixture->scene->revision != other->revision);
    assert_false(frame_may_begin(second, fixture->scene, NULL, &fixture->request));
    frame_abandon(first);
    assert_true(frame_may_begin(second, fixture->scene, NULL, &fixture->request));
    frame_renderer_destroy(second);
    scene_destroy(other);
}

TEST(tracers_in_use_stay)
{
    struct fixture *fixture = *state;
    struct frame_renderer *renderers[6];
    struct frame_request requests[6];
    build_scene(fixture);
    /* Cubes of other resolutions are other tracers, of which four are kept. */
    for (uint32_t i = 0; i < 6; i++) {
        renderers[i] = another_renderer(fixture);
        requests[i] = fixture->request;
        requests[i].tracing.tracer = TRACER_LDC;
        requests[i].tracing.primary = PRIMARY_TRACE;
        requests[i].tracer_options.ldc.resolution = 32 + 16 * (i % 5);
    }
    for (uint32_t i = 0; i < 4; i++)
        begin(fixture, renderers[i], &requests[i]);
    assert_false(frame_may_begin(renderers[4], fixture->scene, NULL, &requests[4]));
    begin(fixture, renderers[5], &requests[5]); /* shares the first one's */
    frame_abandon(renderers[0]);
    assert_false(frame_may_begin(renderers[4], fixture->scene, NULL, &requests[4]));
    frame_abandon(renderers[5]);
    begin(fixture, renderers[4], &requests[4]);
    for (uint32_t i = 1; i < 5; i++) {
        struct frame_result result = finish(renderers[i]);
        frame_result_finish(&result);
    }
    /* Two at once need two. */
    for (uint32_t i = 1; i < 4; i++)
        begin(fixture, renderers[i], &requests[i]);
    requests[0].comparison.compare = true;
    requests[0].comparison.compare_with = TRACER_NAIVE;
    assert_false(frame_may_begin(renderers[0], fixture->scene, NULL, &requests[0]));
    frame_abandon(renderers[1]);
    begin(fixture, renderers[0], &requests[0]);
    for (uint32_t i = 0; i < 6; i++)
        frame_renderer_destroy(renderers[i]);
}

TEST(a_renderer_destroyed_within_a_frame_releases_what_it_shares)
{
    struct fixture *fixture = *state;
    uint32_t node = build_scene(fixture);
    struct frame_renderer *second = another_renderer(fixture);
    struct pose_node place = {.node = node, .parent_from_node = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.3f}};
    struct scene_pose pose = {.nodes = &place, .node_count = 1};
    const struct scene_motion motion = {.poses = &pose, .pose_count = 1};
    begin(fixture, second, &fixture->request);
    assert_false(frame_may_begin(fixture->renderer, fixture->scene, &motion, &fixture->request));
    frame_renderer_destroy(second);
    assert_true(frame_may_begin(fixture->renderer, fixture->scene, &motion, &fixture->request));
}

TEST(samples_are_not_added_to_those_from_before_others_moved_something)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    uint32_t node = build_scene(fixture);
    struct frame_renderer *second = another_renderer(fixture);
    struct pose_node place = {.node = node, .parent_from_node = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.3f}};
    struct scene_pose pose = {.nodes = &place, .node_count = 1};
    const struct scene_motion motion = {.poses = &pose, .pose_count = 1};
    struct frame_request request = fixture->request;
    request.sampling.accumulate = true;
    static const uint32_t held[] = {1, 2, 1, 2};
    for (int i = 0; i < 4; i++) {
        begin(fixture, fixture->renderer, &request);
        struct frame_result result = finish(fixture->renderer);
        assert_int_equal(result.samples, held[i]);
        frame_result_finish(&result);
        if (i != 1)
            continue;
        assert_true(frame_begin(second, fixture->scene, &motion, &request, &error));
        result = finish(second);
        assert_int_equal(result.samples, 1);
        frame_result_finish(&result);
    }
    frame_renderer_destroy(second);
}

/* The pictures have several bands and planes, are read back in turns, and after one that was dropped. */
TEST_LONG(pictures_that_are_read_back_beside_others_are_the_same)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    struct frame_result alone[3], beside[3];
    struct frame_renderer *other = another_renderer(fixture);
    static const struct {
        uint32_t width, height, layers;
        enum pixel_format format;
    } forms[3] = {
        {700, 900, 0, PIXEL_FORMAT_RGBA8},
        {50, 40, 0, PIXEL_FORMAT_RGBA16F},
        {600, 500, 1u << LAYER_BEAUTY | 1u << LAYER_DEPTH | 1u << LAYER_ID, PIXEL_FORMAT_RGBA32F},
    };
    build_scene(fixture);
    for (int i = 0; i < 3; i++) {
        struct frame_request request = fixture->request;
        request.picture.width = forms[i].width;
        request.picture.height = forms[i].height;
        request.picture.layers = forms[i].layers;
        request.picture.format = forms[i].format;
        request.light.depth = 1;
        begin(fixture, fixture->renderer, &request);
        alone[i] = finish(fixture->renderer);
        begin(fixture, fixture->renderer, &request);
        struct frame_result dropped = {0};
        while (!frame_step_waits(fixture->renderer) && !dropped.pixels)
            if (frame_step(fixture->renderer, &dropped, &error) == FRAME_FAILED)
                fail_msg("frame_step: %s", error.text);
        frame_abandon(fixture->renderer); /* while a copy is on its way, if the device is slow enough to show it */
        frame_result_finish(&dropped);
        begin(fixture, fixture->renderer, &request);
        begin(fixture, other, &fixture->request);
        struct frame_result small = finish(other);
        beside[i] = finish(fixture->renderer);
        frame_result_finish(&small);
        assert_false(frame_step_waits(fixture->renderer));
        assert_int_equal(beside[i].size_bytes, alone[i].size_bytes);
        assert_memory_equal(beside[i].pixels, alone[i].pixels, alone[i].size_bytes);
        assert_true(stage_times_sum_ns(&beside[i].times, STAGE_READBACK, CLOCK_CPU) > 0);
        frame_result_finish(&alone[i]);
        frame_result_finish(&beside[i]);
    }
    frame_renderer_destroy(other);
}

TEST(a_renderer_without_a_frame_in_progress_holds_only_a_picture)
{
    enum { WATCHERS = 8 };
    struct fixture *fixture = *state;
    struct frame_renderer *renderers[WATCHERS];
    build_scene(fixture);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.picture.width = 160;
    fixture->request.picture.height = 120;
    begin(fixture, fixture->renderer, &fixture->request);
    struct frame_result result = finish(fixture->renderer);
    frame_result_finish(&result);
    uint64_t picture_bytes = frame_renderer_device_bytes(fixture->renderer);
    uint64_t shared_bytes = frame_scene_device_bytes(fixture->shared),
             used_bytes = fixture->device->memory_used_bytes;
    /* A sum of four floats for each pixel and what is read back of it, all bands at once here. */
    assert_int_equal(picture_bytes, 160 * 120 * (16 + 16));
    for (int i = 0; i < WATCHERS; i++) {
        renderers[i] = another_renderer(fixture);
        begin(fixture, renderers[i], &fixture->request);
        /* On a busy machine it has its memory in a later step. */
        for (struct error error = {0}; renderers[i]->phase == PHASE_BUILD;)
            assert_int_equal(frame_step(renderers[i], &result, &error), FRAME_MORE);
    }
    assert_true(fixture->device->memory_used_bytes > used_bytes + WATCHERS * 2 * picture_bytes);
    for (int i = 0; i < WATCHERS; i++) {
        result = finish(renderers[i]);
        frame_result_finish(&result);
        assert_int_equal(frame_renderer_device_bytes(renderers[i]), picture_bytes);
    }
    assert_int_equal(frame_scene_device_bytes(fixture->shared), shared_bytes);
    assert_true(fixture->device->memory_used_bytes <= used_bytes + WATCHERS * picture_bytes);
    for (int i = 0; i < WATCHERS; i++)
        frame_renderer_destroy(renderers[i]);
}
