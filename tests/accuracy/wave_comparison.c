/* SPDX-License-Identifier: MIT */
/* Frames whose waves are traced by two tracers: exact ones agree on every ray, and a tracer that is made wrong is
 * caught in the wave and in the class where it is wrong, whatever shading makes of it. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"

#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/program.h"
#include "trace/tracer.h"
#include "tests/harness/test.h"

#include <time.h>

/* ---- a tracer that is wrong ---------------------------------------------------------------------- */

enum wrong_way {
    WRONG_NOT,
    WRONG_MISSES,    /* every third hit of closest-hit waves is lost */
    WRONG_HITS,      /* and every third miss is a hit */
    WRONG_FAR,       /* a quarter of the diagonal behind */
    WRONG_IMPRECISE, /* a share of 1/65536 behind */
    WRONG_TURNED,    /* the normal points along z */
    WRONG_LIT,       /* no shadows */
    WRONG_FAINT,     /* shadows of half of the light */
    WRONG_SLOW
};
static struct {
    enum wrong_way way;
    enum ray_kind kind; /* the only one that is wrong; the others are brute force's */
    uint64_t waves;     /* traced so far */
} wrong;
#define SLOW_NS 2000000

static enum ray_kind kind_of(const struct wave *wave)
{
    return wave->kind == WAVE_ANY ? RAY_SHADOW : wave->shared_origin ? RAY_PRIMARY : RAY_SECONDARY;
}

static void spoil_hit(struct hit *hit, uint32_t index, float diagonal)
{
    bool is_hit = hit->distance >= 0.0f;
    if (wrong.way == WRONG_MISSES && is_hit && index % 3 == 0)
        hit->distance = -1.0f;
    else if (wrong.way == WRONG_HITS && !is_hit && index % 3 == 0)
        hit->distance = 1.0f;
    else if (wrong.way == WRONG_FAR && is_hit)
        hit->distance += diagonal / 4.0f;
    else if (wrong.way == WRONG_IMPRECISE && is_hit)
        hit->distance *= 1.0f + 1.0f / 65536.0f;
    else if (wrong.way == WRONG_TURNED && is_hit)
        hit->normal_shading = 0;
}

static void spoil(struct gpu_scene *scene, const struct wave *wave)
{
    size_t bytes = wave->ray_count * (wave->kind == WAVE_ANY ? sizeof(uint) : sizeof(struct hit));
    struct gpu_buffer *buffer = wave->kind == WAVE_ANY ? wave->visibility : wave->hits;
    void *answers = malloc(bytes);
    assert_non_null(answers);
    gpu_buffer_read(device, buffer, 0, answers, bytes);
    for (uint32_t i = 0; i < wave->ray_count; i++) {
        if (wave->kind != WAVE_ANY)
            spoil_hit((struct hit *)answers + i, i, scene->diagonal);
        else if (wrong.way == WRONG_LIT)
            ((uint *)answers)[i] = 0xffffffffu;
        else if (wrong.way == WRONG_FAINT && ((uint *)answers)[i] == 0)
            ((uint *)answers)[i] = 0xff808080u;
    }
    gpu_buffer_write(device, buffer, 0, answers, bytes);
    free(answers);
}

static bool is_wrong_about(const struct wave *wave)
{
    return wrong.way != WRONG_NOT && wrong.way != WRONG_SLOW && kind_of(wave) == wrong.kind;
}

/* Waves that are compared are traced at once: the range is all of it. */
static bool wrong_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                        const struct ray_range *rays, struct error *error)
{
    wrong.waves++;
    if (wrong.way == WRONG_SLOW)
        nanosleep(&(struct timespec){.tv_nsec = SLOW_NS}, NULL);
    if (!tracer_naive_impl.trace_range(tracer, scene, state, rays, error))
        return false;
    if (state->wave.kind == WAVE_ANY && is_wrong_about(&state->wave))
        spoil(scene, &state->wave);
    return true;
}

static bool wrong_surfaces(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                           struct error *error)
{
    (void)tracer;
    if (!trace_surfaces(scene, rays, error))
        return false;
    if (is_wrong_about(rays->wave))
        spoil(scene, rays->wave);
    return true;
}

