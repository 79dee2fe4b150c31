/* SPDX-License-Identifier: MIT */
/* Lights of every kind above a floor against closed forms; emissive triangles, which shadow rays ask for and rays
 * meet, against those that are met alone; and how much noise is left. A material with a mask that cuts nothing out
 * looks the same and is not sampled as a light, so both are compared in one program. */
#include "tests/accuracy/path_fixture.h"
#include "tests/fixtures/frame_hooks.h"

#include "scene/pose.h"
#include "shared/path.h"
#include "tests/harness/test.h"

#define HEIGHT 2.0f /* height of the lights above the floor */
#define HALF 0.5f   /* half the rectangle's edges, and the ball's radius */
#define VIEW 4.0f   /* metres of the floor that are seen */
/* A box filter's mean over a pixel of 1/8 m is not the value at its middle: a sixth of a quarter of the curvature,
 * of two dimensions; that of these forms is below 1 / HEIGHT^2 relative. */
#define PIXEL_CURVATURE (2.0 / 24.0 * (1.0 / 8.0) * (1.0 / 8.0) / (double)(HEIGHT * HEIGHT))

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static double whole(const struct frame_result *result)
{
    return mean_of_picture(result).value;
}

/* Looks down at the floor z = 0. A rectangle that gives no light keeps the default sky away, and all scenes to one
 * program. */
static struct scene_material *a_floor(struct fixture *fixture, float eye_height)
{
    struct scene_material *material = fixture_material(fixture);
    fixture_square(fixture, 50.0f, material->base.id, NULL);
    fixture_set_camera(fixture, 0.0f, 0.0f, eye_height, 0.0f);
    fixture->request.camera.ortho_height = VIEW;
    fixture_light(fixture, LIGHT_RECTANGLE, 0.0f, 0.0f, 9.0f, 0.0f);
    return material;
}

static void place_of(uint32_t pixel, double place[2])
{
    place[0] = ((pixel % EDGE + 0.5) / EDGE - 0.5) * (double)VIEW;
    place[1] = (0.5 - (pixel / EDGE + 0.5) / EDGE) * (double)VIEW;
}

/* A square that glows on both sides, and is black else. */
static struct scene_material *a_glow(struct fixture *fixture, float half, float radiance, bool sampled,
                                     const float place[12])
{
    struct scene_material *glow = fixture_material(fixture);
    for (int c = 0; c < 3; c++) {
        glow->value.base_colour[c] = 0.0f;
        glow->value.emission[c] = radiance;
    }
    glow->value.alpha_mode = sampled ? ALPHA_OPAQUE : ALPHA_MASK;
    fixture_square(fixture, half, glow->base.id, place);
    return glow;
}

/* ---- closed forms: irradiance by pi at a place of the floor ---- */

static double squared_to(const double place[2])
{
    return place[0] * place[0] + place[1] * place[1] + (double)(HEIGHT * HEIGHT);
}

static double below_a_point(const double place[2])
{
    return 7.0 / squared_to(place) * (double)HEIGHT / sqrt(squared_to(place)) / PI;
}

/* KHR_lights_punctual: between the cones the square of how far the cosine has come. */
static double below_a_spot(const double place[2])
{
    const double cosine = (double)HEIGHT / sqrt(squared_to(place));
    const double way = fmin(fmax((cosine - cos(0.6)) / (cos(0.2) - cos(0.6)), 0.0), 1.0);
    return below_a_point(place) * way * way;
}

static double below_a_direction(const double place[2])
{
    (void)place;
    return 3.0 * 0.8 / PI;
}

/* Lambert's sum over the edges, each the angle under which it is seen times how the plane through it stands to the
 * floor. */
static double below_a_rectangle(const double place[2])
{
    static const double corners[4][2] = {{-1, -1}, {-1, 1}, {1, 1}, {1, -1}};
    double sum = 0.0;
    for (int i = 0; i < 4; i++) {
        double a[3], b[3], across[3], dot = 0.0, length = 0.0, aa = 0.0, bb = 0.0;
        for (int k = 0; k < 2; k++) {
            a[k] = corners[i][k] * (double)HALF - place[k];
            b[k] = corners[(i + 1) % 4][k] * (double)HALF - place[k];
        }
        a[2] = b[2] = (double)HEIGHT;
        for (int k = 0; k < 3; k++) {
            across[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
            dot += a[k] * b[k];
            aa += a[k] * a[k];
            bb += b[k] * b[k];
            length += across[k] * across[k];
        }
        sum += acos(dot / sqrt(aa * bb)) * across[2] / sqrt(length);
    }
    return fabs(sum) / (2.0 * PI);
}

static double below_a_ball(const double place[2])
{
    return (double)(HALF * HALF) / squared_to(place) * (double)HEIGHT / sqrt(squared_to(place));
}

static double below_a_sky(const double place[2])
{
    (void)place;
    return 0.5;
}

/* ---- lights ---- */

enum kind { POINT, SPOT, DIRECTION, RECTANGLE, SPHERE, EMITTER, EMITTER_MET, SKY, KINDS };
static const struct row {
    const char *name;
    double (*form)(const double place[2]);
    bool has_no_size;
} rows[KINDS] = {[POINT] = {"point", below_a_point, true},
                 [SPOT] = {"spot", below_a_spot, true},
                 [DIRECTION] = {"direction", below_a_direction, true},
                 [RECTANGLE] = {"rectangle", below_a_rectangle, false},
                 [SPHERE] = {"sphere", below_a_ball, false},
                 [EMITTER] = {"triangles", below_a_rectangle, false},
                 [EMITTER_MET] = {"triangles met alone", below_a_rectangle, false},
                 [SKY] = {"sky", below_a_sky, false}};

static void add_light(struct fixture *fixture, enum kind kind)
{
    static const enum light_kind kinds[] = {LIGHT_POINT, LIGHT_SPOT, LIGHT_DIRECTIONAL, LIGHT_RECTANGLE,
                                            LIGHT_SPHERE};
    static const float powers[] = {7.0f, 7.0f, 3.0f, 1.0f, 1.0f};
    static const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, HEIGHT},
                       slant[12] = {0.8f, 0, 0.6f, 0, 0, 1, 0, 0, -0.6f, 0, 0.8f, 0};
    if (kind == SKY) {
        fixture_environment(fixture, 0.5f, 0.5f, 0.5f);
    } else if (kind >= EMITTER) {
        a_glow(fixture, HALF, 1.0f, kind == EMITTER, above);
    } else {
        struct scene_light *light = fixture_light(fixture, kinds[kind], 0.0f, 0.0f, HEIGHT, powers[kind]);
        light->value.size[0] = light->value.size[1] = kind == RECTANGLE ? 2.0f * HALF : HALF;
        light->value.inner_cone = 0.2f;
        light->value.outer_cone = 0.6f;
        if (kind == DIRECTION)
            memcpy(fixture->edits[fixture->edit_count - 1].set.node.value.parent_from_node, slant, sizeof(slant));
    }
}

