/* SPDX-License-Identifier: MIT */
/* The integrator `distributed` has no bias, and its error falls as 1 / sqrt(n) or faster: against whitted where
 * both mean the same, against itself at many samples, and against what rough mirrors and windows do with light. */
#include "tests/accuracy/render_fixture.h"

#include "trace/tracer.h"
#include "tests/harness/test.h"

enum { EDGE = 16, PIXELS = EDGE * EDGE };

/* ---- scenes ---- */

static void a_light(struct fixture *fixture, enum light_kind kind, float x, float y, float z, float power)
{
    struct scene_light *light = fixture_light(fixture, kind, x, y, z, power);
    light->size[0] = light->size[1] = 0.8f;
    light->outer_cone = 1.2f;
}

/* Diffuse, mirror and glass, all smooth, a pane that is half open, and lights without a size. */
static void smooth_things(struct fixture *fixture)
{
    struct scene_material *ground = fixture_material(fixture), *mirror = fixture_material(fixture),
                          *glass = fixture_material(fixture), *pane = fixture_material(fixture),
                          *varnish = fixture_material(fixture);
    ground->base_colour[1] = 0.6f;
    mirror->metallic = 1.0f;
    mirror->roughness = 0.0f;
    mirror->base_colour[2] = 0.5f;
    glass->transmission = 1.0f;
    glass->roughness = 0.0f;
    glass->ior = 1.5f;
    pane->alpha_mode = ALPHA_BLEND;
    pane->base_colour[3] = 0.5f;
    varnish->roughness = 0.0f;
    varnish->ior = 1.6f;
    varnish->base_colour[0] = 0.3f;
    fixture_sphere(fixture, -0.8f, 0.3f, 0.0f, 0.5f, mirror->base.id);
    fixture_sphere(fixture, 0.5f, 0.4f, 0.5f, 0.5f, glass->base.id);
    fixture_sphere(fixture, 0.2f, -0.7f, 0.2f, 0.4f, varnish->base.id);
    const float before[12] = {1, 0, 0, -0.5f, 0, 1, 0, -0.6f, 0, 0, 1, 1.0f},
                behind[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1.0f};
    fixture_square(fixture, 0.4f, pane->base.id, before);
    fixture_square(fixture, 4.0f, ground->base.id, behind);
    a_light(fixture, LIGHT_POINT, 2.0f, 2.0f, 2.0f, 8.0f);
    a_light(fixture, LIGHT_POINT, -3.0f, 1.0f, 1.0f, 5.0f);
    a_light(fixture, LIGHT_SPOT, 0.0f, 0.5f, 4.0f, 10.0f);
    a_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 0.3f);
    fixture_environment(fixture, 0.2f, 0.3f, 0.4f);
}

/* A ball that hides part of two lights that have a size from the ground. */
static void a_soft_shadow(struct fixture *fixture)
{
    struct scene_material *ground = fixture_material(fixture);
    fixture_square(fixture, 4.0f, ground->base.id, NULL);
    fixture_sphere(fixture, 0.4f, 0.3f, 0.9f, 0.4f, ground->base.id);
    a_light(fixture, LIGHT_SPHERE, 1.5f, 1.0f, 3.0f, 6.0f);
    a_light(fixture, LIGHT_RECTANGLE, -1.0f, 0.5f, 3.0f, 4.0f);
}

/* A rough metal wall before which coloured balls glow. */
static void gloss(struct fixture *fixture)
{
    struct scene_material *wall = fixture_material(fixture), *glow = fixture_material(fixture);
    wall->metallic = 1.0f;
    wall->roughness = 0.35f;
    glow->unlit = true;
    glow->base_colour[1] = 0.3f;
    fixture_square(fixture, 4.0f, wall->base.id, NULL);
    fixture_sphere(fixture, 1.3f, 0.2f, 0.8f, 0.6f, glow->base.id);
    fixture_sphere(fixture, -1.4f, -0.4f, 0.6f, 0.5f, glow->base.id);
    fixture_environment(fixture, 0.1f, 0.2f, 0.3f);
}

