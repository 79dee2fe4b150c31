/* SPDX-License-Identifier: MIT */
/* Pictures of eyes that are made from the layers of a key view, beside rendered ones. In place of the structure
 * stands one that knows all surfaces: what differs is then what the pictures of the layers lack. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"

#include "render/frame/state.h"

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

static bool layer_hits(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                       uint32_t layer, struct error *error)
{
    struct trace_state state = {
        .impl = tracer->impl,
        .device = tracer->device,
        .wave = *rays->wave,
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
    fixture->request.tracer_options.quadtree.radius = 0.15f; /* requests come with defaults in place */
    fixture->request.tracer_options.quadtree.pixels = 0.25f;
    frame_renderer_stand_in(fixture->renderer, TRACER_QUADTREE, &all_knowing);
    return status;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(clear, NULL)

/* ---- pictures ---- */

static struct frame_result render_from(struct fixture *fixture, enum view_source source)
{
    fixture->request.picture.view_source = source;
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

/* The mixed scene, with lights of which each pixel sees the same: a texel of the key view is no pixel of the
 * picture, so samples of an area light differ. `plain`: without mirror, glass and veil, which look different
 * from aside. */
static void mix(struct fixture *fixture, bool plain)
{
    fixture_mixture(fixture);
    for (size_t i = 0; i < fixture->edit_count; i++) {
        struct scene_edit *edit = &fixture->edits[i];
        if (edit->object == OBJECT_LIGHT)
            edit->set.light.value.kind = LIGHT_POINT;
        if (!plain || edit->kind != EDIT_SET || edit->object != OBJECT_MATERIAL)
            continue;
        struct scene_material *material = &edit->set.material;
        material->value.transmission = material->value.metallic = 0.0f;
        material->value.alpha_mode = ALPHA_OPAQUE;
        material->value.roughness = material->value.ior = 1.0f;
    }
}

static void assert_like(const struct frame_result *made, const struct frame_result *rendered, float tolerance)
{
    for (uint32_t y = 0; y < made->height; y++)
        for (uint32_t x = 0; x < made->width; x++)
            for (int c = 0; c < 4; c++)
                assert_near(fixture_pixel(made, x, y)[c], fixture_pixel(rendered, x, y)[c], tolerance);
}

/* The eye is that of the key view, and pixels' centres are those of texels: what is left is the rounding of
 * places, some 1e-5 of a texel, times what a texel differs from the next one, at most 4 in the mirrored lights. */
TEST(a_picture_made_from_layers_of_its_own_view_is_the_rendered_one)
{
    struct fixture *fixture = *state;
    mix(fixture, false);
    struct frame_result rendered = render_from(fixture, VIEW_SOURCE_RAYS);
    struct frame_result made = render_from(fixture, VIEW_SOURCE_LAYERS);
    assert_like(&made, &rendered, 1e-3f);
    assert_near(unknown_of(&made), 0, 0);
    assert_near(unknown_of(&rendered), -1, 0); /* there is no such row */
    frame_result_finish(&rendered);
    frame_result_finish(&made);
}

/* PSNR of the pixels that are known, in dB, of values up to 1. `made` has LAYER_UNKNOWN behind its beauty. */
static double psnr_known(const struct frame_result *made, const struct frame_result *rendered)
{
    const size_t pixels = (size_t)made->width * made->height;
    const float *a = fixture_pixel(made, 0, 0), *b = fixture_pixel(rendered, 0, 0), *unknown = a + 4 * pixels;
    double sum = 0, count = 1e-9;
    for (size_t i = 0; i < 4 * pixels; i++) {
        if (i % 4 == 3 || unknown[i - i % 4] > 0)
            continue;
        const double d = (double)fminf(a[i], 1.0f) - (double)fminf(b[i], 1.0f);
        sum += d * d;
        count++;
    }
    return -10.0 * log10(sum / count + 1e-20);
}

static void expect_like_from_aside(struct fixture *fixture, double least_db, double most_unknown)
{
    fixture->request.picture.layers = 1u << LAYER_BEAUTY | 1u << LAYER_UNKNOWN;
    struct frame_result made = render_from(fixture, VIEW_SOURCE_LAYERS);
    fixture->request.picture.layers = 0;
    struct frame_result rendered = render_from(fixture, VIEW_SOURCE_RAYS);
    const double likeness = psnr_known(&made, &rendered), unknown = unknown_of(&made);
    print_message("%u samples, lens %g: %.1f dB where known, %.2f %% unknown\n", fixture->request.sampling.samples,
                  (double)fixture->request.aperture, likeness, 100 * unknown);
    assert_true(likeness >= least_db);
    assert_true(unknown <= most_unknown); /* behind edges */
    frame_result_finish(&rendered);
    frame_result_finish(&made);
}

/* Between texels' centres radiance is interpolated, which blurs edges of shadows by half a texel, no more. There
 * is no texture, and unknown pixels are left out. */
TEST(an_eye_aside_is_like_the_rendered_one_where_the_key_view_knows)
{
    struct fixture *fixture = *state;
    mix(fixture, true);
    fixture->request.picture.width = 320;
    fixture->request.picture.height = 240;
    step_aside(fixture, 0.065f);
    expect_like_from_aside(fixture, 40, 0.005);
    if (!getenv("FARLIGHT_TEST_LONG"))
        return;
    fixture->request.sampling.samples = 16;
    expect_like_from_aside(fixture, 40, 0.005);
    fixture->request.aperture = 0.05f;
    expect_like_from_aside(fixture, 40, 0.005);
}

/* Each view is the picture that an eye aside sees alone, from the same key view. */
TEST_LONG(views_side_by_side_are_those_of_eyes_side_by_side)
{
    struct fixture *fixture = *state;
    mix(fixture, true);
    fixture->request.picture.views_across = 3;
    fixture->request.picture.views_down = 2;
    fixture->request.picture.baseline = 0.05f;
    fixture->request.picture.width = 3 * 320;
    fixture->request.picture.height = 2 * 240;
    struct frame_result rendered = render_from(fixture, VIEW_SOURCE_RAYS);
    fixture->request.picture.layers = 1u << LAYER_BEAUTY | 1u << LAYER_UNKNOWN;
    struct frame_result made = render_from(fixture, VIEW_SOURCE_LAYERS);
    const double likeness = psnr_known(&made, &rendered);
    print_message("%.1f dB where known, %.2f %% unknown\n", likeness, 100 * unknown_of(&made));
    assert_true(likeness >= 40);
    assert_true(unknown_of(&made) < 0.01);
    frame_result_finish(&rendered);
    frame_result_finish(&made);
}

TEST(layers_are_rendered_once_for_all_eyes_of_a_key_view)
{
    struct fixture *fixture = *state;
    mix(fixture, false);
    step_aside(fixture, 0.05f);
    struct frame_result first = render_from(fixture, VIEW_SOURCE_LAYERS);
    const unsigned passes = layer_passes;
    assert_true(passes > 0);
    assert_true(first.shadow_rays > 0);
    struct frame_result again = render_from(fixture, VIEW_SOURCE_LAYERS);
    assert_int_equal(layer_passes, passes);
    assert_int_equal(again.shadow_rays, 0);
    assert_same_picture(&first, &again);
    frame_result_finish(&again);
    fixture->request.light.depth = 1; /* they would be others */
    again = render_from(fixture, VIEW_SOURCE_LAYERS);
    assert_true(layer_passes > passes);
    frame_result_finish(&again);
    fixture->request.light.depth = 4;
    const unsigned before = layer_passes;
    fixture_environment(fixture, 1.0f, 0.0f, 0.0f); /* the scene is another one */
    again = render_from(fixture, VIEW_SOURCE_LAYERS);
    assert_true(layer_passes > before);
    frame_result_finish(&first);
    frame_result_finish(&again);
}

TEST(a_frame_cut_into_small_slices_is_the_same)
{
    struct fixture *fixture = *state;
    mix(fixture, false);
    step_aside(fixture, 0.05f);
    fixture->request.sampling.samples = 2;
    fixture->request.picture.layers = 1u << LAYER_BEAUTY | 1u << LAYER_UNKNOWN;
    struct frame_result whole = render_from(fixture, VIEW_SOURCE_LAYERS);
    for (int ahead = 0; ahead < 2; ahead++) {
        fixture->request.sampling.seed++; /* lights are points: the layers are rendered again, and the same */
        fixture->request.sampling.seed %= 2;
        frame_renderer_set_capacity(fixture->renderer, 500, 2000);
        frame_renderer_queue_ahead(fixture->renderer, ahead);
        struct frame_result cut = render_from(fixture, VIEW_SOURCE_LAYERS);
        if (fixture->request.sampling.seed == 0)
            assert_same_picture(&whole, &cut);
        frame_result_finish(&cut);
    }
    frame_result_finish(&whole);
}

/* The layers show the same with 2 samples a texel as with 4, which all pass through its middle. */
TEST(samples_of_eyes_add_up_from_frame_to_frame)
{
    struct fixture *fixture = *state;
    mix(fixture, false);
    step_aside(fixture, 0.05f);
    fixture->request.sampling.accumulate = true;
    fixture->request.sampling.samples = 4;
    struct frame_result at_once = render_from(fixture, VIEW_SOURCE_LAYERS);
    fixture->request.sampling.samples = 2;
    fixture->request.key_camera.world_from_view[3] += 0.01f; /* another key view: it begins anew */
    struct frame_result result = render_from(fixture, VIEW_SOURCE_LAYERS);
    assert_int_equal(result.samples, 2);
    frame_result_finish(&result);
    fixture->request.key_camera.world_from_view[3] -= 0.01f;
    for (uint32_t i = 1; i <= 2; i++) {
        result = render_from(fixture, VIEW_SOURCE_LAYERS);
        assert_int_equal(result.samples, 2 * i);
        if (i == 2)
            assert_like(&result, &at_once, 1e-4f); /* the sums are of other numbers of samples: rounding */
        frame_result_finish(&result);
    }
    frame_result_finish(&at_once);
}

/* Beside the beauty they are of what the eyes' own rays hit. */
TEST(other_layers_of_a_made_picture_are_those_of_the_rendered_one)
{
    struct fixture *fixture = *state;
    const uint32_t others = 1u << LAYER_ALBEDO | 1u << LAYER_NORMAL | 1u << LAYER_DEPTH | 1u << LAYER_ID;
    mix(fixture, false);
    fixture->request.tracing.primary = PRIMARY_TRACE;
    step_aside(fixture, 0.05f);
    fixture->request.picture.layers = others;
    struct frame_result rendered = render_from(fixture, VIEW_SOURCE_RAYS);
    struct frame_result made = render_from(fixture, VIEW_SOURCE_LAYERS);
    assert_same_picture(&made, &rendered);
    frame_result_finish(&rendered);
    frame_result_finish(&made);
}

TEST(what_cannot_be_made_from_layers_is_refused_by_name)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    mix(fixture, false);
    fixture_commit(fixture);
    fixture->request.picture.view_source = VIEW_SOURCE_LAYERS;
    fixture->request.comparison.compare = true;
    assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    assert_string_equal(error.field, "compare");
    fixture->request.comparison.compare = false;
    all_knowing.texel_view = NULL;
    error = (struct error){0};
    assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    assert_string_equal(error.field, "view_source");
}

