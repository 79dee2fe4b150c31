/* SPDX-License-Identifier: MIT */
/* A frame goes on in short steps, so that a cancel is served soon, whatever the integrator and however slow the
 * tracer; and how it is cut into steps is not seen in the picture. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"

#include "render/frame/state.h"
#include "trace/tracer.h"
#include "tests/harness/test.h"

#include <time.h>

/* A tracer that takes so long for a ray: on software GL slow ones take a few microseconds. At that, so many rays
 * are 50 ms, in which a cancel is to be served; other work on the machine makes steps of fewer rays. */
#define RAY_NS 4000u
#define STEP_RAYS_MAX (50000000u / RAY_NS)

static const struct tracer_impl *behind; /* the tracer that answers */
static bool slow;
static uint64_t rays_of_step;
static unsigned waves_of_step;

static bool count_rays(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                       const struct ray_range *rays, struct error *error)
{
    const uint64_t count = rays->end - rays->first, ns = slow ? count * RAY_NS : 0;
    waves_of_step++;
    nanosleep(&(struct timespec){(time_t)(ns / 1000000000u), (long)(ns % 1000000000u)}, NULL);
    bool traced = behind->trace_range(tracer, scene, state, rays, error);
    rays_of_step += state->range_end - rays->first; /* the range may have ended early */
    return traced;
}

/* More lights than go into one batch, mirrors, glass and panes. */
static void a_crowded_scene(struct fixture *fixture)
{
    struct scene_material *ground = fixture_material(fixture), *mirror = fixture_material(fixture),
                          *glass = fixture_material(fixture), *pane = fixture_material(fixture);
    ground->value.roughness = 0.2f;
    ground->value.ior = 1.5f;
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.0f;
    glass->value.transmission = 1.0f;
    glass->value.roughness = 0.0f;
    glass->value.ior = 1.5f;
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.5f;
    const float before[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.5f};
    fixture_square(fixture, 9.0f, ground->base.id, NULL);
    fixture_square(fixture, 1.0f, pane->base.id, before);
    fixture_sphere(fixture, -1.0f, 0.2f, 0.7f, 0.6f, mirror->base.id);
    fixture_sphere(fixture, 0.8f, -0.2f, 0.7f, 0.6f, glass->base.id);
    for (int i = 0; i < 6; i++)
        fixture_light(fixture, i % 2 ? LIGHT_RECTANGLE : LIGHT_POINT, (float)i - 2.5f, 1.0f, 3.0f, 1.0f);
    fixture_environment(fixture, 0.2f, 0.2f, 0.3f);
}

struct counts {
    uint64_t rays, max, steps;
};

/* The request, by that tracer, which is slow or as it is. */
static struct frame_result render_counted(struct fixture *fixture, unsigned tracer, bool is_slow,
                                          struct counts *counts)
{
    struct error error = {0};
    struct frame_result result = {0};
    enum frame_progress progress;
    behind = tracer_impl_by_number(tracer);
    slow = is_slow;
    static struct tracer_impl counted[TRACER_COUNT]; /* the renderer keeps tracers of them */
    counted[tracer] = *behind;
    counted[tracer].trace_range = count_rays;
    frame_renderer_stand_in(fixture->renderer, tracer, &counted[tracer]);
    fixture->request.tracing.tracer = tracer;
    *counts = (struct counts){0};
    if (!frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error))
        fail_msg("frame_begin: %s: %s", error.field, error.text);
    do {
        rays_of_step = waves_of_step = 0;
        progress = frame_step(fixture->renderer, &result, &error);
        assert_true(waves_of_step <= 1);
        counts->max = rays_of_step > counts->max ? rays_of_step : counts->max;
        counts->rays += rays_of_step;
        counts->steps++;
    } while (progress == FRAME_MORE);
    if (progress != FRAME_DONE)
        fail_msg("frame_step: %s: %s", error.field, error.text);
    return result;
}

