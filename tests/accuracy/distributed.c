/* SPDX-License-Identifier: MIT */
/* The integrator `distributed` has no bias, and its error falls as 1 / sqrt(n) or faster: against whitted where
 * both mean the same, against itself at many samples, and against what rough mirrors and windows do with light. */
#include "tests/accuracy/path_fixture.h"

#include "trace/tracer.h"
#include "tests/harness/test.h"

/* ---- scenes ---- */

static void a_light(struct fixture *fixture, enum light_kind kind, float x, float y, float z, float power)
{
    struct scene_light *light = fixture_light(fixture, kind, x, y, z, power);
    light->value.size[0] = light->value.size[1] = 0.8f;
    light->value.outer_cone = 1.2f;
}

/* Diffuse, mirror and glass, all smooth, a pane that is half open, and lights without a size. */
static void smooth_things(struct fixture *fixture)
{
    struct scene_material *ground = fixture_material(fixture), *mirror = fixture_material(fixture),
                          *glass = fixture_material(fixture), *pane = fixture_material(fixture),
                          *varnish = fixture_material(fixture);
    ground->value.base_colour[1] = 0.6f;
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.0f;
    mirror->value.base_colour[2] = 0.5f;
    glass->value.transmission = 1.0f;
    glass->value.roughness = 0.0f;
    glass->value.ior = 1.5f;
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.5f;
    varnish->value.roughness = 0.0f;
    varnish->value.ior = 1.6f;
    varnish->value.base_colour[0] = 0.3f;
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
    wall->value.metallic = 1.0f;
    wall->value.roughness = 0.35f;
    glow->value.unlit = true;
    glow->value.base_colour[1] = 0.3f;
    fixture_square(fixture, 4.0f, wall->base.id, NULL);
    fixture_sphere(fixture, 1.3f, 0.2f, 0.8f, 0.6f, glow->base.id);
    fixture_sphere(fixture, -1.4f, -0.4f, 0.6f, 0.5f, glow->base.id);
    fixture_environment(fixture, 0.1f, 0.2f, 0.3f);
}

/* Rough glass before a pattern. */
static void frosted_glass(struct fixture *fixture)
{
    struct scene_material *glass = fixture_material(fixture), *glow = fixture_material(fixture);
    glass->value.transmission = 1.0f;
    glass->value.roughness = 0.4f;
    glass->value.ior = 1.4f;
    glow->value.unlit = true;
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
    glow->value.unlit = true;
    glow->value.base_colour[1] = 0.8f;
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
    fixture->request.sampling.samples = samples;
    fixture->request.sampling.seed = seed;
    struct frame_result result = fixture_render_motion(fixture, motion_of_scene);
    for (uint32_t i = 0; i < PIXELS; i++)
        values[i] = (double)fixture_pixel(&result, i % EDGE, i / EDGE)[1];
    frame_result_finish(&result);
}

static void begin(struct fixture *fixture, void (*build)(struct fixture *fixture))
{
    path_begin(fixture, TRACER_BVH, 4);
    fixture->request.sampling.pixel_filter = FILTER_BLACKMAN_HARRIS;
    fixture->request.light.integrator = INTEGRATOR_DISTRIBUTED;
    motion_of_scene = build == in_motion ? &falling : NULL;
    build(fixture);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* Whitted cuts off (PATH_WEIGHT_MIN) 1/1024 of what lies there, some 0.5, a few times at most; 1e-3 of it.
 */
TEST_LONG(where_all_is_smooth_the_mean_is_whitteds_picture)
{
    enum { BLOCKS = 16, ACROSS = EDGE / 4, SAMPLES = 64 };
    struct fixture *fixture = *state;
    double own[PIXELS], whitted[PIXELS], blocks[BLOCKS][SEEDS] = {{0}}, whole[SEEDS] = {0};
    begin(fixture, smooth_things);
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        fixture->request.light.integrator = INTEGRATOR_WHITTED; /* equal places in the pixels */
        picture(fixture, SAMPLES, seed, whitted);
        fixture->request.light.integrator = INTEGRATOR_DISTRIBUTED;
        picture(fixture, SAMPLES, seed, own);
        for (uint32_t i = 0; i < PIXELS; i++) {
            blocks[i / EDGE / ACROSS * 4 + i % EDGE / ACROSS][seed] += (own[i] - whitted[i]) / (PIXELS / BLOCKS);
            whole[seed] += (own[i] - whitted[i]) / PIXELS;
        }
    }
    assert_mean(mean_of(whole, SEEDS), 0.0, 1e-3);
    for (int b = 0; b < BLOCKS; b++)
        assert_mean(mean_of(blocks[b], SEEDS), 0.0, 1e-3);
    assert_true(mean_of(whole, SEEDS).error < 2e-3); /* else nothing is shown */
}

/* Bias and slope of the error over 4, 16, 64 and 256 samples, against 4096 of the reference's. Independent samples
 * have a slope of -0.5. 4096 errors know a deviation to 1 %, more where the errors of a few pixels are large; 0.03
 * of the slope. */
