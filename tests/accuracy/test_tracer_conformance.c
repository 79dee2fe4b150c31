/* SPDX-License-Identifier: MIT */
/* One suite for every tracer: ray by ray, its answers are those of a plain C tracer in double precision.
 *
 * To add a tracer (or another form of one), add a row to `tracers`. To add a scene, add a row to `scenes`. */
#include "motion_scenes.h"
#include "naive_twin.h"
#include "test_scenes.h"

#include "gpu/device.h"
#include "shared/hit.h"
#include "shared/material.h"
#include "gpu_scene/scene.h"
#include "trace/program.h"
#include "trace/tracer.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define RAY_COUNT 2000u
/* Rays whose answer hangs on a rounding are left out; more of them than this and the test would say nothing. */
#define CLOSE_CALLS_MAX (RAY_COUNT / 10)

struct tracer_row {
    const char *name;
    unsigned number; /* the protocol's */
    struct tracer_options options;
};
static const struct tracer_row tracers[] = {
    {"naive", 1, {0}},
    {"bvh", 0, {0}},
    {"bvh, one ray alone", 0, {.bvh_rays_together = 1}},
    {"bvh, eight rays together", 0, {.bvh_rays_together = 8}},
    {"bvh in the plain form", 0, {.bvh_layout = BVH_LAYOUT_PLAIN}},
    {"bvh, two rays together", 0, {.bvh_rays_together = 2}},
    {"bvh with spheres, four rays together", 0, {.bvh_bounds = BVH_BOUNDS_SPHERE, .bvh_rays_together = 4}},
    {"reference", 2, {0}}, /* as many rays a call as the processor takes at once */
    {"reference, one ray a call", 2, {.reference_rays_a_call = 1}},
    {"reference, four rays a call", 2, {.reference_rays_a_call = 4}},
    {"reference, eight rays a call", 2, {.reference_rays_a_call = 8}},
};

struct scene_row {
    const char *name;
    struct scene *(*create)(void);
    /* Where things are while the shutter is open; 1 pose: it is closed. NULL: as they were committed. */
    void (*move)(struct scene_motion *motion, uint32_t pose_count);
    uint32_t pose_count;
};
static const struct scene_row scenes[] = {
    {.name = "a triangle soup in mirrored, squeezed and nested instances", .create = test_scene_soup},
    {.name = "spheres among triangles", .create = test_scene_spheres},
    {.name = "cutouts, glass, panes and a disc", .create = test_scene_translucent},
    {"a posed soup", test_scene_soup, test_motion_of_soup, 1},
    {"a soup that moves from one pose to another", test_scene_soup, test_motion_of_soup, 2},
    {"a soup that moves through nine poses", test_scene_soup, test_motion_of_soup, 9},
    {"spheres of which some move", test_scene_spheres, test_motion_of_two, 3},
    {"cutouts and glass that move", test_scene_translucent, test_motion_of_two, 4},
    {.name = "skins and morph targets as they were committed", .create = test_scene_deformed},
    {"posed skins and morph targets", test_scene_deformed, test_motion_of_deformed, 1},
    {"skins and morph targets that move", test_scene_deformed, test_motion_of_deformed, 3},
};

static struct gpu_device *device;

/* A scene on the device with one tracer on it, and its twin. */
struct fixture {
    struct scene *scene;
    struct scene_motion motion;
    struct gpu_scene gpu;
    struct tracer *tracer;
    struct twin twin;
    struct gpu_buffer rays, times, answers;
    struct ray *host_rays;
    float host_times[RAY_COUNT]; /* 0 where nothing moves */
    bool leaves_times_out;
    struct material *materials; /* of the device, read back */
};

static void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