static double (*closed_form)(const double place[2]);

/* Mean over the floor of what a pixel is above the closed form, relative. */
static double off_the_form(const struct frame_result *result)
{
    double sum = 0.0, expected = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        double place[2];
        place_of(i, place);
        sum += (double)fixture_pixel(result, i % EDGE, i / EDGE)[1];
        expected += closed_form(place);
    }
    return sum / expected - 1.0;
}

/* `depth` 0: shadow rays alone; 1: also rays that go on, which find the same light again. */
static void expect_form(struct fixture *fixture, enum kind kind, unsigned integrator, unsigned tracer,
                        uint32_t depth)
{
    path_begin(fixture, tracer, depth);
    a_floor(fixture, 1.0f);
    add_light(fixture, kind);
    fixture->request.light.integrator = integrator;
    fixture->request.light.layer_opacity = 1.0f;
    fixture->request.sampling.samples = 16;
    closed_form = rows[kind].form;
    struct mean mean = mean_of_seeds(fixture, off_the_form);
    print_message("%s, integrator %u, tracer %u, depth %u: off by %+.1e, standard error %.1e\n", rows[kind].name,
                  integrator, tracer, depth, mean.value, mean.error);
    /* A spot's rims curve more than the others: (1 / 0.4)^2 of a third of the floor, by the sum of pixels'
     * middles. */
    assert_mean(mean, 0.0, PIXEL_CURVATURE * (kind == SPOT ? 3.0 : 1.0) + 1e-4);
    assert_true(mean.error < (kind == EMITTER_MET ? 0.1 : 2e-3));
}

TEST(lights_of_every_kind_illuminate_a_floor_as_their_closed_forms_say)
{
    struct fixture *fixture = *state;
    for (enum kind kind = 0; kind < KINDS; kind++)
        expect_form(fixture, kind, INTEGRATOR_PATH, TRACER_BVH, 1);
    for (enum kind kind = 0; kind < KINDS; kind++) {
        if (!rows[kind].has_no_size)
            continue;
        path_begin(fixture, TRACER_BVH, 1);
        a_floor(fixture, 1.0f);
        add_light(fixture, kind);
        fixture->request.light.integrator = INTEGRATOR_WHITTED;
        struct frame_result result = fixture_render(fixture);
        for (uint32_t i = 0; i < PIXELS; i++) {
            double place[2];
            place_of(i, place);
            /* Light is gathered 8e-5 above the floor, which the cone of a spot makes six times as much of. */
            assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[0], rows[kind].form(place), 5e-4);
        }
        frame_result_finish(&result);
    }
}

TEST_LONG(all_integrators_and_ways_to_find_light_have_the_same_closed_forms)
{
    static const unsigned integrators[] = {INTEGRATOR_DISTRIBUTED, INTEGRATOR_WHITTED, INTEGRATOR_RAYCAST};
    for (enum kind kind = 0; kind < KINDS; kind++) {
        for (size_t i = 0; i < COUNT(integrators) && kind < (enum kind)EMITTER; i++)
            expect_form(*state, kind, integrators[i], TRACER_BVH, 1);
        if (kind != EMITTER && kind != EMITTER_MET) /* triangles are no lights of a path without bounces */
            expect_form(*state, kind, INTEGRATOR_PATH, TRACER_REFERENCE, 0);
    }
}

TEST(lights_are_visible_in_mirrors_and_not_directly)
{
    struct fixture *fixture = *state;
    for (enum kind kind = RECTANGLE; kind <= SPHERE; kind++) {
        path_begin(fixture, TRACER_BVH, 1);
        struct scene_material *mirror = a_floor(fixture, 5.0f); /* the light is between */
        mirror->value.metallic = 1.0f;
        mirror->value.roughness = 0.0f;
        add_light(fixture, kind);
        struct frame_result result = fixture_render(fixture);
        for (uint32_t i = 0; i < PIXELS; i++) {
            double place[2];
            place_of(i, place);
            bool under = kind == RECTANGLE ? fmax(fabs(place[0]), fabs(place[1])) < (double)HALF
                                           : hypot(place[0], place[1]) < (double)HALF;
            assert_near(fixture_pixel(&result, i % EDGE, i / EDGE)[1], under ? 1.0 : 0.0, 1e-5);
        }
        frame_result_finish(&result);
    }
}