/* Twice, as it is and slow: other steps, the same picture. */
static void expect_short_steps(struct fixture *fixture, unsigned tracer, const char *name)
{
    struct counts whole, parts;
    struct frame_result expected = render_counted(fixture, tracer, false, &whole);
    struct frame_result got = render_counted(fixture, tracer, true, &parts);
    print_message("%s: %llu rays in %llu steps, where they are slow in %llu, %llu in one at most\n", name,
                  (unsigned long long)whole.rays, (unsigned long long)whole.steps, (unsigned long long)parts.steps,
                  (unsigned long long)parts.max);
    if (fixture->device->facts
            .software) { /* a GPU's waves are queued before it is known how many rays they have */
        assert_true(parts.rays == whole.rays);
        assert_true(parts.max <= STEP_RAYS_MAX);
    }
    assert_true(got.size_bytes == expected.size_bytes);
    assert_memory_equal(got.pixels, expected.pixels, expected.size_bytes);
    frame_result_finish(&expected);
    frame_result_finish(&got);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(no_step_is_long_where_rays_are_slow)
{
    struct fixture *fixture = *state;
    static const struct form {
        const char *name;
        enum integrator_kind integrator;
        uint32_t samples, ao_rays, layers;
        enum primary_kind primary;
    } forms[] = {
        {"path", INTEGRATOR_PATH, 2, 0, 0, PRIMARY_TRACE},
        {"whitted", INTEGRATOR_WHITTED, 1, 0, 0, PRIMARY_RASTER},
        {"whitted, traced", INTEGRATOR_WHITTED, 2, 0, 0, PRIMARY_TRACE},
        {"distributed", INTEGRATOR_DISTRIBUTED, 2, 0, 0, PRIMARY_TRACE},
        {"raycast", INTEGRATOR_RAYCAST, 1, 0, 0, PRIMARY_TRACE},
        {"ao, 8 rays", INTEGRATOR_AO, 1, 8, 0, PRIMARY_RASTER},
        {"ao, 24 rays", INTEGRATOR_AO, 1, 24, 0, PRIMARY_TRACE}, /* more than there is room for at once */
        {"layer ao", INTEGRATOR_RAYCAST, 1, 8, 1u << LAYER_AO, PRIMARY_RASTER},
    };
    a_crowded_scene(fixture);
    fixture_commit(fixture);
    fixture->request.picture.width = 128;
    fixture->request.picture.height = 72;
    for (size_t i = 0; i < (getenv("FARLIGHT_TEST_LONG") ? sizeof(forms) / sizeof(forms[0]) : 1); i++) {
        fixture->request.light.integrator = forms[i].integrator;
        fixture->request.sampling.samples = forms[i].samples;
        fixture->request.light.ao_rays = forms[i].ao_rays;
        fixture->request.picture.layers = forms[i].layers;
        fixture->request.tracing.primary = forms[i].primary;
        expect_short_steps(fixture, TRACER_BVH, forms[i].name);
    }
}

TEST_LONG(every_tracer_finds_the_same_in_parts)
{
    struct fixture *fixture = *state;
    a_crowded_scene(fixture);
    fixture_commit(fixture);
    fixture->request.picture.width = 80;
    fixture->request.picture.height = 45;
    fixture->request.sampling.samples = 2;
    fixture->request.light.integrator = INTEGRATOR_PATH;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.tracer_options.ldc.resolution = fixture->request.tracer_options.abuffer.resolution = 128;
    for (unsigned tracer = 0; tracer < TRACER_COUNT; tracer++)
        if (tracer_impl_by_number(tracer))
            expect_short_steps(fixture, tracer, tracer_impl_by_number(tracer)->name);
}

/* ---- triangles ---- */

/* A hilly field of so many squares, each of two triangles, shown twice. */
static void a_field(struct fixture *fixture, uint32_t material, uint32_t columns, uint32_t rows)
{
    const uint32_t vertices = (columns + 1) * (rows + 1), squares = columns * rows;
    float(*positions)[3] = malloc(vertices * sizeof(*positions));
    uint32_t(*indices)[6] = malloc(squares * sizeof(*indices));
    assert_non_null(positions);
    assert_non_null(indices);
    for (uint32_t v = 0; v < vertices; v++) {
        float x = (float)(v % (columns + 1)) / (float)columns, y = (float)(v / (columns + 1)) / (float)rows;
        positions[v][0] = 4.0f * x - 2.0f;
        positions[v][1] = 4.0f * y - 2.0f;
        positions[v][2] = 0.2f * sinf(9.0f * x) * cosf(7.0f * y);
    }
    for (uint32_t i = 0; i < squares; i++) {
        uint32_t a = i / columns * (columns + 1) + i % columns, b = a + columns + 1;
        memcpy(indices[i], (uint32_t[6]){a, a + 1, b, a + 1, b + 1, b}, sizeof(indices[i]));
    }
    struct scene_mesh *mesh = &fixture_edit(fixture, OBJECT_MESH)->set.mesh;
    mesh->base.id = fixture->next_id++;
    mesh->value.vertex_count = vertices;
    mesh->value.triangle_count = 2 * squares;
    mesh->arrays[MESH_POSITIONS] = fixture_blob(positions, vertices * sizeof(*positions));
    mesh->arrays[MESH_INDICES] = fixture_blob(indices, squares * sizeof(*indices));
    mesh->ranges = calloc(1, sizeof(*mesh->ranges));
    assert_non_null(mesh->ranges);
    *mesh->ranges = (struct record_material_range){0, 2 * squares, material};
    mesh->range_count = 1;
    fixture_node(fixture, NODE_MESH, mesh->base.id, NULL);
    const float above[12] = {0.4f, 0, 0, 0.3f, 0, 0.4f, 0, 0.2f, 0, 0, 0.4f, 0.5f}; /* a second instance */
    fixture_node(fixture, NODE_MESH, mesh->base.id, above);
    free(positions);
    free(indices);
}

static uint32_t count_steps(struct fixture *fixture, struct frame_result *result)
{
    struct error error = {0};
    uint32_t steps = 0;
    /* The first frame reserves buffers, in steps whose number depends on the machine. */
    for (int i = 0; i < 2; i++) {
        enum frame_progress progress;
        frame_result_finish(result);
        if (!frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error))
            fail_msg("frame_begin: %s: %s", error.field, error.text);
        steps = 0;
        do {
            progress = frame_step(fixture->renderer, result, &error);
            steps++;
        } while (progress == FRAME_MORE);
        assert_int_equal(progress, FRAME_DONE);
    }
    return steps;
}

