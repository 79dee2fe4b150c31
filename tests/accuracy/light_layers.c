/* SPDX-License-Identifier: MIT */
/* Layers of light: they add up to the beauty, and each holds the light that comes its way. */
#include "tests/accuracy/render_fixture.h"

#include "shared/layers.h"
#include "tests/harness/test.h"

#define ALL (1u << LAYER_BEAUTY | LAYER_BITS_LIGHT_PARTS)
/* Rounding of a sum of some tens of floats, in another order and cut into parts: a few times 2^-24. */
#define ROUNDING 1e-6

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static const float *pixel_of(const struct frame_result *result, enum layer layer, uint32_t x, uint32_t y)
{
    const uint32_t plane = (uint32_t)__builtin_popcount(result->layers & ((1u << layer) - 1));
    return fixture_pixel(result, x, plane * result->height + y);
}

static struct frame_result render(struct fixture *fixture, unsigned integrator)
{
    fixture->request.light.integrator = integrator;
    fixture->request.picture.layers = ALL;
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.layers, ALL);
    return result;
}

static void expect_sum(const struct frame_result *result)
{
    for (uint32_t y = 0; y < result->height; y++)
        for (uint32_t x = 0; x < result->width; x++)
            for (int c = 0; c < 3; c++) {
                const double beauty = (double)pixel_of(result, LAYER_BEAUTY, x, y)[c];
                double sum = 0;
                for (uint32_t left = LAYER_BITS_LIGHT_PARTS; left; left &= left - 1)
                    sum += (double)pixel_of(result, (enum layer)__builtin_ctz(left), x, y)[c];
                assert_near(sum, beauty, ROUNDING * fmax(beauty, 1.0));
            }
}

/* A lit square above it all, which paths find both ways. */
static void build_mixture(struct fixture *fixture)
{
    const float above[12] = {1, 0, 0, 0, 0, 0, -1, 2, 0, 1, 0, 0};
    struct scene_material *glow = fixture_material(fixture);
    glow->value.emission[0] = glow->value.emission[1] = glow->value.emission[2] = 3.0f;
    fixture_square(fixture, 0.5f, glow->base.id, above);
    fixture_mixture(fixture);
    fixture->request.picture.width = 24;
    fixture->request.picture.height = 18;
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.light.depth = 4;
    fixture->request.sampling.samples = 4;
}

TEST(layers_of_light_add_up_to_the_beauty)
{
    struct fixture *fixture = *state;
    build_mixture(fixture);
    for (unsigned integrator = INTEGRATOR_DISTRIBUTED; integrator <= INTEGRATOR_PATH;
         integrator += INTEGRATOR_PATH - INTEGRATOR_DISTRIBUTED) {
        fixture->request.picture.layers = 0;
        fixture->request.light.integrator = integrator;
        struct frame_result alone = fixture_render(fixture), result = render(fixture, integrator);
        assert_memory_equal(result.pixels, alone.pixels, alone.size_bytes); /* noting changes nothing */
        expect_sum(&result);
        frame_result_finish(&alone);
        frame_result_finish(&result);
    }
}

/* Exposed, over a colour and shadows on a ground, where tiles stop, and through stored samples. */
TEST_LONG(layers_of_light_add_up_however_the_beauty_is_made)
{
    struct fixture *fixture = *state;
    build_mixture(fixture);
    fixture->request.picture.exposure_stops = 1.5f;
    fixture->request.picture.background = BACKGROUND_COLOUR;
    fixture->request.picture.background_colour[0] = 0.25f;
    fixture->request.ground =
        (struct frame_ground){.centre_world = {0, -0.7f, 0}, .normal_world = {0, 1, 0}, .radius = 9};
    fixture->request.tracer_options.ldc.resolution = 64;
    for (unsigned integrator = INTEGRATOR_DISTRIBUTED; integrator <= INTEGRATOR_PATH;
         integrator += INTEGRATOR_PATH - INTEGRATOR_DISTRIBUTED)
        for (int way = 0; way < 4; way++) {
            fixture->request.picture.background = way ? BACKGROUND_ENVIRONMENT : BACKGROUND_COLOUR;
            fixture->request.sampling.noise = way == 1 ? 0.2f : 0.0f;
            fixture->request.sampling.samples = way == 1 ? 64 : 3;
            fixture->request.tracing.tracer = way == 2 ? TRACER_LDC : TRACER_BVH;
            fixture->request.light.clamp = way == 3 ? 0.1f : 0.0f;
            struct frame_result result = render(fixture, integrator);
            expect_sum(&result);
            frame_result_finish(&result);
        }
}

