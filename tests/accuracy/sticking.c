/* SPDX-License-Identifier: MIT */
/* How much of each pixel follows the eye, by what the material there is. */
#include "tests/accuracy/render_fixture.h"
#include "tests/harness/test.h"

#define WIDTH 256u
#define HEIGHT 64u
#define FOV_Y 0.6f
#define EYE_Z 5.0
#define RADIUS 0.8
#define BASE 0.5 /* base colour of the scattering surfaces */

enum body { MIRROR, GLASS, ROUGH, PLASTIC, VEIL, BODIES };
static const double places[BODIES] = {-4, -2, 0, 2, 4}; /* along x */
static const float light_place[3] = {3.0f, 1.0f, 3.0f};

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static void add_body(struct fixture *fixture, enum body body)
{
    struct scene_material *material = fixture_material(fixture);
    const bool scatters = body >= ROUGH;
    material->value.metallic = body == MIRROR;
    material->value.transmission = body == GLASS;
    material->value.roughness = body == ROUGH || body == VEIL ? 1.0f : body == PLASTIC ? 0.1f : 0.0f;
    material->value.ior = 1.5f;
    for (int i = 0; scatters && i < 3; i++)
        material->value.base_colour[i] = (float)BASE;
    if (body == VEIL) {
        material->value.alpha_mode = ALPHA_BLEND;
        material->value.base_colour[3] = 0.4f;
    }
    fixture_sphere(fixture, (float)places[body], 0.0f, 0.0f, (float)RADIUS, material->base.id);
}

static void set_up(struct fixture *fixture, float power)
{
    for (enum body body = 0; body < BODIES; body++)
        add_body(fixture, body);
    fixture_environment(fixture, 0.2f, 0.2f, 0.2f);
    if (power > 0)
        fixture_light(fixture, LIGHT_POINT, light_place[0], light_place[1], light_place[2], power);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.picture.width = WIDTH;
    fixture->request.picture.height = HEIGHT;
    fixture->request.attachments = 1u << ATTACHMENT_STICKING;
    fixture_set_camera(fixture, 0.0f, 0.0f, (float)EYE_Z, FOV_Y);
    fixture_commit(fixture);
}

/* Where the ray through a pixel's middle meets a body; false: it does not. */
static bool meet(uint32_t x, uint32_t y, enum body *body, double place[3])
{
    const double pixel = 2 * tan((double)FOV_Y / 2) / HEIGHT;
    const double d[3] = {(x + 0.5 - WIDTH / 2.0) * pixel, (HEIGHT / 2.0 - y - 0.5) * pixel, -1};
    for (*body = 0; *body < BODIES; (*body)++) {
        const double o[3] = {-places[*body], 0, EYE_Z};
        const double a = d[0] * d[0] + d[1] * d[1] + 1, b = o[0] * d[0] + o[1] * d[1] + o[2] * d[2];
        const double c = o[0] * o[0] + o[2] * o[2] - RADIUS * RADIUS, root = b * b - a * c;
        /* Not the outline, where a ray of floats may hit or miss. */
        if (root > 0.01) {
            const double t = (-b - sqrt(root)) / a;
            for (int k = 0; k < 3; k++)
                place[k] = o[k] + t * d[k];
            return true;
        }
    }
    return false;
}

static uint8_t share_at(const struct frame_result *result, uint32_t x, uint32_t y)
{
    return frame_result_attachment(result, ATTACHMENT_STICKING)[4 * (y * WIDTH + x)];
}

/* Calls `expect` for each pixel of a body. */
static void each_pixel(const struct frame_result *result,
                       void (*expect)(enum body body, const double normal[3], uint8_t share))
{
    uint32_t counts[BODIES] = {0};
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        enum body body;
        double place[3];
        /* The first of four pixels stands for all of them. */
        if (!meet(i % WIDTH & ~1u, i / WIDTH & ~1u, &body, place))
            continue;
        for (int k = 0; k < 3; k++)
            place[k] /= RADIUS;
        expect(body, place, share_at(result, i % WIDTH, i / WIDTH));
        counts[body]++;
    }
    for (enum body body = 0; body < BODIES; body++)
        assert_true(counts[body] > 200);
}

