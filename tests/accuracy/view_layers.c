/* SPDX-License-Identifier: MIT */
/* Pictures of eyes that are made from the layers of a key view, beside rendered ones. In place of the structure
 * stands one that knows all surfaces: what differs is then what the pictures of the layers lack. */
#include "tests/accuracy/render_fixture.h"
#include "tests/harness/test.h"

#include "render/frame_state.h"

#define MARGIN 8u /* texels on each side */

/* ---- a structure that knows everything ---- */

static struct trace_view asked;
static struct tracer_impl all_knowing;
static unsigned layer_passes; /* slices of layers */

static enum tracer_progress update(struct tracer *tracer, struct gpu_scene *scene,
                                   const struct tracer_update *update, struct error *error)
{
    asked = *update->view;
    return tracer_naive_impl.update(tracer, scene, update, error);
}

static bool texel_view(const struct tracer *tracer, struct trace_view *texels, uint32_t *layers)
{
    (void)tracer;
    *layers = 1;
    *texels = asked;
    texels->width += 2 * MARGIN;
    texels->height += 2 * MARGIN;
    texels->fov_y =
        2.0f * atanf(tanf(asked.fov_y / 2.0f) * (float)(asked.height + 2 * MARGIN) / (float)asked.height);
    return true;
}

static bool layer_hits(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave,
                       const struct ray_range *rays, uint32_t layer, struct error *error)
{
    struct trace_state state = {
        .impl = tracer->impl,
        .device = tracer->device,
        .wave = *wave,
        .step_end_ns = STEP_WITHOUT_END,
        .range_end = rays->end,
    };
    assert_int_equal(layer, 0);
    layer_passes++;
    return tracer_naive_impl.trace_range(tracer, scene, &state, rays, error);
}

static int clear(void **state)
{
    int status = fixture_clear(state);
    struct fixture *fixture = *state;
    all_knowing = tracer_naive_impl;
    all_knowing.name = "all-knowing";
    all_knowing.depends_on |= CHANGED_VIEW;
    all_knowing.update = update;
    all_knowing.texel_view = texel_view;
    all_knowing.layer_hits = layer_hits;
    layer_passes = 0;
    frame_renderer_stand_in(fixture->renderer, TRACER_QUADTREE, &all_knowing);
    return status;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(clear, NULL)

/* ---- pictures ---- */

/* Of linear values up to 1, in dB. */
static double psnr(const struct frame_result *a, const struct frame_result *b)
{
    const float *p = (const float *)(const void *)a->pixels, *q = (const float *)(const void *)b->pixels;
    double sum = 0;
    const size_t count = (size_t)a->width * a->height;
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 3; c++) {
            double d = (double)fminf(p[4 * i + c], 1.0f) - (double)fminf(q[4 * i + c], 1.0f);
            sum += d * d;
        }
    return -10.0 * log10(sum / (double)(3 * count) + 1e-20);
}

static struct frame_result render_from(struct fixture *fixture, enum view_source source)
{
    fixture->request.view_source = source;
    return fixture_render(fixture);
}

/* The eye of the request goes aside, and what it saw before is the key view. */
static void step_aside(struct fixture *fixture, float metres)
{
    float *m = fixture->request.camera.world_from_view;
    fixture->request.has_key = true;
    fixture->request.key_camera = fixture->request.camera;
    for (int i = 0; i < 3; i++)
        m[4 * i + 3] += metres * m[4 * i];
}

static double unknown_of(const struct frame_result *result)
{
    for (uint32_t i = 0; i < result->structure.count; i++)
        if (strcmp(result->structure.rows[i].name, "views/unknown") == 0)
            return (double)result->structure.rows[i].measure;
    return -1;
}

TEST(a_picture_made_from_layers_of_its_own_view_is_the_rendered_one)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    struct frame_result rendered = render_from(fixture, VIEW_SOURCE_RENDER);
    struct frame_result made = render_from(fixture, VIEW_SOURCE_LAYERS);
    print_message("%.1f dB, unknown %g\n", psnr(&rendered, &made), unknown_of(&made));
    for (uint32_t y = 0; y < made.height; y++)
        for (uint32_t x = 0; x < made.width; x++)
            for (int c = 0; c < 3; c++)
                assert_near(fixture_pixel(&made, x, y)[c], fixture_pixel(&rendered, x, y)[c], 1e-3);
    frame_result_finish(&rendered);
    frame_result_finish(&made);
}

static struct frame_result made_aside(struct fixture *fixture, double *likeness)
{
    struct frame_result rendered = render_from(fixture, VIEW_SOURCE_RENDER);
    struct frame_result made = render_from(fixture, VIEW_SOURCE_LAYERS);
    *likeness = psnr(&rendered, &made);
    frame_result_finish(&rendered);
    return made;
}

TEST(an_eye_aside_is_like_the_rendered_one)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.width = 320;
    fixture->request.height = 240;
    step_aside(fixture, 0.065f);
    double likeness;
    struct frame_result made = made_aside(fixture, &likeness);
    print_message("%.1f dB, unknown %g\n", likeness, unknown_of(&made));
    frame_result_finish(&made);
    fixture->request.samples = 4;
    made = made_aside(fixture, &likeness);
    print_message("4 samples %.1f dB, unknown %g\n", likeness, unknown_of(&made));
    frame_result_finish(&made);
    fixture->request.samples = 16;
    fixture->request.aperture = 0.1f;
    made = made_aside(fixture, &likeness);
    print_message("lens, 16 samples %.1f dB, unknown %g\n", likeness, unknown_of(&made));
    frame_result_finish(&made);
}

TEST(layers_are_rendered_once_for_all_eyes_of_a_key_view)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    step_aside(fixture, 0.05f);
    struct frame_result first = render_from(fixture, VIEW_SOURCE_LAYERS);
    const unsigned passes = layer_passes;
    assert_true(passes > 0);
    assert_true(first.shadow_rays > 0);
    struct frame_result again = render_from(fixture, VIEW_SOURCE_LAYERS);
    assert_int_equal(layer_passes, passes);
    assert_int_equal(again.shadow_rays, 0);
    assert_same_picture(&first, &again);
    fixture->request.seed = 7; /* other samples */
    struct frame_result other = render_from(fixture, VIEW_SOURCE_LAYERS);
    assert_true(layer_passes > passes);
    frame_result_finish(&first);
    frame_result_finish(&again);
    frame_result_finish(&other);
}