/* ---- seven things side by side, of 2 m each, below a grey sky ---- */

enum thing { MATTE, MIRROR, GLOW, GLASS, MIRROR_OF_MATTE, VEIL, NOTHING, THINGS };

static void build_things(struct fixture *fixture)
{
    const float c = sqrtf(0.5f), wall[12] = {0, 0, -1, 9, 0, 1, 0, 0, 1, 0, 0, 0};
    for (int i = 0; i < NOTHING; i++) {
        const bool turned = i == MIRROR_OF_MATTE;
        const float x = 2.0f * (float)i - 6.0f, at[12] = {turned ? c : 1,  0, turned ? c : 0, x, 0, 1, 0, 0,
                                                          turned ? -c : 0, 0, turned ? c : 1, 0};
        struct scene_material *material = fixture_material(fixture);
        if (i == MIRROR || turned) {
            material->value.metallic = 1.0f;
            material->value.roughness = 0.0f;
        } else if (i == GLOW) {
            material->value.emission[0] = material->value.emission[1] = material->value.emission[2] = 2.0f;
            material->value.base_colour[0] = material->value.base_colour[1] = material->value.base_colour[2] =
                0.0f;
        } else if (i == GLASS) {
            material->value.transmission = 1.0f;
            material->value.roughness = 0.0f;
            material->value.ior = 1.5f;
        } else if (i == VEIL) {
            material->value.alpha_mode = ALPHA_BLEND;
            memcpy(material->value.base_colour, (float[4]){0, 0, 0, 0.5f}, sizeof(material->value.base_colour));
        }
        fixture_square(fixture, 0.9f, material->base.id, at);
    }
    fixture_square(fixture, 3.0f, fixture_material(fixture)->base.id, wall); /* out of view, seen in a mirror */
    fixture_environment(fixture, 0.5f, 0.5f, 0.5f);
    fixture_set_camera(fixture, 0, 0, 5, 0);
    fixture->request.camera.ortho_height = 2;
    fixture->request.picture.width = 8 * THINGS;
    fixture->request.picture.height = 8;
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.sampling.samples = 16;
}

/* The middle of one. */
static double light_of(const struct frame_result *result, enum layer layer, enum thing thing)
{
    return (double)pixel_of(result, layer, 8 * (uint32_t)thing + 4, 4)[1];
}

static void expect_light(const struct frame_result *result, enum layer layer, enum thing thing, double share)
{
    const double beauty = light_of(result, LAYER_BEAUTY, thing), light = light_of(result, layer, thing);
    if (!(beauty > 0.2) || !(light >= (share - ROUNDING) * beauty))
        fail_msg("thing %d: %g of %g in layer %d, not %g of it", (int)thing, light, beauty, (int)layer, share);
}

TEST(light_is_in_the_layer_of_its_first_surface)
{
    struct fixture *fixture = *state;
    build_things(fixture);
    for (unsigned integrator = INTEGRATOR_DISTRIBUTED; integrator <= INTEGRATOR_PATH;
         integrator += INTEGRATOR_PATH - INTEGRATOR_DISTRIBUTED) {
        struct frame_result result = render(fixture, integrator);
        expect_light(&result, LAYER_DIFFUSE_DIRECT, MATTE, 0.9); /* the turned mirror stands beside it */
        expect_light(&result, LAYER_SPECULAR_DIRECT, MIRROR, 1);
        expect_light(&result, LAYER_EMISSION, GLOW, 1);
        expect_light(&result, LAYER_TRANSMISSION, GLASS,
                     0.8); /* 4 % is mirrored, within the noise of 16 samples */
        expect_light(&result, LAYER_SPECULAR_INDIRECT, MIRROR_OF_MATTE, 1);
        expect_light(&result, LAYER_BACKGROUND, VEIL, 1); /* a black one */
        expect_light(&result, LAYER_BACKGROUND, NOTHING, 1);
        assert_near(light_of(&result, LAYER_BACKGROUND, VEIL), 0.25, 0.05); /* a half, by 16 samples */
        assert_near(pixel_of(&result, LAYER_BACKGROUND, 4, 4)[3], 1, 0);    /* coverage of the picture */
        expect_sum(&result);
        frame_result_finish(&result);
    }
}