/* A ball in the way of one light; a light that ends before the floor; and lights that do not go into one batch. */
TEST(lights_are_shadowed_end_at_their_range_and_come_in_batches)
{
    struct fixture *fixture = *state;
    fixture->request.tracing.tracer = TRACER_BVH;
    struct scene_material *material = a_floor(fixture, 5.0f);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 2.0f, 7.0f)->value.range = 1.5f;
    fixture_light(fixture, LIGHT_POINT, 6.0f, 0.0f, 4.0f, 20.0f);
    fixture_sphere(fixture, 3.0f, 0.0f, 2.0f, 0.5f,
                   material->base.id); /* from the light through it to the origin */
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 16, 16)[0], 0.0, 0.0);
    assert_true(fixture_pixel(&result, 16, 1)[0] > 0.01f);
    frame_result_finish(&result);
    fixture_clear(state);
    fixture->request.tracing.tracer = TRACER_BVH;
    a_floor(fixture, 5.0f);
    for (int i = 0; i < 23; i++)
        fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 0.25f);
    frame_renderer_set_capacity(fixture->renderer, 1024, 1024); /* a batch for each light */
    result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 9, 9)[2], 23 * 0.25 / PI, 1e-3);
    frame_result_finish(&result);
}

/* A roof of glass that neither bends nor mirrors takes a fifth, once. Light that was asked for came through it
 * already; the rays that go on must not bring it again. */
TEST_LONG(light_through_glass_is_not_counted_twice)
{
    struct fixture *fixture = *state;
    static const enum kind kinds[] = {RECTANGLE, SPHERE, SKY};
    for (size_t k = 0; k < COUNT(kinds); k++)
        for (int side = -1; side <= 1; side += 2) {
            const float z = (float)side, roof[12] = {1, 0, 0, 0, 0, z, 0, 0, 0, 0, z, 1.5f};
            path_begin(fixture, TRACER_REFERENCE, 4);
            a_floor(fixture, 1.0f);
            struct scene_material *glass = fixture_material(fixture);
            glass->value.transmission = 1.0f;
            glass->value.roughness = 0.0f;
            for (int c = 0; c < 3; c++)
                glass->value.base_colour[c] = 0.8f;
            fixture_square(fixture, 2000.0f, glass->base.id, roof);
            add_light(fixture, kinds[k]);
            fixture->request.sampling.samples = 16;
            closed_form = rows[kinds[k]].form;
            struct mean mean = mean_of_seeds(fixture, off_the_form);
            print_message("through glass, %s, side %d: %.5f (%.0e)\n", rows[kinds[k]].name, side, mean.value,
                          mean.error);
            /* The cube root of what a shadow ray lets through is in 1023 steps: half of one is off by this. */
            assert_mean(mean, -0.2, PIXEL_CURVATURE + 1e-4 + 1.5 / 1023 * pow(0.8, 2.0 / 3));
            assert_true(mean.error < 5e-3);
        }
}

/* ---- environments ---- */

enum { ROWS = 32, COLUMNS = 64 };

/* Makes a grey image of half floats with a sun of one texel. The floor's normal, +z, is the middle of the
 * edges of the image's columns. */
static void an_image(struct fixture *fixture, uint16_t grey, uint32_t u, uint32_t v, uint16_t sun)
{
    static uint16_t texels[ROWS][COLUMNS][4];
    for (uint32_t y = 0; y < ROWS; y++)
        for (uint32_t x = 0; x < COLUMNS; x++)
            for (int c = 0; c < 4; c++)
                texels[y][x][c] = y == v && x == u ? sun : grey;
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    struct scene_environment *environment = &fixture->edits[fixture->edit_count - 1].set.environment;
    environment->value.width = COLUMNS;
    environment->value.height = ROWS;
    environment->texels = fixture_blob(texels, sizeof(texels));
}

/* Irradiance by pi on a surface that looks along +z, of the image blended between its texels. */
static double under_the_image(double grey, uint32_t u, uint32_t v, double sun)
{
    enum { FINE = 16 };
    double sum = 0.0;
    for (int y = 0; y < ROWS * FINE; y++)
        for (int x = 0; x < COLUMNS * FINE; x++) {
            double theta = (y + 0.5) * PI / (ROWS * FINE), phi = ((x + 0.5) / (COLUMNS * FINE) - 0.5) * 2.0 * PI;
            double cosine = -sin(theta) * cos(phi); /* the image's middle is -z */
            double du = fabs((x + 0.5) / FINE - 0.5 - u), dv = fabs((y + 0.5) / FINE - 0.5 - v);
            double share = fmax(1.0 - fmin(du, COLUMNS - du), 0.0) * fmax(1.0 - dv, 0.0);
            if (cosine > 0.0)
                sum += (grey + (sun - grey) * share) * cosine * sin(theta) * PI / (ROWS * FINE) * 2.0 * PI /
                       (COLUMNS * FINE);
        }
    return sum / PI;
}

static double relative_deviation; /* deviation of a picture's pixels from the value that they should have */
static double expected_value;
static double deviation_and_mean(const struct frame_result *result)
{
    double squares = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        double off = (double)fixture_pixel(result, i % EDGE, i / EDGE)[1] / expected_value - 1.0;
        squares += off * off / PIXELS;
    }
    relative_deviation = fmax(relative_deviation, sqrt(squares));
    return whole(result) / expected_value - 1.0;
}