/* ---- scenes and sums ------------------------------------------------------------------------------ */

/* The mixture over a floor that mirrors, before a wall; lights without size. */
static void build_scene(struct fixture *fixture)
{
    fixture_mixture(fixture);
    for (size_t i = 0; i < fixture->edit_count; i++)
        if (fixture->edits[i].object == OBJECT_LIGHT)
            fixture->edits[i].set.light.value.kind = LIGHT_POINT;
    const float wall_transform[12] = {0.8f, 0, 0.6f, 0, 0, 1, 0, 0, -0.6f, 0, 0.8f, -1.5f};
    const float mirror_transform[12] = {1, 0, 0, 0, 0, 0, 1, -0.59f, 0, -1, 0, 0};
    fixture_square(fixture, 1.1f, fixture_material(fixture)->base.id, wall_transform);
    struct scene_material *mirror = fixture_material(fixture);
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.0f;
    fixture_square(fixture, 3.0f, mirror->base.id, mirror_transform);
    fixture->request.picture.width = 84; /* not a multiple of the tiles' 8: some slots are dead */
    fixture->request.picture.height = 60;
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.comparison.compare = true;
    fixture->request.comparison.compare_with = TRACER_NAIVE;
}

/* The wrong tracer under examination, in place of bvh. */
static void examine_wrong(struct fixture *fixture, enum wrong_way way, enum ray_kind kind)
{
    static struct tracer_impl impl;
    impl = tracer_naive_impl;
    impl.name = "wrong";
    impl.trace_range = wrong_range;
    impl.surfaces = wrong_surfaces;
    wrong.way = way;
    wrong.kind = kind;
    wrong.waves = 0;
    frame_renderer_stand_in(fixture->renderer, TRACER_BVH, &impl);
}

static uint64_t disagreeing(const struct record_wave_comparison *figures)
{
    return figures->only_tracer + figures->only_reference + figures->far + figures->other_surface;
}

static const struct record_wave_comparison *find(const struct frame_result *result, uint32_t wave,
                                                 enum ray_kind kind)
{
    for (uint32_t i = 0; i < result->comparison_count; i++)
        if (result->comparisons[i].wave == wave && result->comparisons[i].kind == kind)
            return &result->comparisons[i];
    fail_msg("no figures of wave %u, kind %d", wave, (int)kind);
    return NULL;
}

static uint64_t rays_of(const struct frame_result *result, enum ray_kind kind)
{
    uint64_t rays = 0;
    for (uint32_t i = 0; i < result->comparison_count; i++)
        if (result->comparisons[i].kind == kind)
            rays += result->comparisons[i].rays;
    return rays;
}

/* Every ray of the frame is there, once, and the classes add up. */
static void assert_complete(const struct frame_result *result)
{
    assert_true(result->comparison_count > 0);
    for (uint32_t i = 0; i < result->comparison_count; i++) {
        const struct record_wave_comparison *figures = &result->comparisons[i];
        assert_int_equal(figures->rays, figures->both_hit + figures->both_missed + figures->only_tracer +
                                            figures->only_reference);
        assert_true(figures->tracer_ns > 0 && figures->reference_ns > 0);
        if (i > 0)
            assert_true(figures[-1].wave < figures->wave ||
                        (figures[-1].wave == figures->wave && figures[-1].kind < figures->kind));
    }
    assert_int_equal(rays_of(result, RAY_PRIMARY), result->primary_rays);
    assert_int_equal(rays_of(result, RAY_SECONDARY), result->secondary_rays);
    assert_int_equal(rays_of(result, RAY_SHADOW), result->shadow_rays);
}

/* Only one kind of ray is found to be wrong; those of the wave `kind` is in are returned. */
static const struct record_wave_comparison *assert_only_wrong(const struct frame_result *result, uint32_t wave,
                                                              enum ray_kind kind)
{
    assert_complete(result);
    for (uint32_t i = 0; i < result->comparison_count; i++)
        if (result->comparisons[i].kind != kind && disagreeing(&result->comparisons[i]) > 0)
            fail_msg("wave %u, kind %d is right and was said to be wrong", result->comparisons[i].wave,
                     (int)result->comparisons[i].kind);
    return find(result, wave, kind);
}