/* ---- light groups: two lights, a glowing square, the environment, and the rest ---- */

#define GROUPS (1u << LAYER_BEAUTY | LAYER_BITS_LIGHT_GROUPS)

/* Puts the two lights of the mixture into groups 1 and 2, the square that glows into 3, the environment into 4. */
static void put_into_groups(struct fixture *fixture)
{
    uint32_t lights = 0, squares = 0;
    for (size_t i = 0; i < fixture->edit_count; i++) {
        struct scene_edit *edit = &fixture->edits[i];
        struct scene_node *node = &edit->set.node;
        if (edit->kind == EDIT_SET_ENVIRONMENT)
            edit->set.environment.value.light_group = 4;
        else if (edit->object == OBJECT_NODE && node->value.kind == NODE_LIGHT)
            node->value.light_group = ++lights;
        else if (edit->object == OBJECT_NODE && node->value.kind == NODE_MESH && squares++ == 0)
            node->value.light_group = 3;
    }
}

static void expect_sum_of_groups(const struct frame_result *result)
{
    for (uint32_t i = 0; i < result->width * result->height * 3; i++) {
        const uint32_t x = i / 3 % result->width, y = i / 3 / result->width, c = i % 3;
        const double beauty = (double)pixel_of(result, LAYER_BEAUTY, x, y)[c];
        double sum = 0;
        for (enum layer layer = LAYER_LIGHT_REST; layer <= LAYER_LIGHT_GROUP7; layer++)
            sum += (double)pixel_of(result, layer, x, y)[c];
        assert_near(sum, beauty, ROUNDING * fmax(beauty, 1.0));
    }
}

static double mean_of_layer(const struct frame_result *result, enum layer layer)
{
    double sum = 0;
    for (uint32_t y = 0; y < result->height; y++)
        for (uint32_t x = 0; x < result->width; x++)
            sum += (double)pixel_of(result, layer, x, y)[1];
    return sum / (result->width * result->height);
}

TEST(light_groups_add_up_to_the_beauty)
{
    struct fixture *fixture = *state;
    build_mixture(fixture);
    put_into_groups(fixture);
    for (unsigned integrator = INTEGRATOR_DISTRIBUTED; integrator <= INTEGRATOR_PATH;
         integrator += INTEGRATOR_PATH - INTEGRATOR_DISTRIBUTED) {
        fixture->request.light.integrator = integrator;
        fixture->request.picture.layers = 0;
        struct frame_result alone = fixture_render(fixture);
        fixture->request.picture.layers = GROUPS;
        struct frame_result result = fixture_render(fixture);
        assert_memory_equal(result.pixels, alone.pixels, alone.size_bytes); /* noting changes nothing */
        expect_sum_of_groups(&result);
        for (enum layer layer = LAYER_LIGHT_GROUP1; layer <= LAYER_LIGHT_GROUP4; layer++)
            assert_true(mean_of_layer(&result, layer) > 0.001);
        assert_near(mean_of_layer(&result, LAYER_LIGHT_REST), 0, 0);
        assert_near(mean_of_layer(&result, LAYER_LIGHT_GROUP5), 0, 0);
        frame_result_finish(&alone);
        frame_result_finish(&result);
    }
}

/* Exposed, over a colour and shadows on a ground, where tiles stop, clamped, and beside the parts. */
TEST_LONG(light_groups_add_up_however_the_beauty_is_made)
{
    struct fixture *fixture = *state;
    build_mixture(fixture);
    put_into_groups(fixture);
    fixture->request.picture.exposure_stops = 1.5f;
    fixture->request.picture.background_colour[0] = 0.25f;
    fixture->request.ground =
        (struct frame_ground){.centre_world = {0, -0.7f, 0}, .normal_world = {0, 1, 0}, .radius = 9};
    for (unsigned integrator = INTEGRATOR_DISTRIBUTED; integrator <= INTEGRATOR_PATH;
         integrator += INTEGRATOR_PATH - INTEGRATOR_DISTRIBUTED)
        for (int way = 0; way < 3; way++) {
            fixture->request.picture.background = way ? BACKGROUND_ENVIRONMENT : BACKGROUND_COLOUR;
            fixture->request.sampling.noise = way == 1 ? 0.2f : 0.0f;
            fixture->request.sampling.samples = way == 1 ? 64 : 3;
            fixture->request.light.clamp = way == 2 ? 0.1f : 0.0f;
            fixture->request.light.integrator = integrator;
            fixture->request.picture.layers = ALL | GROUPS;
            struct frame_result result = fixture_render(fixture);
            expect_sum(&result);
            expect_sum_of_groups(&result);
            frame_result_finish(&result);
        }
}