/* Mirrored and refracted light is all that a metal and clear glass send, so all of it follows the eye. As rough as
 * can be, a surface sends no mirror ray, and nothing does; a veil of it lets 0.6 through of what lies behind. Half
 * a level is lost to 8 bits. */
static void expect_by_material(enum body body, const double normal[3], uint8_t share)
{
    (void)normal;
    if (body == MIRROR || body == GLASS)
        assert_true(share >= 254);
    if (body == ROUGH)
        assert_int_equal(share, 0);
    if (body == VEIL)
        assert_near(share, 0.6 * 255, 1.0);
}

TEST(mirror_and_glass_stick_and_a_rough_body_does_not)
{
    static const enum integrator_kind kinds[] = {INTEGRATOR_WHITTED, INTEGRATOR_DISTRIBUTED, INTEGRATOR_PATH};
    const size_t count = getenv("FARLIGHT_TEST_LONG") ? sizeof(kinds) / sizeof(kinds[0]) : 1;
    struct fixture *fixture = *state;
    set_up(fixture, 20.0f);
    for (size_t i = 0; i < count; i++) {
        fixture->request.light.integrator = kinds[i];
        fixture->request.sampling.samples = 1 + 3 * (i == 2); /* a mean of samples, too */
        struct frame_result result = fixture_render(fixture);
        if (fixture->request.sampling.samples == 1)
            each_pixel(&result, expect_by_material);
        assert_true(share_at(&result, WIDTH / 2, 1) == 0 && share_at(&result, 0, 0) == 0); /* the environment */
        assert_true(share_at(&result, 45, HEIGHT / 2) >= 254 && share_at(&result, WIDTH / 2, HEIGHT / 2) == 0);
        frame_result_finish(&result);
    }
}

/* Cosine between the normal of a place of the plastic and the direction to the eye. */
static double cosine_of(const double normal[3])
{
    const double to_eye[3] = {-places[PLASTIC] - RADIUS * normal[0], -RADIUS * normal[1],
                              EYE_Z - RADIUS * normal[2]};
    double cosine = 0, length = 0;
    for (int k = 0; k < 3; k++) {
        cosine += to_eye[k] * normal[k];
        length += to_eye[k] * to_eye[k];
    }
    return cosine / sqrt(length);
}

/* In even light a dielectric mirrors what Fresnel's equations say, and scatters the base colour's share of the
 * rest. The model lowers the cosine by half the square of the roughness, which is felt where Fresnel's curve is
 * steep: by less than 2 % of the share up to 72 degrees. */
static void expect_even(const double normal[3], uint8_t share)
{
    const double cosine = cosine_of(normal), bent = sqrt(1 - (1 - cosine * cosine) / (1.5 * 1.5));
    const double across = (cosine - 1.5 * bent) / (cosine + 1.5 * bent);
    const double along = (1.5 * cosine - bent) / (1.5 * cosine + bent);
    const double mirrored = (across * across + along * along) / 2;
    if (cosine > 0.3)
        assert_near(share, 255 * mirrored / (mirrored + BASE * (1 - mirrored)), 0.6 + 0.02 * 255);
}

static void expect_fresnel(enum body body, const double normal[3], uint8_t share)
{
    if (body == PLASTIC)
        expect_even(normal, share);
}

TEST(in_even_light_a_dielectric_sticks_by_what_it_mirrors)
{
    struct fixture *fixture = *state;
    set_up(fixture, 0.0f);
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    struct frame_result result = fixture_render(fixture);
    each_pixel(&result, expect_fresnel);
    frame_result_finish(&result);
}