/* Mostly at the scene from around it and from within, of any length of direction; some dead, some short. */
static void make_rays(struct fixture *fixture, uint64_t seed)
{
    const float *low = fixture->gpu.lower_world, *high = fixture->gpu.upper_world;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        struct ray *ray = &fixture->host_rays[i];
        float length = test_uniform(&seed, 0.2f, 3.0f), squared = 0.0f;
        for (int k = 0; k < 3; k++) {
            float margin = i % 3 ? 1.0f : 0.0f;
            ray->origin_t_min[k] = test_uniform(&seed, low[k] - margin, high[k] + margin);
            ray->direction_t_max[k] = test_uniform(&seed, low[k], high[k]) - ray->origin_t_min[k];
            squared += ray->direction_t_max[k] * ray->direction_t_max[k];
        }
        for (int k = 0; k < 3; k++)
            ray->direction_t_max[k] *= length / sqrtf(squared);
        ray->origin_t_min[3] = 1e-3f;
        ray->direction_t_max[3] = i % 5 ? 1e6f : test_uniform(&seed, 0.5f, 3.0f);
        if (i % 17 == 0)
            ray->direction_t_max[3] = i % 2 ? 0.0f : -1.0f;
    }
    for (uint32_t i = 0; fixture->motion.pose_count > 1 && i < RAY_COUNT; i++)
        fixture->host_times[i] = i % 11 == 0 ? (float)(i % 2) : test_uniform(&seed, 0, 1);
    struct error error = {0};
    expect_ok(gpu_buffer_upload(device, &fixture->times, fixture->host_times, sizeof(fixture->host_times), &error),
              &error);
    expect_ok(
        gpu_buffer_upload(device, &fixture->rays, fixture->host_rays, RAY_COUNT * sizeof(struct ray), &error),
        &error);
}

static const struct scene_motion *motion_of(const struct fixture *fixture)
{
    return fixture->motion.pose_count ? &fixture->motion : NULL;
}

static void update(struct fixture *fixture)
{
    struct error error = {0};
    struct scene_changes changes;
    expect_ok(gpu_scene_update(&fixture->gpu, fixture->scene, motion_of(fixture), &changes, NULL, &error), &error);
    expect_ok(tracer_update(fixture->tracer, &fixture->gpu, &changes, NULL, &error), &error);
    fixture->materials = realloc(fixture->materials, fixture->gpu.materials.size_bytes);
    gpu_buffer_read(device, &fixture->gpu.materials, 0, fixture->materials, fixture->gpu.materials.size_bytes);
}

static void fixture_init(struct fixture *fixture, const struct tracer_row *tracer, const struct scene_row *scene)
{
    struct error error = {0};
    const struct tracer_impl *impl = tracer_impl_by_number(tracer->number);
    *fixture = (struct fixture){.scene = scene->create(), .host_rays = malloc(RAY_COUNT * sizeof(struct ray))};
    assert_non_null(impl);
    if (scene->move)
        scene->move(&fixture->motion, scene->pose_count);
    gpu_scene_init(&fixture->gpu, device);
    fixture->tracer = tracer_create(impl, device, &tracer->options, &error);
    expect_ok(fixture->tracer != NULL, &error);
    update(fixture);
    twin_init_moving(&fixture->twin, fixture->scene, motion_of(fixture));
    make_rays(fixture, 42);
}

static void fixture_finish(struct fixture *fixture)
{
    twin_finish(&fixture->twin);
    scene_motion_finish(&fixture->motion);
    gpu_buffer_finish(device, &fixture->rays);
    gpu_buffer_finish(device, &fixture->times);
    gpu_buffer_finish(device, &fixture->answers);
    tracer_destroy(fixture->tracer);
    gpu_scene_finish(&fixture->gpu);
    scene_destroy(fixture->scene);
    free(fixture->host_rays);
    free(fixture->materials);
}

/* What no answer looks like: shows that an answer was written, and that none was where none is due. */
#define UNTOUCHED 0xdeadbeefu