/* ---- the structure itself ---- */

/* A room of triangles: floor, wall, and panels at different distances. */
static void panels(struct fixture *fixture)
{
    static const float colours[5][3] = {
        {0.8f, 0.3f, 0.2f}, {0.2f, 0.7f, 0.3f}, {0.2f, 0.3f, 0.8f}, {0.8f, 0.8f, 0.2f}, {0.7f, 0.7f, 0.7f}};
    uint32_t materials[5];
    for (int i = 0; i < 5; i++) {
        struct scene_material *material = fixture_material(fixture);
        memcpy(material->value.base_colour, colours[i], sizeof(colours[i]));
        materials[i] = material->base.id;
    }
    const float floor_transform[12] = {1, 0, 0, 0, 0, 0, 1, -0.6f, 0, -1, 0, 0};
    const float wall_transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -3};
    fixture_square(fixture, 4.0f, materials[4], floor_transform);
    fixture_square(fixture, 4.0f, materials[3], wall_transform);
    for (int i = 0; i < 4; i++) {
        const float c = cosf(0.3f * (float)i), s = sinf(0.3f * (float)i);
        const float transform[12] = {c,  0, s, -1.2f + 0.8f * (float)i, 0, 1, 0, 0.1f,
                                     -s, 0, c, 0.7f * (float)i - 1.5f};
        fixture_square(fixture, 0.3f, materials[i % 3], transform);
    }
    fixture_light(fixture, LIGHT_POINT, -2.0f, 3.0f, 3.0f, 60.0f);
    fixture_environment(fixture, 0.3f, 0.4f, 0.5f);
    fixture->request.picture.width = 320;
    fixture->request.picture.height = 240;
    fixture_set_camera(fixture, 0.5f, 0.6f, 4.0f, 0.7f);
}