/* Blackens all that is not in the group; the sky keeps a light too faint to see, or the default one would shine.
 */
static void leave_group(struct fixture *fixture, uint32_t group)
{
    for (size_t i = 0; i < fixture->edit_count; i++) {
        struct scene_edit *edit = &fixture->edits[i];
        if (edit->kind == EDIT_SET_ENVIRONMENT && group != 4)
            for (int c = 0; c < 3; c++)
                edit->set.environment.value.colour[c] = 1e-9f;
        else if (edit->kind == EDIT_SET && edit->object == OBJECT_LIGHT && group > 2)
            memset(edit->set.light.value.colour, 0, sizeof(edit->set.light.value.colour));
        else if (edit->kind == EDIT_SET && edit->object == OBJECT_LIGHT &&
                 (edit->set.light.value.kind == LIGHT_POINT) != (group == 1))
            memset(edit->set.light.value.colour, 0, sizeof(edit->set.light.value.colour));
        else if (edit->kind == EDIT_SET && edit->object == OBJECT_MATERIAL && group != 3)
            memset(edit->set.material.value.emission, 0, sizeof(edit->set.material.value.emission));
    }
}

/* The choice of lights is another where some are dark, and so is the noise: the means of 432 pixels with 64
 * samples differ by less than 1 % for three seeds; twice that is allowed. */
TEST_LONG(a_light_group_is_the_picture_with_the_other_lights_off)
{
    struct fixture *fixture = *state;
    for (unsigned integrator = INTEGRATOR_DISTRIBUTED; integrator <= INTEGRATOR_PATH;
         integrator += INTEGRATOR_PATH - INTEGRATOR_DISTRIBUTED)
        for (uint32_t group = 1; group <= 4; group++) {
            double means[2];
            for (int off = 0; off < 2; off++) {
                fixture_clear(state);
                build_mixture(fixture);
                put_into_groups(fixture);
                if (off)
                    leave_group(fixture, group);
                fixture->request.light.integrator = integrator;
                fixture->request.sampling.samples = 64;
                fixture->request.picture.layers = GROUPS;
                struct frame_result result = fixture_render(fixture);
                const enum layer layer = off ? LAYER_BEAUTY : (enum layer)(LAYER_LIGHT_REST + group);
                means[off] = mean_of_layer(&result, layer);
                frame_result_finish(&result);
            }
            assert_near(means[0], means[1], 0.02 * means[1]);
        }
}

/* Samples hold no node. */
TEST(stored_samples_do_not_tell_which_node_glows)
{
    struct fixture *fixture = *state;
    build_mixture(fixture);
    put_into_groups(fixture);
    fixture->request.tracing.tracer = TRACER_LDC;
    fixture->request.tracer_options.ldc.resolution = 64;
    fixture->request.light.integrator = INTEGRATOR_PATH;
    fixture->request.picture.layers = GROUPS;
    fixture_commit(fixture);
    fixture_expect_no_layers(fixture, "do not tell which node glows");
}

/* ---- what has no such layers ---- */

TEST(light_that_does_not_add_up_has_no_layers)
{
    struct fixture *fixture = *state;
    fixture_square(fixture, 1, 0, NULL);
    struct scene_edit *edit = fixture_edit(fixture, OBJECT_NODE);
    edit->kind = EDIT_SET_ENVIRONMENT;
    edit->set.environment.value.display_values = true;
    fixture_commit(fixture);
    fixture->request.picture.layers = ALL;
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    fixture_expect_no_layers(fixture, "the integrator whitted");
    fixture->request.light.integrator = INTEGRATOR_PATH;
    fixture_expect_no_layers(fixture, "a display's values");
    fixture->request.picture.view_source = VIEW_SOURCE_LAYERS;
    fixture_expect_no_layers(fixture, "depth layers");
}