static void *trace(struct fixture *fixture, enum wave_kind kind, uint32_t ray_count)
{
    struct error error = {0};
    size_t size_bytes = RAY_COUNT * (kind == WAVE_ANY ? sizeof(uint32_t) : sizeof(struct hit));
    expect_ok(gpu_buffer_reserve(device, &fixture->answers, size_bytes, &error), &error);
    gpu_buffer_clear(device, &fixture->answers, UNTOUCHED);
    const struct wave wave = {
        .kind = kind,
        .ray_count = ray_count,
        .rays = &fixture->rays,
        .hits = &fixture->answers,
        .visibility = &fixture->answers,
        .times = fixture->motion.pose_count > 1 && !fixture->leaves_times_out ? &fixture->times : NULL};
    gpu_scene_bind(&fixture->gpu);
    expect_ok(tracer_trace(fixture->tracer, &fixture->gpu, &wave, &error), &error);
    void *answers = malloc(size_bytes);
    gpu_buffer_read(device, &fixture->answers, 0, answers, size_bytes);
    return answers;
}

static void unpack_unit(double out[3], uint32_t bits)
{
    double x = fmax((int16_t)(bits & 0xffff) / 32767.0, -1), y = fmax((int16_t)(bits >> 16) / 32767.0, -1);
    out[0] = x;
    out[1] = y;
    out[2] = 1 - fabs(x) - fabs(y);
    if (out[2] < 0) {
        out[0] = (1 - fabs(y)) * (x >= 0 ? 1 : -1);
        out[1] = (1 - fabs(x)) * (y >= 0 ? 1 : -1);
    }
    twin_normalize(out);
}

static void expect_near(uint32_t ray, const char *what, double got, double expected, double tolerance)
{
    if (!(fabs(got - expected) <= tolerance))
        fail_msg("ray %u: %s is %.9g, expected %.9g (tolerance %g)", ray, what, got, expected, tolerance);
}

static void expect_unit(uint32_t ray, const char *what, uint32_t got, const double expected[3])
{
    double unit[3];
    unpack_unit(unit, got);
    double cosine = twin_dot(unit, expected);
    if (!(cosine > 1 - 2e-6)) /* 0.1 degrees */
        fail_msg("ray %u: %s is %.6f %.6f %.6f, expected %.6f %.6f %.6f", ray, what, unit[0], unit[1], unit[2],
                 expected[0], expected[1], expected[2]);
}

static void expect_hit(const struct fixture *fixture, uint32_t ray, const struct hit *got,
                       const struct twin_hit *expected)
{
    if ((got->distance < 0) != (expected->distance < 0))
        fail_msg("ray %u: distance is %.9g, expected %.9g", ray, (double)got->distance, expected->distance);
    if (expected->distance < 0) {
        expect_near(ray, "distance of a miss", got->distance, -1, 0);
        return;
    }
    expect_near(ray, "distance", got->distance, expected->distance, 1e-4 * (1 + expected->distance));
    expect_unit(ray, "geometric normal", got->normal_geometric, expected->normal_geometric);
    expect_unit(ray, "shading normal", got->normal_shading, expected->normal_shading);
    expect_near(ray, "back face", (got->material & HIT_BACK_FACE) != 0, expected->back_face, 0);
    if (expected->node) { /* a disc's texture coordinates are its own affair */
        expect_near(ray, "node", fixture->gpu.instances[got->instance].node, expected->node, 0);
        double seam = fabs(got->u0 - expected->uv[0]) > 0.5 ? 1 : 0; /* a sphere's u jumps from 1 to 0 */
        expect_near(ray, "u", got->u0 + (got->u0 < expected->uv[0] ? seam : -seam), expected->uv[0], 5e-3);
        expect_near(ray, "v", got->v0, expected->uv[1], 5e-3);
    } else {
        expect_near(ray, "instance of a disc", got->instance, HIT_NO_PRIMITIVE, 0);
    }
    for (int k = 0; k < 4; k++)
        expect_near(ray, "colour", (got->colour >> (8 * k) & 255) / 255.0, expected->colour[k], 5e-3);
    static const float white[4] = {1, 1, 1, 1};
    const struct scene_material *material = scene_material(fixture->scene, expected->material);
    const float *base_colour = material ? material->base_colour : white;
    uint32_t index = got->material & HIT_MATERIAL_MASK;
    assert_in_range(index, 0, fixture->gpu.material_count - 1);
    for (int k = 0; k < 4; k++)
        expect_near(ray, "base colour of the material", fixture->materials[index].base_colour[k], base_colour[k],
                    0);
}