/* Rough glass before a pattern. */
static void frosted_glass(struct fixture *fixture)
{
    struct scene_material *glass = fixture_material(fixture), *glow = fixture_material(fixture);
    glass->transmission = 1.0f;
    glass->roughness = 0.4f;
    glass->ior = 1.4f;
    glow->unlit = true;
    fixture_sphere(fixture, 0.0f, 0.0f, 1.0f, 0.9f, glass->base.id);
    for (int i = 0; i < 5; i++)
        fixture_sphere(fixture, -1.6f + 0.8f * (float)i, (i % 2 ? 0.5f : -0.5f), -1.0f, 0.4f, glow->base.id);
    fixture_environment(fixture, 0.1f, 0.2f, 0.3f);
}

static void out_of_focus(struct fixture *fixture)
{
    a_soft_shadow(fixture);
    fixture->request.aperture = 0.6f;
    fixture->request.focus = 3.5f;
}

/* A ball that falls by its own size while the shutter is open. */
static struct pose_node fall[2];
static struct scene_pose poses[2];
static const struct scene_motion falling = {.poses = poses, .pose_count = 2};

static void in_motion(struct fixture *fixture)
{
    a_soft_shadow(fixture);
    struct scene_material *glow = fixture_material(fixture);
    glow->unlit = true;
    glow->base_colour[1] = 0.8f;
    fixture_sphere(fixture, -0.6f, 0.0f, 0.8f, 0.3f, glow->base.id);
    for (int i = 0; i < 2; i++) {
        fall[i] =
            (struct pose_node){.node = fixture->next_id - 1,
                               .parent_from_node = {1, 0, 0, 0, 0, 1, 0, 0.4f - 0.6f * (float)i, 0, 0, 1, 0}};
        poses[i] = (struct scene_pose){.nodes = &fall[i], .node_count = 1};
    }
}

/* ---- statistics ---- */

static const struct scene_motion *motion_of_scene; /* NULL: nothing moves */

/* Green of every pixel. */
static void picture(struct fixture *fixture, uint32_t samples, uint64_t seed, double values[PIXELS])
{
    fixture->request.samples = samples;
    fixture->request.seed = seed;
    struct frame_result result = fixture_render_motion(fixture, motion_of_scene);
    for (uint32_t i = 0; i < PIXELS; i++)
        values[i] = (double)fixture_pixel(&result, i % EDGE, i / EDGE)[1];
    frame_result_finish(&result);
}

static void begin(struct fixture *fixture, void (*build)(struct fixture *fixture))
{
    fixture_clear((void **)&fixture);
    fixture->request.width = fixture->request.height = EDGE;
    fixture->request.integrator = INTEGRATOR_DISTRIBUTED;
    fixture->request.primary = PRIMARY_TRACE;
    motion_of_scene = build == in_motion ? &falling : NULL;
    build(fixture);
}

struct moments {
    double sum, squares;
    uint32_t count;
};

static void add(struct moments *moments, double value)
{
    moments->sum += value;
    moments->squares += value * value;
    moments->count++;
}

static double mean_of(const struct moments *moments)
{
    return moments->sum / moments->count;
}

/* Of the mean. */
static double standard_error_of(const struct moments *moments)
{
    double mean = mean_of(moments), variance = fmax(moments->squares / moments->count - mean * mean, 0.0);
    return sqrt(variance / (moments->count - 1));
}