TEST_LONG(soft_things_converge_without_bias_as_fast_as_independent_samples)
{
    enum { STEPS = 4, REPEATS = 4, TRUTH_SAMPLES = 4096 };
    static const struct {
        const char *name;
        void (*build)(struct fixture *fixture);
    } scenes[] = {{"soft shadow", a_soft_shadow},
                  {"gloss", gloss},
                  {"frosted glass", frosted_glass},
                  {"out of focus", out_of_focus},
                  {"in motion", in_motion}};
    struct fixture *fixture = *state;
    for (size_t k = 0; k < COUNT(scenes); k++) {
        double truth[PIXELS], found[PIXELS], x_sum = 0.0, y_sum = 0.0, xx = 0.0, xy = 0.0;
        begin(fixture, scenes[k].build);
        fixture->request.tracing.tracer = tracer_impl_by_number(TRACER_REFERENCE) ? TRACER_REFERENCE : TRACER_BVH;
        picture(fixture, TRUTH_SAMPLES, 99, truth);
        fixture->request.tracing.tracer = TRACER_BVH;
        for (uint32_t step = 0, samples = 4; step < STEPS; step++, samples *= 4) {
            double sum = 0.0, squares = 0.0;
            for (uint64_t seed = 0; seed < REPEATS; seed++) {
                picture(fixture, samples, seed, found);
                for (uint32_t i = 0; i < PIXELS; i++) {
                    sum += (found[i] - truth[i]) / (REPEATS * PIXELS);
                    squares += (found[i] - truth[i]) * (found[i] - truth[i]) / (REPEATS * PIXELS);
                }
            }
            double x = log(samples), y = log(sqrt(squares));
            print_message("%-14s %4u samples: off by %+.1e in the mean, %.1e each\n", scenes[k].name, samples, sum,
                          sqrt(squares));
            /* Pixels are independent. The truth has an error, too: at most a quarter of the last step's. */
            assert_near(sum, 0.0, 4.5 * sqrt(squares / (REPEATS * PIXELS)) + 1e-5);
            x_sum += x;
            y_sum += y;
            xx += x * x;
            xy += x * y;
        }
        double slope = (STEPS * xy - x_sum * y_sum) / (STEPS * xx - x_sum * x_sum);
        if (!(slope <= -0.47))
            fail_msg("%s: slope %.2f", scenes[k].name, slope);
    }
}

/* A ball that glows before nothing, a pixel within its way: the share of the time that it is there. */
TEST(a_moving_surface_covers_a_pixel_for_the_share_of_time_it_is_in_it)
{
    struct fixture *fixture = *state;
    enum { WIDTH = 16, SAMPLES = 256 };
    fixture_clear(state);
    struct scene_material *glow = fixture_material(fixture);
    glow->value.unlit = true;
    const float square[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    fixture_square(fixture, 0.5f, glow->base.id, square); /* 1 high */
    uint32_t node = fixture->next_id - 1;
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 1.0f);
    for (int i = 0; i < 2; i++) { /* from 1.5 below to 1.5 above */
        fall[i] = (struct pose_node){
            .node = node, .parent_from_node = {1, 0, 0, 0, 0, 1, 0, -1.5f + 3.0f * (float)i, 0, 0, 1, 0}};
        poses[i] = (struct scene_pose){.nodes = &fall[i], .node_count = 1};
    }
    fixture->request.picture.width = fixture->request.picture.height = WIDTH;
    fixture->request.sampling.samples = SAMPLES;
    fixture->request.sampling.pixel_filter = FILTER_BOX;
    fixture->request.camera.fov_y = 0.0f;
    fixture->request.camera.ortho_height = 0.8f;
    for (int i = 0; i < 2; i++) {
        fixture->request.light.integrator = i ? INTEGRATOR_DISTRIBUTED : INTEGRATOR_WHITTED;
        struct frame_result result = fixture_render_motion(fixture, &falling);
        for (uint32_t p = 0; p < WIDTH * WIDTH; p++)
            /* a third of the time, and one in each 256th of it: off by a sample at each end */
            assert_near(fixture_pixel(&result, p % WIDTH, p / WIDTH)[0], 1.0 / 3.0, 2.01 / SAMPLES + 0.01);
        frame_result_finish(&result);
    }
}

TEST_LONG(motion_of_other_content_begins_an_accumulated_picture_from_new)
{
    struct fixture *fixture = *state;
    begin(fixture, in_motion);
    fixture->request.sampling.accumulate = true;
    fixture->request.sampling.samples = 2;
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

TEST_LONG(coverage_is_1_where_translucent_panes_stand_before_a_wall)
{
    struct fixture *fixture = *state;
    begin(fixture, smooth_things);
    fixture->request.sampling.samples = 7;
    struct frame_result result = fixture_render(fixture);
    for (uint32_t i = 0; i < PIXELS; i++)
        assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[3], 1.0, 0.0);
    frame_result_finish(&result);
}

TEST_LONG(a_sample_has_one_shadow_ray_a_hit_and_one_child_at_most)
{
    struct fixture *fixture = *state;
    begin(fixture, smooth_things);
    fixture->request.sampling.samples = 16;
    fixture->request.light.depth = 3;
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.splits, 0);
    assert_true(result.shadow_rays <= result.primary_rays + result.secondary_rays);
    /* panes do not count as bounces; there is one of them, and a ray may meet it on each leg */
    assert_true(result.secondary_rays <= result.primary_rays * 3 * 2);
    assert_true(result.shadow_rays > result.primary_rays / 2 && result.secondary_rays > result.primary_rays / 8);
    frame_result_finish(&result);
}