/* By a texel of 4096 among 0.125 the sun brings nearly all of the light, from a thousandth of the directions. */
TEST_LONG(a_small_bright_sun_of_an_image_is_found_with_little_noise)
{
    struct fixture *fixture = *state;
    enum { GREY = 0x3000, SUN = 0x6c00, SAMPLES = 16 };
    expected_value = under_the_image(0.125, 4, 12, 4096.0);
    path_begin(fixture, TRACER_BVH, 1);
    a_floor(fixture, 1.0f);
    an_image(fixture, GREY, 4, 12, SUN);
    fixture->request.sampling.samples = SAMPLES;
    relative_deviation = 0.0;
    struct mean mean = mean_of_seeds(fixture, deviation_and_mean);
    print_message("off by %+.1e (standard error %.0e), pixels by %.3f\n", mean.value, mean.error,
                  relative_deviation);
    assert_mean(mean, 0.0, 1e-3); /* the sum's own steps */
    /* Between texels radiance goes as a ramp, from all over half a cell to a half at its edge, and on to nothing
     * in the middle of the next, while a cell has one probability: three quarters of the samples have a mean
     * square of 28/27 and a quarter 8/3, of both ramps (13/9)^2. So one deviates by 1.04; the rest of the image
     * and the scatter of this measure, over 1024 pixels and 16 pictures, stay below a fifth. */
    assert_true(relative_deviation < 1.25 / sqrt(SAMPLES));
}

/* The sky of a scene without lights, without its sun: a floor that looks up sees its zenith's half. */
TEST_LONG(the_default_sky_brings_what_its_harmonics_say)
{
    struct fixture *fixture = *state;
    struct mean means[2];
    for (int path = 0; path < 2; path++) {
        const float level[12] = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0}; /* looks along +y */
        path_begin(fixture, TRACER_REFERENCE, 1);
        fixture_square(fixture, 50.0f, fixture_material(fixture)->base.id, level);
        fixture_set_camera(fixture, 0.0f, 5.0f, 0.0f, 0.0f);
        fixture->request.camera.ortho_height = VIEW;
        if (!path) /* its ambient term is the irradiance of the sky; the default light is in both */
            fixture->request.light.integrator = INTEGRATOR_WHITTED;
        fixture->request.sampling.samples = 16;
        means[path] = mean_of_seeds(fixture, whole);
    }
    /* Harmonics of order 2 leave out up to 1 % of an irradiance (Ramamoorthi and Hanrahan 2001). */
    assert_mean(means[1], means[0].value, 0.01 * means[0].value);
}

/* ---- emissive triangles ---- */

enum inside {
    PLAIN,
    TEXTURED,
    MANY,
    BESIDE_LIGHTS,
    GLASS,
    ROUGH_GLASS,
    VEIL,
    METAL,
    MIRRORED,
    FINE_MESH,
    INSIDES
};
static const char *const inside_names[] = {"plain",       "textured", "many",  "beside lights", "glass",
                                           "rough glass", "veil",     "metal", "uneven scale",  "fine mesh"};

static void facing_down(float x, float y, float z, float place[12])
{
    memcpy(place, (float[12]){1, 0, 0, x, 0, 0, -1, y, 0, 1, 0, z}, 12 * sizeof(float));
}

static void glow_by_a_texture(struct fixture *fixture, struct scene_material *material)
{
    enum { SIZE = 16 };
    static uint8_t texels[SIZE][SIZE][4];
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++)
            for (int c = 0; c < 4; c++)
                texels[y][x][c] = c == 3 || x > y + 2 ? 255 : c == 0 ? 40 : 0;
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->value.width = texture->value.height = SIZE;
    texture->value.format = TEXTURE_RGBA8_SRGB;
    texture->texels = fixture_blob(texels, sizeof(texels));
    material->textures[MATERIAL_EMISSION] = (struct record_texture_use){
        .texture = texture->base.id, .uv_transform = {1, 0, 0, 0, 1, 0}, .strength = 1.0f};
}

/* More triangles than leaves of the tree of lights, so that several make one; of many sizes. */
static void make_fine(struct scene_mesh *mesh)
{
    enum { CELLS = 160, EDGES = CELLS + 1 };
    float(*positions)[3] = calloc(EDGES * EDGES, sizeof(*positions));
    uint32_t(*indices)[3] = calloc(CELLS * CELLS * 2, sizeof(*indices));
    assert_true(positions && indices);
    for (uint32_t i = 0; i < EDGES * EDGES; i++) {
        const float u = (float)(i % EDGES) / CELLS, v = (float)(i / EDGES) / CELLS;
        positions[i][0] = 0.9f * (2.0f * u * u - 1.0f);
        positions[i][1] = 0.3f * (2.0f * v - 1.0f);
    }
    for (uint32_t i = 0; i < CELLS * CELLS; i++) {
        const uint32_t corner = i / CELLS * EDGES + i % CELLS;
        const uint32_t own[2][3] = {{corner, corner + 1, corner + EDGES},
                                    {corner + 1, corner + EDGES + 1, corner + EDGES}};
        memcpy(indices[2 * i], own, sizeof(own));
    }
    blob_unref(mesh->arrays[MESH_POSITIONS]);
    blob_unref(mesh->arrays[MESH_INDICES]);
    blob_unref(mesh->arrays[MESH_TEXCOORDS_0]);
    mesh->arrays[MESH_TEXCOORDS_0] = NULL;
    mesh->value.vertex_count = EDGES * EDGES;
    mesh->value.triangle_count = CELLS * CELLS * 2;
    mesh->arrays[MESH_POSITIONS] = fixture_blob(positions, EDGES * EDGES * sizeof(*positions));
    mesh->arrays[MESH_INDICES] = fixture_blob(indices, CELLS * CELLS * 2 * sizeof(*indices));
    mesh->ranges[0].count = mesh->value.triangle_count;
    free(positions);
    free(indices);
}