TEST(many_triangles_are_drawn_in_parts_and_none_is_left_out)
{
    struct fixture *fixture = *state;
    struct scene_material *ground = fixture_material(fixture), *ball = fixture_material(fixture);
    ball->value.base_colour[0] = 0.2f;
    a_field(fixture, ground->base.id, 400, 300);                     /* more than are drawn in one step */
    fixture_sphere(fixture, -0.8f, 0.4f, 0.4f, 0.4f, ball->base.id); /* drawn after all triangles */
    fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 3.0f);
    fixture_commit(fixture);
    fixture->request.picture.width = fixture->request.picture.height = 64;
    fixture->request.tracing.tracer = TRACER_BVH;
    struct frame_result drawn = {0}, traced = {0};
    uint32_t steps = count_steps(fixture, &drawn);
    fixture->request.tracing.primary = PRIMARY_TRACE;
    uint32_t steps_traced = count_steps(fixture, &traced);
    print_message("%u steps, traced %u\n", steps, steps_traced);
    /* Two instances: 480,000 triangles. */
    assert_true(steps >= steps_traced + (fixture->device->facts.software ? 8 : 1));
    uint32_t off = 0;
    for (uint32_t i = 0; i < 64 * 64; i++) {
        const float *a = fixture_pixel(&drawn, i % 64, i / 64), *b = fixture_pixel(&traced, i % 64, i / 64);
        off += fabsf(a[0] - b[0]) + fabsf(a[1] - b[1]) > 0.01f;
    }
    assert_true(off <= 64 * 64 / 500); /* pixels' middles within rounding of an edge */
    frame_result_finish(&drawn);
    frame_result_finish(&traced);
}

/* ---- structures ---- */