/* ---- against whitted ---- */

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(where_all_is_smooth_the_mean_is_whitteds_picture)
{
    struct fixture *fixture = *state;
    enum { SEEDS = 16, BLOCKS = 16, SAMPLES = 64 };
    double own[PIXELS], whitted[PIXELS];
    struct moments differences[BLOCKS] = {0}, whole = {0};
    begin(fixture, smooth_things);
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        double sums[BLOCKS] = {0}, sum = 0.0;
        fixture->request.integrator = INTEGRATOR_WHITTED; /* the same places in the pixels */
        picture(fixture, SAMPLES, seed, whitted);
        fixture->request.integrator = INTEGRATOR_DISTRIBUTED;
        picture(fixture, SAMPLES, seed, own);
        for (uint32_t i = 0; i < PIXELS; i++) {
            sums[i / EDGE / 4 * 4 + i % EDGE / 4] += (own[i] - whitted[i]) / (PIXELS / BLOCKS);
            sum += (own[i] - whitted[i]) / PIXELS;
        }
        for (int b = 0; b < BLOCKS; b++)
            add(&differences[b], sums[b]);
        add(&whole, sum);
    }
    print_message("all: off by %+.1e (standard error %.1e)\n", mean_of(&whole), standard_error_of(&whole));
    /* Student's t with 15 degrees of freedom is beyond 5 in 1 of 6000 cases, of which there are 17. What whitted
     * cuts off (PATH_WEIGHT_MIN) is 1/1024 of what lies there, some 0.5, a few times at most; 1e-3 of it. */
    assert_near(mean_of(&whole), 0.0, 5.0 * standard_error_of(&whole) + 1e-3);
    for (int b = 0; b < BLOCKS; b++)
        assert_near(mean_of(&differences[b]), 0.0, 5.0 * standard_error_of(&differences[b]) + 1e-3);
    assert_true(standard_error_of(&whole) < 2e-3); /* else nothing is shown */
}

/* ---- against itself ---- */

/* Bias and slope of the error over 4, 16, 64 and 256 samples, against 4096 of the reference's. */
static void expect_convergence(struct fixture *fixture, const char *name, double slope_max)
{
    enum { STEPS = 4, SEEDS = 4, TRUTH_SAMPLES = 4096 };
    double truth[PIXELS], found[PIXELS], x_sum = 0.0, y_sum = 0.0, xx = 0.0, xy = 0.0;
    fixture->request.tracer = tracer_impl_by_number(TRACER_REFERENCE) ? TRACER_REFERENCE : 0;
    picture(fixture, TRUTH_SAMPLES, 99, truth);
    fixture->request.tracer = 0;
    for (uint32_t step = 0, samples = 4; step < STEPS; step++, samples *= 4) {
        struct moments means = {0}, offs = {0};
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            double sum = 0.0;
            picture(fixture, samples, seed, found);
            for (uint32_t i = 0; i < PIXELS; i++) {
                add(&offs, found[i] - truth[i]);
                sum += (found[i] - truth[i]) / PIXELS;
            }
            add(&means, sum);
        }
        double rms = sqrt(offs.squares / offs.count), x = log(samples), y = log(rms);
        /* Pixels are independent: the standard error of the mean of all. */
        double standard_error = rms / sqrt(offs.count);
        print_message("%-14s %4u samples: off by %+.1e in the mean (standard error %.1e), %.1e each\n", name,
                      samples, mean_of(&offs), standard_error, rms);
        /* The truth has an error, too: that of 256 / 4096 of the samples, at most a quarter of the last step's. */
        assert_near(mean_of(&offs), 0.0, 4.5 * standard_error + 1e-5);
        x_sum += x;
        y_sum += y;
        xx += x * x;
        xy += x * y;
    }
    double slope = (STEPS * xy - x_sum * y_sum) / (STEPS * xx - x_sum * x_sum);
    print_message("%-14s slope %.2f\n", name, slope);
    assert_true(slope <= slope_max);
}

/* Independent samples have a slope of -0.5. 1024 errors know a deviation to 2 %, more where the errors of a few
 * pixels are large; twice that makes 0.03 of the slope. */
#define SLOPE_MAX (-0.47)

TEST(soft_shadows_converge_without_bias)
{
    begin(*state, a_soft_shadow);
    expect_convergence(*state, "soft shadow", SLOPE_MAX);
}

TEST(glossy_reflections_converge_without_bias)
{
    begin(*state, gloss);
    expect_convergence(*state, "gloss", SLOPE_MAX);
}