/* ---- tests ---------------------------------------------------------------------------------------- */

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(bvh_and_brute_force_agree_on_every_ray_of_every_wave)
{
    struct fixture *fixture = *state;
    build_scene(fixture);
    fixture->request.sampling.samples = 2;
    struct frame_result result = fixture_render(fixture);
    assert_complete(&result);
    assert_true(find(&result, 3, RAY_SECONDARY)->rays > 0);
    assert_true(find(&result, 1, RAY_SHADOW)->both_hit > 0);
    for (uint32_t i = 0; i < result.comparison_count; i++) {
        const struct record_wave_comparison *figures = &result.comparisons[i];
        /* Both run the same intersection code on the same numbers: not a ray may differ, on edges neither. */
        assert_int_equal(disagreeing(figures), 0);
        assert_true(figures->distance_max == 0.0f && figures->normal_max == 0.0f);
    }
    frame_result_finish(&result);
}

TEST(comparing_changes_no_byte_of_the_picture)
{
    struct fixture *fixture = *state;
    build_scene(fixture);
    struct frame_result compared = fixture_render(fixture);
    fixture->request.comparison.compare = false;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    struct frame_result plain = fixture_render(fixture);
    assert_memory_equal(compared.pixels, plain.pixels, plain.size_bytes);
    assert_int_equal(plain.comparison_count, 0);
    assert_null(plain.comparisons);
    assert_int_equal(stage_times_sum_ns(&plain.times, STAGE_COMPARE, CLOCK_CPU), 0);
    assert_true(stage_times_sum_ns(&compared.times, STAGE_COMPARE, CLOCK_CPU) > 0);
    frame_result_finish(&compared);
    frame_result_finish(&plain);
}

TEST(slices_that_overflow_are_counted_once)
{
    struct fixture *fixture = *state;
    build_scene(fixture);
    examine_wrong(fixture, WRONG_IMPRECISE, RAY_SECONDARY);
    struct frame_result whole = fixture_render(fixture);
    frame_renderer_set_capacity(fixture->renderer, 64, 64);
    struct frame_result split = fixture_render(fixture);
    assert_int_equal(whole.splits, 0);
    assert_true(split.splits > 0);
    assert_complete(&split);
    assert_int_equal(whole.comparison_count, split.comparison_count);
    for (uint32_t i = 0; i < whole.comparison_count; i++) {
        struct record_wave_comparison *a = &whole.comparisons[i], *b = &split.comparisons[i];
        assert_int_equal(a->rays, b->rays);
        assert_int_equal(a->both_hit, b->both_hit);
        /* Order and partition change nothing, not even in the last bit. */
        assert_memory_equal(&a->distance_median, &b->distance_median, 7 * sizeof(float));
    }
    frame_result_finish(&whole);
    frame_result_finish(&split);
}

/* Wrong tracers, and the wave and class where each is found. Least and most shares: of the reference's misses that
 * are hits, of its hits that are lost, and of what both hit that is far apart or another surface; -1: not asked.
 */
static const struct {
    const char *name;
    enum wrong_way way;
    enum ray_kind kind;
    uint32_t wave;
    double only_first[2], only_second[2], far[2], other_surface[2];
} wrongs[] = {
    /* A third, but for how they fall on the numbers. */
    {"lost hits", WRONG_MISSES, RAY_PRIMARY, 0, {0, 0}, {0.32, 0.35}, {0, 0}, {0, 0}},
    {"hits of nothing", WRONG_HITS, RAY_SECONDARY, 1, {0.3, 0.37}, {0, 0}, {0, 0}, {0, 0}},
    {"wrong distances", WRONG_FAR, RAY_SECONDARY, 1, {0, 0}, {0, 0}, {1, 1}, {-1, -1}},
    {"turned normals", WRONG_TURNED, RAY_PRIMARY, 0, {0, 0}, {0, 0}, {0, 0}, {0.5, 1}},
    {"lost shadows", WRONG_LIT, RAY_SHADOW, 0, {0, 0}, {1, 1}, {0, 0}, {0, 0}},
    {"faint shadows", WRONG_FAINT, RAY_SHADOW, 0, {0, 0}, {0, 0}, {0.1, 1}, {-1, -1}},
};