static void compare_closest(struct fixture *fixture)
{
    struct hit *hits = trace(fixture, WAVE_CLOSEST, RAY_COUNT);
    uint32_t close_calls = 0, hit_count = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        struct twin_walk walk;
        twin_trace_at(&walk, &fixture->twin, &fixture->host_rays[i], fixture->host_times[i]);
        close_calls += walk.close_call;
        hit_count += walk.closest.distance >= 0;
        if (!walk.close_call)
            expect_hit(fixture, i, &hits[i], &walk.closest);
    }
    free(hits);
    assert_in_range(close_calls, 0, CLOSE_CALLS_MAX);
    assert_in_range(hit_count, RAY_COUNT / 10, RAY_COUNT); /* else the rays test nothing */
}

static void compare_any(struct fixture *fixture)
{
    uint32_t *visibilities = trace(fixture, WAVE_ANY, RAY_COUNT);
    uint32_t close_calls = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        struct twin_walk walk;
        twin_trace_at(&walk, &fixture->twin, &fixture->host_rays[i], fixture->host_times[i]);
        close_calls += walk.close_call;
        for (int k = 0; k < 3 && !walk.close_call; k++)
            expect_near(i, "transmittance", (visibilities[i] >> (8 * k) & 255) / 255.0, walk.transmittance[k],
                        6e-3);
    }
    free(visibilities);
    assert_in_range(close_calls, 0, CLOSE_CALLS_MAX);
}

struct case_state {
    const struct tracer_row *tracer;
    const struct scene_row *scene;
};

static void closest_hits_are_those_of_the_plain_tracer(void **state)
{
    const struct case_state *row = *state;
    struct fixture fixture;
    fixture_init(&fixture, row->tracer, row->scene);
    compare_closest(&fixture);
    fixture_finish(&fixture);
}

static void any_hits_are_those_of_the_plain_tracer(void **state)
{
    const struct case_state *row = *state;
    struct fixture fixture;
    fixture_init(&fixture, row->tracer, row->scene);
    compare_any(&fixture);
    fixture_finish(&fixture);
}

/* Moves a node, makes another disappear, gives a material another alpha. */
static void answers_follow_the_edits(void **state)
{
    const struct case_state *row = *state;
    struct fixture fixture;
    fixture_init(&fixture, row->tracer, row->scene);
    struct test_edits edits = {.scene = fixture.scene};
    const struct scene_node *second = scene_node(fixture.scene, 2);
    float m[12];
    test_transform(m, 0.8f, -0.9f, 1.1f, 0, 0.3f, 0.4f, 0.1f, -0.7f);
    test_node(&edits, 2, second->parent, second->kind, second->object, m);
    const struct scene_node *third = scene_node(fixture.scene, 3);
    test_node(&edits, 3, third->parent, third->kind, third->object, third->parent_from_node)->hidden = true;
    struct scene_material *material = test_material(&edits, 2, 0.35f, 0.45f, 0.55f);
    material->alpha_mode = ALPHA_BLEND;
    material->base_colour[3] = 0.5f;
    test_commit(&edits);
    update(&fixture);
    twin_finish(&fixture.twin);
    twin_init_moving(&fixture.twin, fixture.scene, motion_of(&fixture));
    compare_closest(&fixture);
    compare_any(&fixture);
    fixture_finish(&fixture);
}