TEST_LONG(the_quadtree_of_a_view_shows_eyes_aside_as_they_are_rendered)
{
    struct fixture *fixture = *state;
    panels(fixture);
    frame_renderer_stand_in(fixture->renderer, 0, NULL);
    fixture->request.tracing.tracer = TRACER_BVH;
    struct frame_result rendered = render_from(fixture, VIEW_SOURCE_RAYS);
    fixture->request.picture.layers = 1u << LAYER_BEAUTY | 1u << LAYER_UNKNOWN;
    struct frame_result made = render_from(fixture, VIEW_SOURCE_LAYERS);
    print_message("own view: %.1f dB, %.2f %%\n", psnr_known(&made, &rendered), 100 * unknown_of(&made));
    assert_true(psnr_known(&made, &rendered) >= 80); /* texels' centres are pixels' */
    fixture->request.picture.layers = 0;
    frame_result_finish(&rendered);
    frame_result_finish(&made);
    step_aside(fixture, 0.065f);
    /* With one layer the surfaces behind the panels are missing: 0.6 m high, 3.4 to 5.5 m away and 1.5 to 3.6
     * m before the wall, panels hide strips of 0.8 to 3.2 pixels, 380 of 76,800 together: 0.49 %. With two
     * layers nothing is missing. Whole pictures must reach 35 dB. The picture ends at a tangent of 0.487, the
     * view with its margin at 0.535. Rays from aside that enter it farther than 1.2 m away are unknown: those
     * above 0.535 - 0.065 / 1.2 (1 + 0.535^2)^0.5 = 0.474, the last 5 of 320 columns, 1.56 %. */
    const double outside = 0.0156;
    for (uint32_t layers = 1; layers <= 3; layers++) {
        fixture->request.tracer_options.quadtree.layers = layers;
        expect_like_from_aside(fixture, 35, outside + (layers == 1 ? 0.006 : 0.001));
    }
    fixture->request.picture.format = PIXEL_FORMAT_RGBA8;
    made = render_from(fixture, VIEW_SOURCE_LAYERS);
    fixture_keep(&made, "panels from layers");
    frame_result_finish(&made);
    made = render_from(fixture, VIEW_SOURCE_RAYS);
    fixture_keep(&made, "panels from rays");
    frame_result_finish(&made);
}