static void expect_share(const char *name, const char *class, uint64_t count, uint64_t rays,
                         const double bounds[2])
{
    const double share = rays > 0 ? (double)count / (double)rays : 0.0;
    if (bounds[0] >= 0.0 && !(share >= bounds[0] && share <= bounds[1]))
        fail_msg("%s: %.4f of %llu rays are %s", name, share, (unsigned long long)rays, class);
}

TEST(what_a_tracer_has_wrong_is_caught_in_its_wave_and_class)
{
    struct fixture *fixture = *state;
    build_scene(fixture);
    for (size_t i = 0; i < sizeof(wrongs) / sizeof(wrongs[0]); i++) {
        examine_wrong(fixture, wrongs[i].way, wrongs[i].kind);
        struct frame_result result = fixture_render(fixture);
        const struct record_wave_comparison *figures = assert_only_wrong(&result, wrongs[i].wave, wrongs[i].kind);
        const uint64_t both = figures->both_hit;
        expect_share(wrongs[i].name, "of the first alone", figures->only_tracer,
                     figures->both_missed + figures->only_tracer, wrongs[i].only_first);
        expect_share(wrongs[i].name, "of the second alone", figures->only_reference,
                     both + figures->only_reference, wrongs[i].only_second);
        expect_share(wrongs[i].name, "far apart", figures->far, both, wrongs[i].far);
        expect_share(wrongs[i].name, "other surfaces", figures->other_surface, both, wrongs[i].other_surface);
        assert_true(disagreeing(figures) > figures->rays / 50);
        assert_true(figures->edges <= disagreeing(figures) / 20);
        if (wrongs[i].way == WRONG_FAR) { /* half a bin, and rounding of a float */
            assert_int_equal(figures->far, figures->both_hit);
            assert_near(figures->distance_median, 0.25, 0.25 / 256 + 1e-5);
            assert_near(figures->distance_max, 0.25, 1e-5);
        }
        if (wrongs[i].way == WRONG_TURNED)
            assert_near(figures->normal_median, 90.0, 1.0); /* the floor is most of what is seen */
        frame_result_finish(&result);
    }
}

/* A ray that is asked about again must be so at its own time: where the shutter opens the ball is elsewhere, and a
 * ray that lost it would seem to have passed its edge. */
TEST(lost_hits_are_caught_where_things_move)
{
    struct fixture *fixture = *state;
    fixture_sphere(fixture, -4.0f, 0.0f, 0.0f, 1.0f, fixture_material(fixture)->base.id);
    uint32_t node = fixture->next_id - 1;
    struct pose_node places[2] = {{.node = node, .parent_from_node = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}},
                                  {.node = node, .parent_from_node = {1, 0, 0, 8, 0, 1, 0, 0, 0, 0, 1, 0}}};
    struct scene_pose poses[2] = {{.nodes = &places[0], .node_count = 1}, {.nodes = &places[1], .node_count = 1}};
    const struct scene_motion motion = {.poses = poses, .pose_count = 2};
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.comparison.compare = true;
    fixture->request.comparison.compare_with = TRACER_NAIVE;
    fixture->request.sampling.samples = 4;
    examine_wrong(fixture, WRONG_MISSES, RAY_PRIMARY);
    struct frame_result result = fixture_render_motion(fixture, &motion);
    const struct record_wave_comparison *figures = assert_only_wrong(&result, 0, RAY_PRIMARY);
    assert_true(figures->only_reference > 100);
    assert_true(figures->edges < figures->only_reference / 20);
    frame_result_finish(&result);
}