static void answers_follow_a_changed_shape(void **state)
{
    const struct case_state *row = *state;
    struct fixture fixture;
    fixture_init(&fixture, row->tracer, row->scene);
    struct test_edits edits = {.scene = fixture.scene};
    test_soup_mesh(&edits, 10, 70, 0.4f, 99);
    test_soup_mesh(&edits, 5, 10, 0.5f, 98); /* sorts before, so that all primitives get other numbers */
    test_node(&edits, 100, 0, NODE_MESH, 5, NULL);
    test_commit(&edits);
    update(&fixture);
    twin_finish(&fixture.twin);
    twin_init_moving(&fixture.twin, fixture.scene, motion_of(&fixture));
    compare_closest(&fixture);
    compare_any(&fixture);
    fixture_finish(&fixture);
}

/* The naive tracer cuts waves: a driver may end a dispatch that takes too long. */
static void a_wave_in_parts_has_the_answers_of_the_whole(void **state)
{
    (void)state;
    struct error error = {0};
    struct fixture fixture;
    fixture_init(&fixture, &tracers[0], &scenes[1]);
    const struct trace_program_source parts = {.traverse = "naive/traverse.glsl", .rays_a_dispatch = 192};
    const struct wave wave = {.ray_count = 777, .end_ray = 777, .rays = &fixture.rays, .hits = &fixture.answers};
    struct hit *whole = trace(&fixture, WAVE_CLOSEST, wave.ray_count);
    struct hit *hits = malloc(RAY_COUNT * sizeof(struct hit));
    const struct gpu_program *program = trace_program_get(&fixture.gpu, &wave, &parts, &error);
    expect_ok(program != NULL, &error);
    gpu_buffer_clear(device, &fixture.answers, UNTOUCHED);
    expect_ok(trace_program_run(program, &fixture.gpu, &wave, &parts, &error), &error);
    gpu_buffer_read(device, &fixture.answers, 0, hits, RAY_COUNT * sizeof(struct hit));
    assert_memory_equal(hits, whole, RAY_COUNT * sizeof(struct hit));
    free(hits);
    free(whole);
    fixture_finish(&fixture);
}

static void rays_beyond_the_wave_get_no_answer(void **state)
{
    const struct case_state *row = *state;
    struct fixture fixture;
    fixture_init(&fixture, row->tracer, row->scene);
    const uint32_t count = 777; /* no multiple of anything */
    struct hit *hits = trace(&fixture, WAVE_CLOSEST, count);
    uint32_t *visibilities = trace(&fixture, WAVE_ANY, count);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        if (i < count) {
            assert_int_not_equal(hits[i].primitive, UNTOUCHED);
            assert_int_not_equal(visibilities[i], UNTOUCHED);
        } else {
            assert_int_equal(hits[i].primitive, UNTOUCHED);
            assert_int_equal(visibilities[i], UNTOUCHED);
        }
    }
    free(hits);
    free(visibilities);
    fixture_finish(&fixture);
}

static struct scene *empty_scene(void)
{
    return test_scene_create();
}

static void a_scene_with_nothing_in_it_is_missed(void **state)
{
    const struct case_state *row = *state;
    static const struct scene_row empty = {.name = "nothing", .create = empty_scene};
    struct fixture fixture;
    fixture_init(&fixture, row->tracer, &empty);
    struct hit *hits = trace(&fixture, WAVE_CLOSEST, RAY_COUNT);
    uint32_t *visibilities = trace(&fixture, WAVE_ANY, RAY_COUNT);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        assert_float_equal(hits[i].distance, -1.0f, 0.0f);
        assert_int_equal(visibilities[i], 0xffffffff);
    }
    free(hits);
    free(visibilities);
    fixture_finish(&fixture);
}