/* A field of many triangles, which one tree over takes long to build, and a ball. */
static void a_field_and_a_ball(struct fixture *fixture)
{
    struct scene_material *ground = fixture_material(fixture), *ball = fixture_material(fixture);
    ball->value.metallic = 1.0f;
    ball->value.roughness = 0.1f;
    a_field(fixture, ground->base.id, 200, 150);
    fixture_sphere(fixture, -0.8f, 0.4f, 0.4f, 0.4f, ball->base.id);
    fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 3.0f);
    fixture_commit(fixture);
    fixture->request.picture.width = fixture->request.picture.height = 64;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.tracer_options.ldc.resolution = fixture->request.tracer_options.abuffer.resolution = 128;
}

/* The scene is new to the device, and its structures are made in pieces of that length. */
static void anew_in_pieces(struct fixture *fixture, uint64_t step_ns)
{
    struct error error = {0};
    frame_renderer_destroy(fixture->renderer);
    frame_scene_destroy(fixture->shared);
    fixture->shared = frame_scene_create(fixture->device, &error);
    assert_non_null(fixture->shared);
    frame_scene_set_step(fixture->shared, step_ns);
    fixture->renderer = frame_renderer_create(fixture->shared, &error);
    assert_non_null(fixture->renderer);
}

/* Up to where its tracer has begun. */
static void begin(struct fixture *fixture, struct frame_renderer *renderer)
{
    struct error error = {0};
    struct frame_result none = {0};
    assert_true(frame_may_begin(renderer, fixture->scene, NULL, &fixture->request));
    if (!frame_begin(renderer, fixture->scene, NULL, &fixture->request, &error))
        fail_msg("frame_begin: %s: %s", error.field, error.text);
    while (renderer->phase == PHASE_UPDATE)
        assert_int_equal(frame_step(renderer, &none, &error), FRAME_MORE);
}

/* A step that does something. */
static enum frame_progress step(struct frame_renderer *renderer, struct frame_result *result, struct error *error)
{
    while (renderer->phase == PHASE_BUILD && frame_step_waits(renderer))
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    return frame_step(renderer, result, error);
}

/* Returns how many steps of the frame that has begun were spent on structures. */
static uint32_t finish(struct frame_renderer *renderer, struct frame_result *result)
{
    struct error error = {0};
    uint32_t pieces = 0;
    enum frame_progress progress = FRAME_MORE;
    while (progress == FRAME_MORE) {
        pieces += renderer->phase == PHASE_BUILD && !renderer->built; /* memory is reserved in steps, too */
        progress = step(renderer, result, &error);
    }
    if (progress != FRAME_DONE)
        fail_msg("frame_step: %s: %s", error.field, error.text);
    return pieces;
}

static void expect_same(const struct frame_result *got, const struct frame_result *expected)
{
    assert_true(got->size_bytes == expected->size_bytes);
    assert_memory_equal(got->pixels, expected->pixels, expected->size_bytes);
    assert_true(got->structure_bytes == expected->structure_bytes);
}

/* Which of them are cut, and in which ways a structure is built. */
static const struct way {
    const char *name;
    unsigned tracer, ldc_form;
    bool has_pieces;
} ways[] = {
    {"bvh", TRACER_BVH, TRACER_FORM_FAST, true},         {"reference", TRACER_REFERENCE, TRACER_FORM_FAST, false},
    {"ldc, lists", TRACER_LDC, TRACER_FORM_FAST, true},  {"ldc, peeled", TRACER_LDC, TRACER_FORM_PAPER, true},
    {"abuffer", TRACER_ABUFFER, TRACER_FORM_FAST, true},
};
enum { WAYS = sizeof(ways) / sizeof(ways[0]) };

static bool take_way(struct fixture *fixture, const struct way *way)
{
    fixture->request.tracing.tracer = way->tracer;
    fixture->request.tracer_options.ldc.form = way->ldc_form;
    return tracer_impl_by_number(way->tracer) != NULL;
}