TEST(imprecise_distances_are_hits_with_an_error)
{
    struct fixture *fixture = *state;
    build_scene(fixture);
    examine_wrong(fixture, WRONG_IMPRECISE, RAY_PRIMARY);
    struct frame_result result = fixture_render(fixture);
    const struct record_wave_comparison *figures = find(&result, 0, RAY_PRIMARY);
    assert_int_equal(disagreeing(figures), 0);
    /* 1/65536 is 256 steps of a float's last place: half of one step, and half a bin */
    assert_near(figures->relative_median * 65536.0f, 1.0, 1.0 / 512 + 1.0 / 256);
    assert_true(figures->distance_max > 0.0f && figures->distance_max < 1e-4f);
    frame_result_finish(&result);
    fixture->request.comparison.compare_far = 1e-6f; /* smaller than the distance between the two */
    result = fixture_render(fixture);
    figures = find(&result, 0, RAY_PRIMARY);
    assert_int_equal(figures->far, figures->both_hit);
    frame_result_finish(&result);
}

TEST(a_slow_reference_costs_the_frames_tracer_nothing)
{
    struct fixture *fixture = *state;
    build_scene(fixture);
    examine_wrong(fixture, WRONG_SLOW, RAY_PRIMARY);
    fixture->request.tracing.tracer = TRACER_NAIVE;
    fixture->request.comparison.compare_with = TRACER_BVH; /* whom the slow one stands in for */
    struct frame_result result = fixture_render(fixture);
    uint64_t slept_ns = wrong.waves * SLOW_NS, second_ns = 0;
    for (uint32_t i = 0; i < result.comparison_count; i++)
        second_ns += result.comparisons[i].reference_ns;
    assert_true(second_ns >= result.comparison_count * (uint64_t)SLOW_NS);
    uint64_t compare_ns = stage_times_sum_ns(&result.times, STAGE_COMPARE, CLOCK_CPU);
    assert_true(compare_ns >= slept_ns);
    /* The stages of the frame are apart from each other: no sleep is in two of them. */
    static const enum stage others[] = {STAGE_BUILD, STAGE_UPLOAD, STAGE_PRIMARY, STAGE_TRACE, STAGE_SHADE};
    uint64_t sum_ns = compare_ns;
    for (size_t i = 0; i < sizeof(others) / sizeof(others[0]); i++)
        sum_ns += stage_times_sum_ns(&result.times, others[i], CLOCK_CPU);
    assert_true(sum_ns <= stage_times_sum_ns(&result.times, STAGE_FRAME, CLOCK_CPU));
    frame_result_finish(&result);
}

TEST(an_edit_reaches_both_tracers)
{
    struct fixture *fixture = *state;
    build_scene(fixture);
    struct frame_result result = fixture_render(fixture);
    frame_result_finish(&result);
    fixture->request.comparison.compare = false; /* a frame in between that only one of them sees */
    fixture_sphere(fixture, 0.0f, 0.5f, 1.5f, 0.3f, 0);
    result = fixture_render(fixture);
    frame_result_finish(&result);
    fixture->request.comparison.compare = true;
    fixture_sphere(fixture, 0.5f, 0.5f, 1.5f, 0.2f, 0);
    result = fixture_render(fixture);
    assert_complete(&result);
    for (uint32_t i = 0; i < result.comparison_count; i++)
        assert_int_equal(disagreeing(&result.comparisons[i]), 0);
    frame_result_finish(&result);
}

TEST(a_tracer_may_be_compared_with_itself_and_an_empty_scene_too)
{
    struct fixture *fixture = *state;
    fixture->request.tracing.tracer = fixture->request.comparison.compare_with = TRACER_BVH;
    fixture->request.comparison.compare = true;
    struct frame_result result = fixture_render(fixture);
    assert_complete(&result);
    assert_int_equal(result.comparisons[0].both_missed, 32 * 32);
    frame_result_finish(&result);
    build_scene(fixture);
    fixture->request.comparison.compare_with = TRACER_BVH;
    result = fixture_render(fixture);
    assert_complete(&result);
    assert_int_equal(disagreeing(&result.comparisons[0]), 0);
    frame_result_finish(&result);
}

TEST(an_unknown_reference_is_refused_by_name)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    build_scene(fixture);
    fixture_commit(fixture);
    fixture->request.comparison.compare_with = 60;
    assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    assert_int_equal(error.kind, ERROR_UNSUPPORTED);
    assert_string_equal(error.field, "compare_with");
    fixture->request.comparison.compare = false; /* the default */
    assert_true(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    frame_abandon(fixture->renderer);
}