TEST(frosted_glass_converges_without_bias)
{
    begin(*state, frosted_glass);
    expect_convergence(*state, "frosted glass", SLOPE_MAX);
}

TEST(depth_of_field_converges_without_bias)
{
    begin(*state, out_of_focus);
    expect_convergence(*state, "out of focus", SLOPE_MAX);
}

TEST(motion_blur_converges_without_bias)
{
    begin(*state, in_motion);
    expect_convergence(*state, "in motion", SLOPE_MAX);
}

/* A ball that glows before nothing, a pixel within its way: the share of the time that it is there. */
TEST(a_moving_surface_covers_a_pixel_for_the_share_of_time_it_is_in_it)
{
    struct fixture *fixture = *state;
    enum { WIDTH = 16, SAMPLES = 256 };
    fixture_clear(state);
    struct scene_material *glow = fixture_material(fixture);
    glow->unlit = true;
    const float square[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    fixture_square(fixture, 0.5f, glow->base.id, square); /* 1 high */
    uint32_t node = fixture->next_id - 1;
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 1.0f);
    for (int i = 0; i < 2; i++) { /* from 1.5 below to 1.5 above */
        fall[i] = (struct pose_node){
            .node = node, .parent_from_node = {1, 0, 0, 0, 0, 1, 0, -1.5f + 3.0f * (float)i, 0, 0, 1, 0}};
        poses[i] = (struct scene_pose){.nodes = &fall[i], .node_count = 1};
    }
    fixture->request.width = fixture->request.height = WIDTH;
    fixture->request.samples = SAMPLES;
    fixture->request.filter = FILTER_BOX;
    fixture->request.camera.fov_y = 0.0f;
    fixture->request.camera.ortho_height = 0.8f;
    for (int i = 0; i < 2; i++) {
        fixture->request.integrator = i ? INTEGRATOR_DISTRIBUTED : INTEGRATOR_WHITTED;
        struct frame_result result = fixture_render_motion(fixture, &falling);
        for (uint32_t p = 0; p < WIDTH * WIDTH; p++)
            /* a third of the time, and one in each 256th of it: off by a sample at each end */
            assert_near(fixture_pixel(&result, p % WIDTH, p / WIDTH)[0], 1.0 / 3.0, 2.01 / SAMPLES + 0.01);
        frame_result_finish(&result);
    }
}

TEST(motion_of_other_content_begins_an_accumulated_picture_from_new)
{
    struct fixture *fixture = *state;
    begin(fixture, in_motion);
    fixture->request.accumulate = true;
    fixture->request.samples = 2;
    static const uint32_t expected[] = {2, 4, 2, 4, 2};
    for (int i = 0; i < 5; i++) {
        if (i == 2)
            fall[1].parent_from_node[7] -= 0.1f;
        struct frame_result result = fixture_render_motion(fixture, i == 4 ? NULL : &falling);
        assert_int_equal(result.samples, expected[i]);
        frame_result_finish(&result);
    }
}

/* ---- counts ---- */

TEST(coverage_is_1_where_translucent_panes_stand_before_a_wall)
{
    struct fixture *fixture = *state;
    begin(fixture, smooth_things);
    fixture->request.samples = 7;
    struct frame_result result = fixture_render(fixture);
    for (uint32_t i = 0; i < PIXELS; i++)
        assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[3], 1.0, 0.0);
    frame_result_finish(&result);
}

TEST(a_sample_has_one_shadow_ray_a_hit_and_one_child_at_most)
{
    struct fixture *fixture = *state;
    begin(fixture, smooth_things);
    fixture->request.samples = 16;
    fixture->request.depth = 3;
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.splits, 0);
    assert_true(result.shadow_rays <= result.primary_rays + result.secondary_rays);
    /* panes do not count as bounces; there is one of them, and a ray may meet it on each leg */
    assert_true(result.secondary_rays <= result.primary_rays * 3 * 2);
    assert_true(result.shadow_rays > result.primary_rays / 2 && result.secondary_rays > result.primary_rays / 8);
    frame_result_finish(&result);
}