TEST_LONG(structures_built_in_steps_are_the_same)
{
    struct fixture *fixture = *state;
    a_field_and_a_ball(fixture);
    for (const struct way *way = ways; way < ways + WAYS; way++) {
        struct frame_result whole = {0}, pieces = {0};
        if (!take_way(fixture, way))
            continue;
        anew_in_pieces(fixture, STEP_WITHOUT_END);
        begin(fixture, fixture->renderer);
        finish(fixture->renderer, &whole);
        anew_in_pieces(fixture, 0);
        begin(fixture, fixture->renderer);
        uint32_t count = finish(fixture->renderer, &pieces);
        print_message("%s: %u pieces\n", way->name, count);
        assert_true(count > 2 || !way->has_pieces);
        expect_same(&pieces, &whole);
        assert_true(stage_times_sum_ns(&pieces.times, STAGE_BUILD, CLOCK_CPU) > 0);
        frame_result_finish(&whole);
        frame_result_finish(&pieces);
    }
}

/* After any number of pieces: nothing is left of it, and what comes after it is right. */
TEST_LONG(a_structure_without_waiting_frames_is_forgotten)
{
    struct fixture *fixture = *state;
    a_field_and_a_ball(fixture);
    for (const struct way *way = ways; way < ways + WAYS; way++) {
        struct frame_result expected = {0}, result = {0};
        struct error error = {0};
        if (!way->has_pieces || !take_way(fixture, way))
            continue;
        anew_in_pieces(fixture, 0);
        begin(fixture, fixture->renderer);
        uint32_t count = finish(fixture->renderer, &expected);
        for (uint32_t done = 0; done < count; done += 1 + count / 8) {
            anew_in_pieces(fixture, 0);
            begin(fixture, fixture->renderer);
            /* Others' work on the machine makes it more pieces, or fewer. */
            for (uint32_t i = 0; i < done && fixture->renderer->phase == PHASE_BUILD; i++)
                assert_int_equal(step(fixture->renderer, &result, &error), FRAME_MORE);
            /* With the structure built, the frame may still wait for memory. */
            const bool was_building = fixture->renderer->phase == PHASE_BUILD && !fixture->renderer->built;
            assert_true(was_building || done > 0);
            frame_abandon(fixture->renderer);
            /* Working memory of a builder may stay for the next one, but no structure. */
            const struct tracer *tracer_left = fixture->shared->tracers.slots[0].tracer;
            assert_false(tracer_left->updating || (was_building && tracer_left->updated));
            begin(fixture, fixture->renderer);
            finish(fixture->renderer, &result);
            expect_same(&result, &expected);
            frame_result_finish(&result);
        }
        frame_result_finish(&expected);
    }
}

/* The second one begins while the first one's structure is being built, and does pieces of it; the first one may
 * go. */
TEST(frames_that_wait_for_one_structure_build_it_together)
{
    struct fixture *fixture = *state;
    a_field_and_a_ball(fixture);
    for (const struct way *way = ways; way < ways + (getenv("FARLIGHT_TEST_LONG") ? WAYS : 1); way++) {
        struct frame_result expected = {0}, results[2] = {{0}};
        struct error error = {0};
        if (!way->has_pieces || !take_way(fixture, way))
            continue;
        anew_in_pieces(fixture, STEP_WITHOUT_END);
        begin(fixture, fixture->renderer);
        finish(fixture->renderer, &expected);
        for (int first_goes = 0; first_goes < 2; first_goes++) {
            anew_in_pieces(fixture, 0);
            struct frame_renderer *second = frame_renderer_create(fixture->shared, &error);
            assert_non_null(second);
            begin(fixture, fixture->renderer);
            assert_int_equal(fixture->renderer->phase, PHASE_BUILD);
            begin(fixture, second);
            for (int i = 0; i < 2; i++)
                assert_int_equal(step(i ? second : fixture->renderer, &results[i], &error), FRAME_MORE);
            if (first_goes)
                frame_abandon(fixture->renderer);
            finish(second, &results[1]);
            expect_same(&results[1], &expected);
            frame_result_finish(&results[1]);
            if (first_goes) {
                frame_renderer_destroy(second);
                continue;
            }
            assert_true(finish(fixture->renderer, &results[0]) <= 1);
            expect_same(&results[0], &expected);
            frame_result_finish(&results[0]);
            frame_renderer_destroy(second);
        }
        frame_result_finish(&expected);
    }
}
