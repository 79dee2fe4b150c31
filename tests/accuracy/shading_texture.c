/* SPDX-License-Identifier: MIT */
/* Textures as inputs of a material, and the turn of the environment. */
#include "tests/accuracy/render_fixture.h"
#include "tests/harness/test.h"

#define PI 3.14159265358979

static struct record_texture_use one_texture(struct fixture *fixture, uint32_t width, uint32_t height,
                                             const uint8_t *texels, float strength)
{
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->value.width = width;
    texture->value.height = height;
    texture->value.format = TEXTURE_RGBA8_LINEAR;
    texture->texels = fixture_blob(texels, (size_t)width * height * 4);
    return (struct record_texture_use){
        .texture = texture->base.id, .uv_transform = {1, 0, 0, 0, 1, 0}, .strength = strength};
}

/* An irradiance of pi from the direction (x, y, 1) / length. */
static void light_from(struct fixture *fixture, float x, float y)
{
    const float eye[3] = {x, y, 1.0f}, target[3] = {0}, up[3] = {0.1f, 1.0f, 0.3f};
    struct frame_camera camera; /* a camera looks along -z as a light shines */
    assert_true(frame_camera_look_at(&camera, eye, target, up, 1.0f));
    struct scene_light *light = &fixture_edit(fixture, OBJECT_LIGHT)->set.light;
    light->base.id = fixture->next_id++;
    light->value.kind = LIGHT_DIRECTIONAL;
    light->value.colour[0] = light->value.colour[1] = light->value.colour[2] = (float)PI;
    fixture_node(fixture, NODE_LIGHT, light->base.id, camera.world_from_view);
}

static float render_middle(struct fixture *fixture)
{
    struct frame_result result = fixture_render(fixture);
    float value = fixture_pixel(&result, 16, 16)[0];
    frame_result_finish(&result);
    return value;
}

/* KHR_texture_transform: the image turned by so many radians, and scaled. */
static void turn_slot(struct record_texture_use *use, double angle, double scale_u, double scale_v)
{
    const float rows[6] = {(float)(cos(angle) * scale_u),  (float)(sin(angle) * scale_v), 0.0f,
                           (float)(-sin(angle) * scale_u), (float)(cos(angle) * scale_v), 0.0f};
    memcpy(use->uv_transform, rows, sizeof(rows));
}

static float render_placed_normal_map(struct fixture *fixture, uint8_t red, uint8_t green, const double place[3],
                                      float light_x, float light_y)
{
    fixture_clear((void **)&fixture);
    const uint8_t texel[4] = {red, green, 218, 255};
    struct record_texture_use use = one_texture(fixture, 1, 1, texel, 1.0f);
    turn_slot(&use, place[0], place[1], place[2]);
    struct scene_material *material = fixture_material(fixture);
    material->textures[MATERIAL_NORMAL] = use;
    fixture_square(fixture, 1.0f, material->base.id, NULL);
    light_from(fixture, light_x, light_y);
    return render_middle(fixture);
}