/* The angle between a normal of the plastic and that which mirrors the light to the eye; degrees. */
static double off_highlight(const double normal[3])
{
    double to_eye[3], to_light[3], half[3], lengths[3] = {0}, cosine = 0;
    for (int k = 0; k < 3; k++) {
        const double place = RADIUS * normal[k] + (k == 0 ? places[PLASTIC] : 0);
        to_eye[k] = (k == 2 ? EYE_Z : 0) - place;
        to_light[k] = (double)light_place[k] - place;
        lengths[0] += to_eye[k] * to_eye[k];
        lengths[1] += to_light[k] * to_light[k];
    }
    for (int k = 0; k < 3; k++) {
        half[k] = to_eye[k] / sqrt(lengths[0]) + to_light[k] / sqrt(lengths[1]);
        lengths[2] += half[k] * half[k];
        cosine += half[k] * normal[k];
    }
    return acos(fmin(cosine / sqrt(lengths[2]), 1)) * 180 / 3.14159265358979;
}

/* A roughness of 0.1 is an alpha of 0.01, 0.6 degrees: some degrees off, the highlight is less than what is
 * scattered, and 20 degrees off GGX has fallen to a millionth, so that it is as in even light. A pixel is 3.5
 * degrees of the body wide, and every other one is looked at: the nearest may be 5 off, across the corner. */
static uint8_t brightest;
static double brightest_off;

static void expect_highlight(enum body body, const double normal[3], uint8_t share)
{
    if (body != PLASTIC || cosine_of(normal) < 0.5)
        return;
    const double off = off_highlight(normal);
    if (share > brightest) {
        brightest = share;
        brightest_off = off;
    }
    if (off > 20)
        expect_even(normal, share);
}

TEST(a_highlight_sticks)
{
    struct fixture *fixture = *state;
    set_up(fixture, 20.0f);
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    struct frame_result result = fixture_render(fixture);
    brightest = 0;
    each_pixel(&result, expect_highlight);
    assert_true(brightest > 128 && brightest_off < 5);
    frame_result_finish(&result);
}

TEST_LONG(nothing_sticks_where_no_ray_leaves_the_straight_way)
{
    static const enum integrator_kind kinds[] = {INTEGRATOR_RAYCAST, INTEGRATOR_AO};
    struct fixture *fixture = *state;
    set_up(fixture, 20.0f);
    for (size_t i = 0; i < sizeof(kinds) / sizeof(kinds[0]); i++) {
        fixture->request.light.integrator = kinds[i];
        struct frame_result result = fixture_render(fixture);
        for (uint32_t k = 0; k < WIDTH * HEIGHT; k++)
            assert_int_equal(share_at(&result, k % WIDTH, k / WIDTH), 0);
        frame_result_finish(&result);
    }
}

TEST(it_is_the_same_beside_other_attachments)
{
    struct fixture *fixture = *state;
    set_up(fixture, 20.0f);
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    struct frame_result alone = fixture_render(fixture);
    fixture->request.attachments |= 1u << ATTACHMENT_DEPTH | 1u << ATTACHMENT_NORMALS;
    struct frame_result beside = fixture_render(fixture);
    assert_memory_equal(frame_result_attachment(&alone, ATTACHMENT_STICKING),
                        frame_result_attachment(&beside, ATTACHMENT_STICKING), 4 * WIDTH * HEIGHT);
    assert_memory_equal(alone.pixels, beside.pixels, alone.size_bytes);
    float depth;
    memcpy(&depth, frame_result_attachment(&beside, ATTACHMENT_DEPTH) + 4 * (HEIGHT / 2 * WIDTH + WIDTH / 2),
           sizeof(depth));
    assert_near(depth, EYE_Z - RADIUS, 1e-3); /* the middle of the middle body, half a pixel off */
    frame_result_finish(&alone);
    frame_result_finish(&beside);
}