static void a_wave_that_does_not_fit_its_buffers_is_refused(void **state)
{
    const struct case_state *row = *state;
    struct fixture fixture;
    struct error error = {0};
    fixture_init(&fixture, row->tracer, row->scene);
    struct wave wave = {.ray_count = RAY_COUNT + 1, .rays = &fixture.rays, .hits = &fixture.answers};
    assert_false(tracer_trace(fixture.tracer, &fixture.gpu, &wave, &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    wave.ray_count = 0;
    assert_false(tracer_trace(fixture.tracer, &fixture.gpu, &wave, NULL));
    fixture_finish(&fixture);
}

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* Rays without times are all at the first pose, also where things move while the shutter is open. */
static void a_wave_without_times_sees_the_first_pose(void **state)
{
    const struct case_state *row = *state;
    static const struct scene_row moving[] = {
        {.name = "soup", .create = test_scene_soup, .move = test_motion_of_soup, .pose_count = 4},
        {.name = "skins", .create = test_scene_deformed, .move = test_motion_of_deformed, .pose_count = 4}};
    for (size_t i = 0; i < sizeof(moving) / sizeof(moving[0]); i++) {
        struct fixture fixture;
        fixture_init(&fixture, row->tracer, &moving[i]);
        assert_true(fixture.gpu.has_motion);
        fixture.leaves_times_out = true;
        memset(fixture.host_times, 0, sizeof(fixture.host_times));
        compare_closest(&fixture);
        compare_any(&fixture);
        fixture_finish(&fixture);
    }
}

struct check {
    const char *name;
    CMUnitTestFunction run;
    bool once; /* on the first scene alone */
};
static const struct check checks[] = {
    {"closest hits are those of the plain tracer", closest_hits_are_those_of_the_plain_tracer, false},
    {"any hits are those of the plain tracer", any_hits_are_those_of_the_plain_tracer, false},
    {"answers follow the edits", answers_follow_the_edits, false},
    {"answers follow a changed shape", answers_follow_a_changed_shape, false},
    {"rays beyond the wave get no answer", rays_beyond_the_wave_get_no_answer, true},
    {"a scene with nothing in it is missed", a_scene_with_nothing_in_it_is_missed, true},
    {"a wave without times sees the first pose", a_wave_without_times_sees_the_first_pose, true},
    {"a wave that does not fit its buffers is refused", a_wave_that_does_not_fit_its_buffers_is_refused, true},
};

int main(void)
{
    static struct case_state states[COUNT(tracers) * COUNT(scenes) * COUNT(checks)];
    static char names[COUNT(tracers) * COUNT(scenes) * COUNT(checks)][160];
    static struct CMUnitTest tests[COUNT(tracers) * COUNT(scenes) * COUNT(checks)];
    const struct gpu_options options = {.index = -1};
    struct error error = {0};
    size_t n = 0;
    for (size_t t = 0; t < COUNT(tracers); t++) {
        if (!tracer_find(tracers[t].number, tracers[t].name, &error)) {
            printf("SKIP: %s: %s\n", tracers[t].name, error.text);
            error = (struct error){0};
            continue;
        }
        for (size_t s = 0; s < COUNT(scenes); s++) {
            for (size_t c = 0; c < COUNT(checks); c++) {
                if (checks[c].once && s > 0)
                    continue;
                states[n] = (struct case_state){&tracers[t], &scenes[s]};
                snprintf(names[n], sizeof(names[n]), "%s: %s: %s", tracers[t].name, checks[c].name,
                         checks[c].once ? "any scene" : scenes[s].name);
                tests[n] =
                    (struct CMUnitTest){.name = names[n], .test_func = checks[c].run, .initial_state = &states[n]};
                n++;
            }
        }
    }
    /* One row is free: those checks that are made once have left some. */
    tests[n++] = (struct CMUnitTest){.name = "a wave in parts has the answers of the whole",
                                     .test_func = a_wave_in_parts_has_the_answers_of_the_whole};
    device = gpu_device_create(&options, &error);
    if (!device) {
        printf("SKIP: no OpenGL device: %s\n", error.text);
        return 0;
    }
    int failures = _cmocka_run_group_tests("tracer conformance", tests, n, NULL, NULL);
    gpu_device_destroy(device);
    return failures;
}