/* The wall gets dark squares, which a lens blurs. */
static void squares_on_the_wall(struct fixture *fixture)
{
    struct scene_material *dark = fixture_material(fixture);
    dark->value.base_colour[0] = dark->value.base_colour[1] = 0.1f;
    const uint32_t material = dark->base.id;
    for (int i = 0; i < 40; i++) {
        const float x = -2.0f + 0.4f * (float)(i % 10), y = 0.2f + 0.4f * (float)(i / 10);
        const float transform[12] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, -2.99f};
        fixture_square(fixture, 0.1f, material, transform);
    }
}

/* Beside each ray of the lens others look at the plane that it has met. */
TEST_LONG(a_lens_over_layers_has_less_noise_than_as_many_traced_samples)
{
    struct fixture *fixture = *state;
    panels(fixture);
    squares_on_the_wall(fixture);
    frame_renderer_stand_in(fixture->renderer, 0, NULL);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.aperture = 0.1f;
    fixture->request.focus = 4.0f;
    fixture->request.sampling.samples = 64;
    struct frame_result truth = render_from(fixture, VIEW_SOURCE_RAYS);
    fixture->request.sampling.samples = 4;
    fixture->request.picture.layers = 1u << LAYER_BEAUTY | 1u << LAYER_UNKNOWN;
    struct frame_result traced = render_from(fixture, VIEW_SOURCE_RAYS);
    struct frame_result made = render_from(fixture, VIEW_SOURCE_LAYERS);
    const double traced_db = psnr_known(&traced, &truth), made_db = psnr_known(&made, &truth);
    print_message("4 samples: traced %.1f dB, from layers %.1f dB\n", traced_db, made_db);
    assert_true(made_db >= traced_db + 1);
    frame_result_finish(&truth);
    frame_result_finish(&traced);
    frame_result_finish(&made);
}