/* A 2 m box about the origin, open towards the eye, with a lamp below its ceiling. The last three edits are the
 * material, mesh and node of a lamp. */
static void a_box(struct fixture *fixture, enum inside inside, bool sampled)
{
    static const float walls[5][12] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1},  {0, 0, 1, -1, 1, 0, 0, 0, 0, 1, 0, 0},
        {0, 0, -1, 1, 1, 0, 0, 0, 0, -1, 0, 0}, {0, 1, 0, 0, 0, 0, 1, -1, 1, 0, 0, 0},
        {0, -1, 0, 0, 0, 0, -1, 1, 1, 0, 0, 0},
    };
    float place[12];
    struct scene_material *material = fixture_material(fixture);
    material->value.metallic = inside == METAL ? 1.0f : 0.0f;
    material->value.roughness = inside == METAL ? 0.3f : 0.6f;
    material->value.ior = 1.5f;
    for (int c = 0; c < 3; c++)
        material->value.base_colour[c] = 0.7f;
    for (int i = 0; i < 5; i++)
        fixture_square(fixture, 1.0f, material->base.id, walls[i]);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 9.0f, 0.0f);
    fixture_set_camera(fixture, 0.0f, 0.0f, 3.5f, 0.6f);
    if (inside == BESIDE_LIGHTS) {
        fixture_light(fixture, LIGHT_RECTANGLE, 0.4f, 0.0f, 0.9f, 5.0f);
        fixture_light(fixture, LIGHT_POINT, -0.5f, 0.3f, 0.5f, 0.3f);
    }
    if (inside >= GLASS && inside <= VEIL) {
        struct scene_material *pane = fixture_material(fixture);
        pane->value.ior = 1.5f;
        pane->value.base_colour[1] = 0.8f;
        pane->value.roughness = inside == GLASS ? 0.0f : 0.4f;
        pane->value.transmission = inside == VEIL ? 0.0f : 1.0f;
        pane->value.alpha_mode = inside == VEIL ? ALPHA_BLEND : ALPHA_OPAQUE;
        pane->value.base_colour[3] = inside == VEIL ? 0.4f : 1.0f;
        facing_down(0.0f, 0.5f, 0.0f, place);
        fixture_square(fixture, 0.6f, pane->base.id, place);
    }
    facing_down(0.1f, 0.9f, 0.0f, place);
    if (inside == MIRRORED)
        memcpy(place, (float[12]){-2, 0.3f, 0, 0.1f, 0, 0.2f, -1, 0.9f, 0.5f, 1, 0, 0}, sizeof(place));
    struct scene_material *glow = a_glow(fixture, 0.4f, 2.5f, sampled, place);
    if (inside == FINE_MESH)
        make_fine(&fixture->edits[fixture->edit_count - 2].set.mesh);
    if (inside == TEXTURED)
        glow_by_a_texture(fixture, glow);
    for (int i = 0; i < 6 && inside == MANY; i++) {
        facing_down(0.7f * cosf((float)i), 0.2f * (float)i - 0.6f, 0.7f * sinf((float)i), place);
        a_glow(fixture, 0.03f, 10.0f * (float)(i + 1), sampled, place);
    }
}

/* Rays that meet the lamp alone get three times as many samples. `off`: the share that both may differ by. */
static void expect_as_met(struct fixture *fixture, enum inside inside, unsigned tracer, double off)
{
    struct mean means[2];
    for (int sampled = 0; sampled < 2; sampled++) {
        path_begin(fixture, tracer, 3);
        fixture->request.tracer_options.ldc.resolution = 256;
        a_box(fixture, inside, sampled);
        fixture->request.sampling.samples = sampled ? 4 : 12;
        means[sampled] = mean_of_seeds(fixture, whole);
    }
    print_message("%s, tracer %u: met alone %.5f (%.0e), sampled %.5f (%.0e) of a third of the samples\n",
                  inside_names[inside], tracer, means[0].value, means[0].error, means[1].value, means[1].error);
    assert_mean(means[1], means[0].value, 5.0 * means[0].error + off * means[0].value);
    assert_true(means[0].error < 0.03 * means[0].value && means[1].error < 0.03 * means[1].value);
}

TEST_LONG(triangles_light_a_box_as_rays_that_meet_them_alone_do)
{
    struct fixture *fixture = *state;
    for (enum inside inside = 0; inside < INSIDES;
         inside++) /* rays see a texture filtered, shadow rays see its texels */
        expect_as_met(fixture, inside, TRACER_BVH, inside == TEXTURED ? 0.02 : 0.0);
    /* Stored samples lie up to a cell or so off the surfaces, and off lights as well. */
    expect_as_met(fixture, PLAIN, TRACER_LDC, 0.02);
    expect_as_met(fixture, VEIL, TRACER_LDC, 0.02);
}