static float render_normal_map(struct fixture *fixture, uint8_t red, uint8_t green, float light_x, float light_y)
{
    static const double as_it_is[3] = {0, 1, 1};
    return render_placed_normal_map(fixture, red, green, as_it_is, light_x, light_y);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(a_normal_map_tilts_red_to_the_right_and_green_up)
{
    /* 218, 128, 218 is 45 degrees within half a degree */
    assert_near(render_normal_map(*state, 218, 128, 0.0f, 0.0f), sqrt(0.5), 0.01);
    assert_near(render_normal_map(*state, 218, 128, 1.0f, 0.0f), 1.0, 0.01);
    assert_near(render_normal_map(*state, 218, 128, -1.0f, 0.0f), 0.0, 0.01);
    assert_near(render_normal_map(*state, 128, 218, 0.0f, 1.0f), 1.0, 0.01);
    assert_near(render_normal_map(*state, 128, 218, 0.0f, -1.0f), 0.0, 0.01);
}

TEST(a_normal_map_turns_with_its_image_on_the_surface)
{
    /* turn and scale of the slot; where red and green point then */
    static const struct {
        double place[3];
        float red[2], green[2];
    } rows[] = {{{PI / 2, 1, 1}, {0, -1}, {1, 0}},  {{PI, 1, 1}, {-1, 0}, {0, -1}},
                {{-PI / 2, 2, 2}, {0, 1}, {-1, 0}}, {{0, -1, 1}, {-1, 0}, {0, 1}},
                {{0, 1, -1}, {1, 0}, {0, -1}},      {{0, -3, -3}, {-1, 0}, {0, -1}},
                {{PI / 2, -1, 1}, {0, -1}, {-1, 0}}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        const float *red = rows[i].red, *green = rows[i].green;
        assert_near(render_placed_normal_map(*state, 218, 128, rows[i].place, red[0], red[1]), 1.0, 0.01);
        assert_near(render_placed_normal_map(*state, 218, 128, rows[i].place, -red[0], -red[1]), 0.0, 0.01);
        assert_near(render_placed_normal_map(*state, 128, 218, rows[i].place, green[0], green[1]), 1.0, 0.01);
    }
}

static float render_bump_ramp(struct fixture *fixture, float strength, float light_x)
{
    static uint8_t texels[256 * 4];
    fixture_clear((void **)&fixture);
    for (int i = 0; i < 256; i++)
        memset(texels + i * 4, i, 4);
    struct record_texture_use use = one_texture(fixture, 256, 1, texels, strength);
    struct scene_material *material = fixture_material(fixture);
    material->textures[MATERIAL_BUMP] = use;
    fixture_square(fixture, 1.0f, material->base.id, NULL);
    light_from(fixture, light_x, 0.0f);
    return render_middle(fixture);
}

TEST(a_bump_map_of_constant_slope_tilts_by_that_slope)
{
    /* 2 metres of height over 2 metres of width: 45 degrees, away from the height */
    assert_near(render_bump_ramp(*state, 2.0f, 0.0f), sqrt(0.5), 0.01);
    assert_near(render_bump_ramp(*state, 2.0f, -1.0f), 1.0, 0.01);
    assert_near(render_bump_ramp(*state, 2.0f, 1.0f), 0.0, 0.01);
    assert_near(render_bump_ramp(*state, -2.0f, 1.0f), 1.0, 0.01);
    /* a slope of 1/2 */
    assert_near(render_bump_ramp(*state, 1.0f, 0.0f), cos(atan(0.5)), 0.01);
}

TEST(occlusion_darkens_the_environment_by_its_strength)
{
    struct fixture *fixture = *state;
    const uint8_t half[4] = {51, 255, 255, 255}; /* 0.2 */
    struct record_texture_use use = one_texture(fixture, 1, 1, half, 0.5f);
    struct scene_material *material = fixture_material(fixture);
    material->textures[MATERIAL_OCCLUSION] = use;
    fixture_square(fixture, 10.0f, material->base.id, NULL);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    assert_near(render_middle(fixture), 0.6, 1e-3);
}

TEST(emission_is_multiplied_by_its_texture)
{
    struct fixture *fixture = *state;
    const uint8_t texel[4] = {51, 0, 0, 255};
    struct record_texture_use use = one_texture(fixture, 1, 1, texel, 1.0f);
    struct scene_material *material = fixture_material(fixture);
    material->value.emission[0] = 10.0f;
    material->textures[MATERIAL_EMISSION] = use;
    fixture_square(fixture, 10.0f, material->base.id, NULL);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, -5.0f, 1.0f); /* behind */
    assert_near(render_middle(fixture), 2.0, 1e-3);
}

TEST(fine_patterns_are_averaged_in_the_distance)
{
    struct fixture *fixture = *state;
    static uint8_t texels[64 * 64 * 4];
    for (int i = 0; i < 64 * 64; i++)
        memset(texels + i * 4, (i + i / 64) % 2 ? 255 : 0, 4);
    struct record_texture_use use = one_texture(fixture, 64, 64, texels, 1.0f);
    use.uv_transform[0] = use.uv_transform[4] = 4.0f;
    struct scene_material *material = fixture_material(fixture);
    material->value.unlit = true;
    material->textures[MATERIAL_BASE_COLOUR] = use;
    fixture_square(fixture, 2.0f, material->base.id, NULL); /* 256 texels over 40 pixels */
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 5.0f, 1.0f);
    struct frame_result result = fixture_render(fixture);
    for (uint32_t i = 0; i < 32; i++)
        assert_near(fixture_pixel(&result, i, i)[0], 0.5, 0.01);
    frame_result_finish(&result);
}