/* The tree of lights of one scene that is edited is as good as that of a new one. */
TEST(a_lamp_that_moves_or_is_switched_lights_from_where_it_is)
{
    struct fixture *fixture = *state;
    struct mean means[2];
    float place[12];
    facing_down(0.4f, 0.3f, 0.2f, place);
    for (int edited = 0; edited < 2; edited++) {
        path_begin(fixture, TRACER_BVH, 2);
        a_box(fixture, MANY, true);
        fixture->request.sampling.samples = 4;
        if (edited) {
            struct frame_result before = fixture_render(fixture);
            frame_result_finish(&before);
        }
        const uint32_t last = fixture->next_id - 1; /* its node; its mesh and material are before */
        if (edited) {
            struct scene_edit *edit = fixture_edit(fixture, OBJECT_NODE);
            edit->set.node = *scene_node(fixture->scene, last);
            edit->set.node.weights = NULL;
            memcpy(edit->set.node.value.parent_from_node, place, sizeof(place));
            struct scene_material *material = &fixture_edit(fixture, OBJECT_MATERIAL)->set.material;
            *material = *scene_material(fixture->scene, last - 2);
            material->value.emission[1] = 20.0f;
        } else {
            memcpy(fixture->edits[fixture->edit_count - 1].set.node.value.parent_from_node, place, sizeof(place));
            fixture->edits[fixture->edit_count - 3].set.material.value.emission[1] = 20.0f;
        }
        means[edited] = mean_of_seeds(fixture, whole);
    }
    print_message("new %.5f (%.0e), edited %.5f (%.0e)\n", means[0].value, means[0].error, means[1].value,
                  means[1].error);
    assert_mean(means[1], means[0].value, 5.0 * means[0].error);
    assert_true(means[1].error < 2.0 * means[0].error);
}

/* A lamp that crosses the box while the shutter is open, and casts light from where it is at each ray's time. */
TEST_LONG(a_lamp_lights_along_its_way_while_the_shutter_is_open)
{
    struct fixture *fixture = *state;
    static const unsigned tracers[] = {TRACER_REFERENCE, TRACER_BVH};
    struct mean means[2];
    for (int sampled = 0; sampled < 2; sampled++) {
        path_begin(fixture, tracers[sampled], 2);
        a_box(fixture, PLAIN, sampled);
        fixture->request.sampling.samples = sampled ? 8 : 32;
        struct pose_node open = {.node = fixture->next_id - 1}, close = open;
        facing_down(-0.7f, 0.5f, 0.0f, open.parent_from_node);
        facing_down(0.7f, 0.5f, 0.5f, close.parent_from_node);
        struct scene_pose poses[] = {{.nodes = &open, .node_count = 1}, {.nodes = &close, .node_count = 1}};
        const struct scene_motion motion = {.poses = poses, .pose_count = 2};
        double values[SEEDS];
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            fixture->request.sampling.seed = seed;
            struct frame_result result = fixture_render_motion(fixture, &motion);
            values[seed] = whole(&result);
            frame_result_finish(&result);
        }
        means[sampled] = mean_of(values, SEEDS);
    }
    assert_mean(means[1], means[0].value, 5.0 * means[0].error);
    assert_true(means[1].error < 0.02 * means[1].value);
}

/* The random numbers are the same, and so is what does not come from the panel, but for roundings. */
TEST(emission_that_is_seen_only_shows_in_mirrors_and_lights_nothing)
{
    struct fixture *fixture = *state;
    const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 1.0f};
    for (int integrator = 0; integrator < (getenv("FARLIGHT_TEST_LONG") ? 2 : 1); integrator++)
        for (int mirror = 0; mirror < 2; mirror++) {
            double means[3]; /* dark, seen only, glowing */
            for (int i = 0; i < 3; i++) {
                path_begin(fixture, TRACER_BVH, 3);
                fixture->request.light.integrator = integrator ? INTEGRATOR_DISTRIBUTED : INTEGRATOR_PATH;
                struct scene_material *floor = a_floor(fixture, 0.5f);
                floor->value.metallic = (float)mirror;
                floor->value.roughness = 1.0f - (float)mirror;
                fixture->request.camera.ortho_height = 0.5f;
                fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 0.9f, 1.0f);
                struct scene_material *glow = a_glow(fixture, 1.0f, i == 0 ? 0.0f : 2.0f, true, above);
                glow->value.emission_seen_only = i == 1;
                fixture->request.sampling.samples = 4;
                struct frame_result result = fixture_render(fixture);
                means[i] = whole(&result);
                frame_result_finish(&result);
            }
            print_message("dark %.5f, seen only %.5f, glowing %.5f\n", means[0], means[1], means[2]);
            assert_near(means[1], mirror ? means[0] + 2.0 : means[0], 1e-4 * means[1]);
            assert_true(means[2] > means[0] + 0.5); /* a panel of this size above a white floor, at least */
        }
}

/* The default sky is for scenes without light. */
TEST(a_scene_that_a_lamp_lights_has_no_sky_where_lamps_are_lights)
{
    struct fixture *fixture = *state;
    static const struct {
        unsigned integrator;
        float radiance;
        bool sky;
    } cases[] = {{INTEGRATOR_PATH, 2.0f, false},
                 {INTEGRATOR_PATH, 1.0f, true},
                 {INTEGRATOR_DISTRIBUTED, 2.0f, false},
                 {INTEGRATOR_DISTRIBUTED, 1.0f, true},
                 {INTEGRATOR_WHITTED, 2.0f, true}};
    float place[12];
    facing_down(0.0f, 0.0f, 0.0f, place);
    for (size_t i = 0; i < (getenv("FARLIGHT_TEST_LONG") ? COUNT(cases) : 2); i++) {
        path_begin(fixture, TRACER_BVH, 2);
        fixture->request.light.integrator = cases[i].integrator;
        a_glow(fixture, 0.1f, cases[i].radiance, true, place);
        fixture_set_camera(fixture, 0.0f, 0.0f, 3.5f, 0.6f);
        struct frame_result result = fixture_render(fixture);
        const float *corner = fixture_pixel(&result, 0, 0);
        if ((corner[1] > 0.0f) != cases[i].sky)
            fail_msg("integrator %u, a lamp of %g: behind it is %g", cases[i].integrator,
                     (double)cases[i].radiance, (double)corner[1]);
        frame_result_finish(&result);
    }
}

/* ---- rough mirrors of lights, by path and by distributed ---- */

enum mirrored {
    LAMP,
    LAMP_MET,
    LAMP_BEHIND_VEIL,
    LAMP_BEHIND_GLASS,
    LAMP_BESIDE_LIGHTS,
    RECTANGLE_LIGHT,
    SUN,
    SUN_BESIDE_LIGHTS
};

/* A floor seen at a slant, so that the image of what is above it is in the picture. */
static void a_rough_mirror(struct fixture *fixture, unsigned integrator, enum mirrored what, float half,
                           const float look[3])
{
    static const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, HEIGHT},
                       below[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.5f};
    path_begin(fixture, TRACER_BVH, what == LAMP_BEHIND_GLASS ? 2 : 1);
    fixture->request.light.integrator = integrator;
    struct scene_material *floor = a_floor(fixture, 1.0f);
    floor->value.roughness = look[0];
    floor->value.metallic = look[1];
    floor->value.anisotropy = look[2];
    floor->value.anisotropy_rotation = 0.5f;
    floor->value.ior = 1.5f;
    fixture_set_camera(fixture, 1.5f, -1.5f, 1.2f, 0.8f);
    if (what >= SUN)
        an_image(fixture, 0x2c00, 3, 13, 0x6400); /* 1/16 and 1024 */
    if (what == RECTANGLE_LIGHT)
        add_light(fixture, RECTANGLE);
    else if (what != SUN)
        a_glow(fixture, half, 1.0f, what != LAMP_MET, above);
    if (what == LAMP_BESIDE_LIGHTS || what == SUN_BESIDE_LIGHTS)
        fixture_light(fixture, LIGHT_POINT, -0.5f, 0.3f, 1.5f, 0.3f);
    if (what == LAMP_BEHIND_VEIL || what == LAMP_BEHIND_GLASS) {
        struct scene_material *pane = fixture_material(fixture);
        pane->value.roughness = 0.0f;
        pane->value.base_colour[1] = 0.8f;
        pane->value.base_colour[3] = 0.4f;
        pane->value.transmission = what == LAMP_BEHIND_GLASS ? 1.0f : 0.0f;
        pane->value.alpha_mode = what == LAMP_BEHIND_GLASS ? ALPHA_OPAQUE : ALPHA_BLEND;
        fixture_square(fixture, 5.0f, pane->base.id, below);
    }
}

/* Roughness, metallic, anisotropy. Path with either brdf and distributed; shadow rays alone, rays that meet the
 * lamp alone, and both. */
TEST_LONG(rough_mirrors_show_as_much_of_lights_however_they_are_found)
{
    struct fixture *fixture = *state;
    static const struct {
        enum mirrored what;
        float look[3];
    } cases[] = {{LAMP, {0.15f, 1, 0}},
                 {LAMP, {1, 1, 0}},
                 {LAMP, {0.3f, 0, 0}},
                 {LAMP, {0.8f, 0.5f, 0.3f}},
                 {LAMP, {0.5f, 1, 0.7f}},
                 {LAMP_BEHIND_VEIL, {0.3f, 1, 0}},
                 {LAMP_BEHIND_GLASS, {0.3f, 1, 0}},
                 {LAMP_BESIDE_LIGHTS, {0.3f, 0.5f, 0}},
                 {RECTANGLE_LIGHT, {0.1f, 0, 0}},
                 {RECTANGLE_LIGHT, {0.4f, 0.5f, 0.3f}},
                 {SUN, {0.3f, 1, 0}},
                 {SUN, {0.7f, 1, 0}},
                 {SUN_BESIDE_LIGHTS, {0.4f, 1, 0}}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        enum { BY_PATH, BY_DISTRIBUTED, MET, DECLARED, WAYS };
        struct mean ways[WAYS];
        const size_t way_count = cases[i].what == LAMP ? WAYS : 2;
        for (size_t way = 0; way < way_count; way++) {
            a_rough_mirror(fixture, way == BY_DISTRIBUTED ? INTEGRATOR_DISTRIBUTED : INTEGRATOR_PATH,
                           way == MET        ? LAMP_MET
                           : way == DECLARED ? RECTANGLE_LIGHT
                                             : cases[i].what,
                           HALF, cases[i].look);
            fixture->request.sampling.samples = way == MET ? 32 : 16;
            ways[way] = mean_of_seeds(fixture, whole);
        }
        for (size_t way = 0; way < way_count; way++) {
            print_message("case %zu, way %zu: %.5f (%.0e)\n", i, way, ways[way].value, ways[way].error);
            /* Facets mirror more than once by the same polynomials in both, which distributed chooses differently.
             */
            assert_mean(ways[way], ways[BY_PATH].value,
                        5.0 * ways[BY_PATH].error + (way == BY_DISTRIBUTED ? 2e-3 * ways[BY_PATH].value : 0.0));
            assert_true(ways[way].error < 0.02 * ways[way].value);
        }
    }
}

/* ---- noise ---- */