TEST(the_environment_turns_about_y_for_the_eye_and_for_surfaces_alike)
{
    struct fixture *fixture = *state;
    enum { WIDTH = 32, HEIGHT = 16 };
    static uint16_t texels[WIDTH * HEIGHT * 4];
    for (int i = 0; i < WIDTH * HEIGHT * 4; i++)
        texels[i] = i / 4 % WIDTH >= WIDTH / 2 ? 0x3c00 : 0; /* 1 towards +x */
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 0.5f, fixture_material(fixture)->base.id);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    struct scene_environment *environment = &fixture->edits[fixture->edit_count - 1].set.environment;
    environment->value.width = WIDTH;
    environment->value.height = HEIGHT;
    environment->texels = fixture_blob(texels, sizeof(texels));
    environment->value.rotation = (float)(PI / 2.0); /* +x goes to -z */
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 0, 0)[0], 1.0, 1e-6);
    assert_near(fixture_pixel(&result, 16, 16)[0], 0.0, 0.03);
    frame_result_finish(&result);
    fixture_set_camera(fixture, 0.0f, 0.0f, -5.0f, 0.6f);
    result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 0, 0)[0], 0.0, 1e-6);
    assert_near(fixture_pixel(&result, 16, 16)[0], 1.0, 0.03);
    frame_result_finish(&result);
}

/* KHR_materials_anisotropy: red and green are a direction about the tangent, blue a share of the strength; the
 * same as a rotation and a strength of the material, with the same random numbers. */
static void expect_turned_grain(struct fixture *fixture, unsigned integrator, double turn)
{
    static const uint8_t texel[4] = {64, 224, 128, 255};
    const double x = 2.0 * 64 / 255 - 1.0, y = 2.0 * 224 / 255 - 1.0;
    float seen[3][32 * 32];
    double brightest = 0.0, unlike = 0.0;
    for (int way = 0; way < 3; way++) { /* by a texture; by numbers; without a texture's turn */
        fixture_clear((void **)&fixture);
        struct scene_material *brushed = fixture_material(fixture);
        brushed->value.metallic = 1.0f;
        brushed->value.roughness = 0.3f;
        brushed->value.anisotropy = way == 0 ? 0.9f : 0.9f * 128 / 255;
        brushed->value.anisotropy_rotation = way == 1 ? 0.4f + (float)(atan2(y, x) - turn) : 0.4f;
        if (way == 0) {
            brushed->textures[MATERIAL_ANISOTROPY] = one_texture(fixture, 1, 1, texel, 1.0f);
            turn_slot(&brushed->textures[MATERIAL_ANISOTROPY], turn, 1, 1);
        }
        fixture_square(fixture, 10.0f, brushed->base.id, NULL);
        light_from(fixture, 0.3f, 0.1f);
        fixture->request.light.integrator = integrator;
        fixture->request.light.depth = 1;
        struct frame_result result = fixture_render(fixture);
        for (uint32_t i = 0; i < 32 * 32; i++)
            seen[way][i] = fixture_pixel(&result, i % 32, i / 32)[1];
        frame_result_finish(&result);
    }
    for (int i = 0; i < 32 * 32; i++) {
        brightest = fmax(brightest, (double)seen[1][i]);
        unlike = fmax(unlike, fabs((double)seen[2][i] - (double)seen[1][i]));
    }
    for (int i = 0; i < 32 * 32; i++)
        assert_near(seen[0][i], seen[1][i], 1e-4 * brightest);
    assert_true(unlike > 0.1 * brightest); /* else nothing is shown */
}

TEST(a_texture_turns_the_grain_and_weakens_it)
{
    static const unsigned integrators[] = {INTEGRATOR_PATH, INTEGRATOR_DISTRIBUTED, INTEGRATOR_WHITTED,
                                           INTEGRATOR_RAYCAST};
    const size_t count = getenv("FARLIGHT_TEST_LONG") ? sizeof(integrators) / sizeof(integrators[0]) : 1;
    for (size_t i = 0; i < count; i++)
        expect_turned_grain(*state, integrators[i], 0);
    expect_turned_grain(*state, INTEGRATOR_PATH, 1.1); /* the image lies turned on the surface */
}