/* The root of the mean squared error, by the mean; a lamp's own pixels, whose rims are noisy however it is
 * sampled, left out. */
static double error_of(const float *pixels, const float *truth, float maximum)
{
    double squares = 0.0, sum = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        const double error = truth[i] < maximum ? (double)pixels[i] - (double)truth[i] : 0.0;
        squares += error * error;
        sum += (double)truth[i];
    }
    return sqrt(squares / PIXELS) / (sum / PIXELS);
}

TEST_LONG(lamps_that_are_sampled_have_less_noise)
{
    struct fixture *fixture = *state;
    static const struct {
        enum inside inside;
        double times; /* a half of what was measured, or less */
    } cases[] = {{PLAIN, 1.4}, {MANY, 2.0}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        float *pictures[3]; /* met alone; sampled; the truth */
        for (int k = 0; k < 3; k++) {
            path_begin(fixture, TRACER_BVH, 3);
            a_box(fixture, cases[i].inside, k > 0);
            pictures[k] = path_render_pixels(fixture, k < 2 ? 64 : 256, k < 2 ? 1 : 77);
        }
        const double before = error_of(pictures[0], pictures[2], 1.0f),
                     after = error_of(pictures[1], pictures[2], 1.0f);
        print_message("%s: error %.3f met alone, %.3f sampled\n", inside_names[cases[i].inside], before, after);
        assert_true(after * cases[i].times < before);
        for (int k = 0; k < 3; k++)
            free(pictures[k]);
    }
}

TEST_LONG(rough_metal_shows_no_specks_of_lamps_and_the_sun)
{
    struct fixture *fixture = *state;
    static const float look[3] = {0.3f, 1.0f, 0.0f};
    for (int sun = 0; sun < 2; sun++) {
        float *pictures[3]; /* both ways; the truth; met alone */
        for (int k = 0; k < 3 - sun; k++) {
            a_rough_mirror(fixture, k == 1 ? INTEGRATOR_PATH : INTEGRATOR_DISTRIBUTED,
                           sun      ? SUN
                           : k == 2 ? LAMP_MET
                                    : LAMP,
                           0.05f, look);
            pictures[k] = path_render_pixels(fixture, k == 1 ? 1024 : 16, k == 1 ? 9 : 1);
        }
        const double both = error_of(pictures[0], pictures[1], INFINITY);
        print_message("error of 16 samples, by the mean: %.4f\n", both);
        /* By its table 16 samples of a sun's texel, blended with its neighbours', have an error of 1.04 /
         * sqrt(16): by the picture's mean twice that, as it is mirrored in a quarter of it. A lamp: a third of
         * what was measured. */
        assert_true(both < (sun ? 0.8 : error_of(pictures[2], pictures[1], INFINITY) / 20.0));
        for (int k = 0; k < 3 - sun; k++)
            free(pictures[k]);
    }
}

/* A dielectric mirrors a small share of what is bright: light that is found by chance is a speck. */
TEST(what_dielectrics_mirror_of_bright_lights_makes_no_specks)
{
    struct fixture *fixture = *state;
    static const struct {
        enum mirrored what;
        float look[3];
        double error; /* a quarter more than was measured */
    } cases[] = {{RECTANGLE_LIGHT, {0.1f, 0, 0}, 0.08},
                 {SUN_BESIDE_LIGHTS, {0.9f, 0, 0}, 0.021},
                 {SUN, {0.1f, 0, 0}, 0.01}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        float *pictures[2];
        for (int k = 0; k < 2; k++) {
            a_rough_mirror(fixture, INTEGRATOR_DISTRIBUTED, cases[i].what, HALF, cases[i].look);
            pictures[k] = path_render_pixels(fixture, k ? 256 : 16, (uint64_t)k);
        }
        const double error = error_of(pictures[0], pictures[1], INFINITY);
        print_message("case %zu: error of 16 samples, by the mean: %.4f\n", i, error);
        assert_true(error < cases[i].error);
        free(pictures[0]);
        free(pictures[1]);
    }
}

/* Directions that are uniform in what the two triangles of a panel take of the half-space bring each sample twice
 * its cosine, whose standard deviation is 1 / sqrt(3); points that are uniform on 4 square metres at 0.1 m, whose
 * mean square is 4 / (3 pi 0.1^2), eleven times as much. */
TEST_LONG(a_panel_close_above_a_floor_has_little_noise)
{
    enum { SAMPLES = 16 };
    struct fixture *fixture = *state;
    const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0.1f};
    path_begin(fixture, TRACER_BVH, 1);
    a_floor(fixture, 0.05f);
    a_glow(fixture, 1.0f, 1.0f, true, above);
    fixture->request.camera.ortho_height = 0.5f;
    fixture->request.light.integrator = INTEGRATOR_DISTRIBUTED; /* shadow rays alone find it */
    float *one = path_render_pixels(fixture, SAMPLES, 1), *other = path_render_pixels(fixture, SAMPLES, 2);
    double mean = 0.0, squares = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        mean += (double)(one[i] + other[i]) / (2.0 * PIXELS);
        squares += (double)(one[i] - other[i]) * (double)(one[i] - other[i]) / (2.0 * PIXELS);
    }
    print_message("mean %.4f, standard deviation of a pixel %.3f\n", mean, sqrt(squares));
    free(one);
    free(other);
    assert_near(mean, 0.9919, 0.002); /* the form factor of a square seen from 0.1 m below its centre */
    assert_true(sqrt(squares) < 1.0 / sqrt(3.0 * SAMPLES));
}
