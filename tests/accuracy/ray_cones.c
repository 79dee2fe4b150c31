/* SPDX-License-Identifier: MIT */
/* Ray cones: their formulas against bundles of rays and lenses, what a hit tells of its surface, and pictures: one
 * sample a pixel shows what many samples show, and does not flicker. */
#include "render/frame/state.h"
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/shader_probe.h"
#include "tests/harness/test.h"

#include "shared/bindings.h"

#define PI 3.14159265358979

/* ---- formulas ---- */

enum cone_operation { MIRRORED, REFRACTED, SCATTERED };

/* Layout of the shader's struct: two vec4. */
struct cone_case {
    float width, spread, operation, curvature; /* curvature; of SCATTERED the solid angle */
    float eta, cosine_before, cosine_behind, unused;
};

static const char cone_text[] =
    "#include \"shared/bindings.h\"\n"
    "layout(local_size_x = 1) in;\n"
    "#include \"common/cone.glsl\"\n"
    "layout(std430, binding = BIND_PASS_0) readonly buffer case_block { vec4 cases[]; };\n"
    "layout(std430, binding = BIND_PASS_1) writeonly buffer cone_block { vec2 cones[]; };\n"
    "void main()\n"
    "{\n"
    "    vec4 a = cases[0], b = cases[1];\n"
    "    cones[0] = a.z == 0.0 ? cone_mirrored(a.xy, a.w) :\n"
    "               a.z == 1.0 ? cone_refracted(a.xy, a.w, b.x, b.y, b.z) : cone_scattered(a.xy, a.w);\n"
    "}\n";

struct cone {
    float width, spread;
};

static void run_probe(struct fixture *fixture, const char *text, const struct gpu_define *defines,
                      const void *question, size_t question_bytes, void *answer, size_t answer_bytes)
{
    struct error error = {0};
    struct gpu_program program = shader_probe_compile(text, defines);
    struct gpu_buffer in = {0}, out = {0};
    assert_true(gpu_buffer_upload(fixture->device, &in, question, question_bytes, &error));
    assert_true(gpu_buffer_reserve(fixture->device, &out, answer_bytes, &error));
    gpu_buffer_bind_storage(&in, BIND_PASS_0);
    gpu_buffer_bind_storage(&out, BIND_PASS_1);
    gpu_dispatch(fixture->device, &program, 1);
    gpu_buffer_read(fixture->device, &out, 0, answer, answer_bytes);
    gpu_buffer_finish(fixture->device, &in);
    gpu_buffer_finish(fixture->device, &out);
    shader_probe_finish(&program);
    if (!gpu_check(fixture->device, "cone probe", &error))
        fail_msg("%s", error.text);
}

static struct cone cone_of(struct fixture *fixture, struct cone_case asked)
{
    struct cone answer;
    run_probe(fixture, cone_text, NULL, &asked, sizeof(asked), &answer, sizeof(answer));
    return answer;
}

static double width_after(struct cone cone, double distance)
{
    return (double)cone.width + (double)cone.spread * distance;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* Widths after a distance: a mirror's focus is at half its radius, and 1 / object + 1 / image = 2 / radius; a flat
 * one changes nothing; solid angles add up, and a cone that closes in to a point stays open by the angle there. */
static const struct {
    const char *name;
    struct cone_case asked;
    double distance, width;
} formulas[] = {
    {"parallel light in its focus", {.width = 0.01f, .operation = MIRRORED, .curvature = -1.0f / 3.0f}, 1.5, 0.0},
    {"and turned over", {.width = 0.01f, .operation = MIRRORED, .curvature = -1.0f / 3.0f}, 3.0, -0.01},
    {"from 4.5 m to 2.25 m",
     {.width = 0.045f, .spread = 0.01f, .operation = MIRRORED, .curvature = -1.0f / 3.0f},
     2.25,
     0.0},
    {"a flat mirror, at once", {.width = 0.2f, .spread = 0.3f, .operation = MIRRORED}, 0.0, 0.2},
    {"a flat mirror, farther on", {.width = 0.2f, .spread = 0.3f, .operation = MIRRORED}, 1.0, 0.5},
    {"scattered, at once", {.width = 0.1f, .spread = 0.3f, .operation = SCATTERED, .curvature = 0.16f}, 0.0, 0.1},
    {"scattered, farther on",
     {.width = 0.1f, .spread = 0.3f, .operation = SCATTERED, .curvature = 0.16f},
     1.0,
     0.6},
    {"scattered where it closes",
     {.width = 1.0f, .spread = -1.0f, .operation = SCATTERED, .curvature = 0.01f},
     1.0,
     0.1},
};

TEST(cones_are_mirrored_and_scattered_by_the_formulas)
{
    for (size_t i = 0; i < sizeof(formulas) / sizeof(formulas[0]); i++) {
        const double width = width_after(cone_of(*state, formulas[i].asked), formulas[i].distance);
        if (!(fabs(width - formulas[i].width) < 1e-6))
            fail_msg("%s: %.8f wide, expected %g", formulas[i].name, width, formulas[i].width);
    }
}

TEST(a_glass_ball_has_the_focus_of_a_ball_lens)
{
    const float eta = 1.5f, radius = 2.0f;
    struct cone_case entry = {.width = 0.01f,
                              .operation = REFRACTED,
                              .curvature = 1.0f / radius,
                              .eta = eta,
                              .cosine_before = 1.0f,
                              .cosine_behind = 1.0f};
    struct cone inside = cone_of(*state, entry);
    /* a single surface: eta r / (eta - 1) behind it */
    assert_near(width_after(inside, 6.0), 0.0, 1e-7);
    struct cone_case exit = entry;
    exit.width = (float)width_after(inside, 4.0);
    exit.spread = inside.spread;
    exit.curvature = -1.0f / radius;
    exit.eta = 1.0f / eta;
    struct cone behind = cone_of(*state, exit);
    /* eta r / (2 (eta - 1)) from the centre is 3, 1 behind the ball */
    assert_near(width_after(behind, 1.0), 0.0, 1e-7);
}

TEST(a_flat_boundary_keeps_area_times_solid_angle_times_the_square_of_the_index)
{
    for (float degrees = 0.0f; degrees < 80.0f; degrees += 10.0f) {
        const float eta = 1.5f, before = cosf(degrees * (float)PI / 180.0f);
        const float behind = sqrtf(1.0f - (1.0f - before * before) / (eta * eta));
        struct cone_case c = {.width = 0.01f,
                              .spread = 0.02f,
                              .operation = REFRACTED,
                              .eta = eta,
                              .cosine_before = before,
                              .cosine_behind = behind};
        struct cone bent = cone_of(*state, c);
        assert_near((double)bent.width * (double)bent.spread * 1.5, 0.01 * 0.02, 1e-9);
        assert_near((double)bent.width * (double)bent.width / (double)behind, 1e-4 / (double)before, 1e-9);
    }
}

/* ---- what a hit tells of its surface ---- */

static const char detail_text[] =
    "#include \"shared/bindings.h\"\n"
    "layout(local_size_x = 1) in;\n"
    "#include \"common/detail.glsl\"\n"
    "#include \"common/surface.glsl\"\n"
    "layout(std430, binding = BIND_PASS_0) readonly buffer hit_block { uvec4 asked; };\n"
    "layout(std430, binding = BIND_PASS_1) writeonly buffer detail_block { vec4 answer; };\n"
    "void main()\n"
    "{\n"
    "    hit h = surface_miss();\n"
    "    h.instance = asked.x;\n"
    "    h.primitive = asked.y;\n"
    "    h.uv01_or_sample.y = asked.z;\n"
    "    vec3 along = uintBitsToFloat(asked.w) * vec3(1.0, 0.0, 0.0);\n"
    "    surface_detail detail = detail_at(h, mat2x3(along, vec3(0.0, 1.0, 0.0)));\n"
    "    answer = vec4(detail.footprint.along.x, detail.footprint.across.y, detail.footprint.along.z, "
    "detail.curvature);\n"
    "}\n";

/* Texture coordinates per metre: of set 0 to the right and up, of set 1 to the right. */
struct detail {
    float u, v, second_u, curvature;
};

static struct detail detail_of(struct fixture *fixture, uint32_t instance, uint32_t primitive, float v)
{
    static const struct gpu_define defines[] = {{"HAS_SPHERES", "1"}, {NULL, NULL}};
    const float metre = 1.0f;
    uint32_t asked[4] = {instance, primitive, 0, 0};
    memcpy(&asked[2], &v, sizeof(v));
    memcpy(&asked[3], &metre, sizeof(metre));
    struct frame_result result = fixture_render(fixture); /* brings the scene to the device */
    frame_result_finish(&result);
    gpu_scene_bind(&fixture->shared->copy);
    struct detail detail;
    run_probe(fixture, detail_text, defines, asked, sizeof(asked), &detail, sizeof(detail));
    return detail;
}

static const float three_times[12] = {3, 0, 0, 1, 0, 3, 0, 2, 0, 0, 3, 3};

/* A small triangle with its corners on a ball of radius 2, in a node that is three times as large. */
static struct detail cap_detail(struct fixture *fixture, float normal_size, bool turned)
{
    fixture_clear((void **)&fixture);
    struct scene_mesh *mesh = fixture_square(fixture, 1.0f, fixture_material(fixture)->base.id, three_times);
    float positions[12], corner_normals[12];
    for (int i = 0; i < 4; i++) {
        double theta = 0.02, phi = 2.0 * PI * i / 4.0;
        const double normal[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
        for (int k = 0; k < 3; k++) {
            positions[3 * i + k] = (float)(2.0 * normal[k]);
            corner_normals[3 * i + k] = (float)normal[k] * normal_size;
        }
    }
    static const uint32_t turned_indices[6] = {0, 2, 1, 0, 3, 2};
    blob_unref(mesh->arrays[MESH_POSITIONS]);
    mesh->arrays[MESH_POSITIONS] = fixture_blob(positions, sizeof(positions));
    mesh->arrays[MESH_NORMALS] = fixture_blob(corner_normals, sizeof(corner_normals));
    if (turned) {
        blob_unref(mesh->arrays[MESH_INDICES]);
        mesh->arrays[MESH_INDICES] = fixture_blob(turned_indices, sizeof(turned_indices));
    }
    return detail_of(fixture, 0, 0, 0.0f);
}

TEST(the_normals_of_a_triangle_tell_the_radius_of_the_ball)
{
    assert_near(cap_detail(*state, 1.0f, false).curvature, 1.0 / 6.0, 1e-4);
    assert_near(cap_detail(*state, 5.0f, false).curvature, 1.0 / 6.0, 1e-4);
    assert_near(cap_detail(*state, 1.0f, true).curvature, -1.0 / 6.0, 1e-4); /* seen as a bowl */
}

TEST(a_triangle_without_normals_is_flat_and_knows_the_size_of_its_texture)
{
    struct fixture *fixture = *state;
    fixture_square(fixture, 2.0f, fixture_material(fixture)->base.id, three_times);
    struct detail detail = detail_of(fixture, 0, 0, 0.0f);
    assert_near(detail.curvature, 0.0, 0.0);
    assert_near(detail.u, 1.0 / 12.0, 1e-6);
    assert_near(detail.v, -1.0 / 12.0, 1e-6); /* an image's rows go down */
}

TEST(each_set_of_texture_coordinates_has_its_own_size)
{
    struct fixture *fixture = *state;
    struct scene_mesh *mesh = fixture_square(fixture, 2.0f, fixture_material(fixture)->base.id, NULL);
    const float twice[8] = {0, 2, 2, 2, 2, 0, 0, 0};
    mesh->arrays[MESH_TEXCOORDS_1] = fixture_blob(twice, sizeof(twice));
    struct detail detail = detail_of(fixture, 0, 0, 0.0f);
    assert_near(detail.u, 0.25, 1e-6);
    assert_near(detail.second_u, 0.5, 1e-6);
}

TEST(a_sphere_tells_its_radius_and_how_densely_its_texture_lies)
{
    struct fixture *fixture = *state;
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 0.5f, fixture_material(fixture)->base.id);
    struct detail detail = detail_of(fixture, 0, 0, 0.5f);
    assert_near(detail.curvature, 2.0, 1e-5);
    /* at the equator, with u = 0 behind, where -x is east: 1 over pi m along u, over pi / 2 m along v */
    assert_near(detail.u, -1.0 / PI, 1e-5);
    assert_near(detail.v, -2.0 / PI, 1e-5);
}

/* ---- pictures ---- */

static struct record_texture_use checks(struct fixture *fixture, uint32_t size, float repeats)
{
    uint8_t *texels = malloc((size_t)size * size * 4);
    assert_non_null(texels);
    for (uint32_t i = 0; i < size * size; i++)
        memset(texels + (size_t)i * 4, (i % size / 4 + i / size / 4) % 2 ? 255 : 0, 4);
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->value.width = texture->value.height = size;
    texture->value.format = TEXTURE_RGBA8_LINEAR;
    texture->texels = fixture_blob(texels, (size_t)size * size * 4);
    free(texels);
    return (struct record_texture_use){
        .texture = texture->base.id, .uv_transform = {repeats, 0, 0, 0, repeats, 0}, .strength = 1.0f};
}

/* Adds a floor of unlit checks at this depth. */
static void floor_of_checks(struct fixture *fixture, float depth, float repeats)
{
    const float floor[12] = {1, 0, 0, 0, 0, 0, 1, -depth, 0, -1, 0, 0};
    struct record_texture_use use = checks(fixture, 64, repeats);
    struct scene_material *plain = fixture_material(fixture);
    plain->value.unlit = true;
    plain->textures[MATERIAL_BASE_COLOUR] = use;
    fixture_square(fixture, 20.0f, plain->base.id, floor);
}

/* A floor of checks of 0.3 m below a ball of radius 1.2. */
static void checkered_floor(struct fixture *fixture, float metallic, float roughness, float transmission)
{
    floor_of_checks(fixture, 1.2f, 8.0f);
    struct scene_material *ball = fixture_material(fixture);
    ball->value.metallic = metallic;
    ball->value.roughness = roughness;
    ball->value.transmission = transmission;
    ball->value.ior = 1.5f;
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 1.2f, ball->base.id);
    fixture_environment(fixture, 0.5f, 0.5f, 0.5f);
    fixture->request.picture.width = fixture->request.picture.height = 64;
    fixture_set_camera(fixture, 0.0f, 0.8f, 7.0f, 0.34f);
}

static struct frame_result render_samples(struct fixture *fixture, uint32_t samples, uint64_t seed, float x)
{
    fixture->request.sampling.samples = samples;
    fixture->request.sampling.seed = seed;
    fixture_set_camera(fixture, x, 0.8f, 7.0f, 0.34f);
    return fixture_render(fixture);
}

/* Mean square of the difference of displayed values, 0 to 1. */
static double mean_square(const struct frame_result *a, const struct frame_result *b)
{
    double sum = 0.0;
    for (uint32_t y = 0; y < a->height; y++)
        for (uint32_t x = 0; x < a->width; x++) {
            double off =
                fmin((double)fixture_pixel(a, x, y)[0], 1.0) - fmin((double)fixture_pixel(b, x, y)[0], 1.0);
            sum += off * off;
        }
    return sum / ((double)a->width * a->height);
}

/* How far one sample a pixel is from many, dB. */
static double quality(struct fixture *fixture, uint32_t many)
{
    struct frame_result one = render_samples(fixture, 1, 1, 0.0f), all = render_samples(fixture, many, 2, 0.0f);
    double psnr = -10.0 * log10(mean_square(&one, &all));
    frame_result_finish(&one);
    frame_result_finish(&all);
    return psnr;
}

#define EXPECT_QUALITY(what, found, minimum)                                                                      \
    do {                                                                                                          \
        double found_ = (found);                                                                                  \
        print_message("    %s: %.1f dB\n", what, found_);                                                         \
        if (!(found_ >= (minimum)))                                                                               \
            fail_msg("%s: %.1f dB, at least %.1f are expected", what, found_, (double)(minimum));                 \
    } while (0)

/* Quality in dB of one sample, and without cones (as if balls were flat or smooth, in full detail). */
static const struct {
    const char *name;
    float metallic, roughness, transmission;
    unsigned integrator;
    double minimum;
} balls[] = {
    {"mirror", 1.0f, 0.0f, 0.0f, INTEGRATOR_WHITTED, 19.0},                  /* 15.7 */
    {"glass", 0.0f, 0.0f, 1.0f, INTEGRATOR_WHITTED, 19.0},                   /* 17.6 */
    {"rough, distributed", 1.0f, 0.25f, 0.0f, INTEGRATOR_DISTRIBUTED, 15.0}, /* 12.8 */
    {"rough, path", 1.0f, 0.25f, 0.0f, INTEGRATOR_PATH, 15.0},               /* 12.2 */
    {"scattered, path", 0.0f, 1.0f, 0.0f, INTEGRATOR_PATH, 14.5},            /* 12.3 */
};

static void expect_balls(struct fixture *fixture, size_t first, size_t end)
{
    for (size_t i = first; i < end; i++) {
        fixture_clear((void **)&fixture);
        checkered_floor(fixture, balls[i].metallic, balls[i].roughness, balls[i].transmission);
        fixture->request.light.integrator = balls[i].integrator;
        EXPECT_QUALITY(balls[i].name, quality(fixture, 64), balls[i].minimum);
    }
}

TEST(mirror_and_glass_balls_show_with_one_sample_what_many_show)
{
    expect_balls(*state, 0, 2);
}

TEST_LONG(what_rough_balls_mirror_and_floors_scatter_has_less_noise)
{
    expect_balls(*state, 2, sizeof(balls) / sizeof(balls[0]));
}

/* Successive frames of a camera that moves by a tenth of a pixel each, beside the same with many samples. */
TEST_LONG(a_mirror_ball_does_not_flicker_as_the_camera_moves)
{
    struct fixture *fixture = *state;
    double sums[2] = {0.0, 0.0};
    checkered_floor(fixture, 1.0f, 0.0f, 0.0f);
    for (int kind = 0; kind < 2; kind++) {
        struct frame_result before = {0};
        for (int i = 0; i < 6; i++) {
            struct frame_result next = render_samples(fixture, kind ? 64 : 1, 1, (float)i * 0.004f);
            if (i > 0)
                sums[kind] += mean_square(&before, &next);
            frame_result_finish(&before);
            before = next;
        }
        frame_result_finish(&before);
    }
    print_message("    successive frames change %.2f times as much as with 64 samples\n", sqrt(sums[0] / sums[1]));
    assert_true(sums[0] < 4.0 * sums[1]); /* twice; 2.8 times as if the ball were flat */
}

/* A floor of checks that a mirror or a pane of glass, which stands on it, shows at a grazing angle. */
static void grazing_floor(struct fixture *fixture, bool glass)
{
    floor_of_checks(fixture, 1.0f, 16.0f);
    struct scene_material *pane = fixture_material(fixture);
    pane->value.metallic = glass ? 0.0f : 1.0f;
    pane->value.transmission = glass ? 1.0f : 0.0f;
    pane->value.roughness = 0.0f;
    pane->value.ior = 1.5f;
    fixture_square(fixture, 4.0f, pane->base.id, NULL);
    fixture_environment(fixture, 0.5f, 0.5f, 0.5f);
    fixture->request.picture.width = fixture->request.picture.height = 64;
}

/* The footprint at a grazing angle is much longer than wide. */
TEST_LONG(a_grazing_floor_in_a_mirror_and_behind_glass_shows_with_one_sample_what_many_show)
{
    struct fixture *fixture = *state;
    for (int glass = 0; glass < 2; glass++) {
        fixture_clear((void **)&fixture);
        grazing_floor(fixture, glass);
        /* 17.7 and 18.6 by one level, of the mean of the footprint's length and width: over twice the error */
        EXPECT_QUALITY(glass ? "glass" : "mirror", quality(fixture, 64), 23.0);
    }
}

/* Expects grey pixels in a square in the middle of the picture. */
static void expect_grey(struct fixture *fixture)
{
    struct frame_result result = fixture_render(fixture);
    for (uint32_t y = 12; y < 20; y++)
        for (uint32_t x = 12; x < 20; x++)
            assert_near(fixture_pixel(&result, x, y)[0], 0.5, 0.02);
    frame_result_finish(&result);
}

TEST(fine_patterns_on_spheres_and_discs_are_averaged_in_the_distance)
{
    struct fixture *fixture = *state;
    for (int is_disc = 0; is_disc < 2; is_disc++) {
        fixture_clear((void **)&fixture);
        struct record_texture_use use =
            checks(fixture, 64, 16.0f); /* a pixel has more than a pair of them each way */
        struct scene_material *material = fixture_material(fixture);
        material->value.unlit = true;
        material->textures[MATERIAL_BASE_COLOUR] = use;
        if (is_disc) {
            struct scene_disc *disc = &fixture_edit(fixture, OBJECT_DISC)->set.disc;
            disc->base.id = fixture->next_id++;
            disc->value.material = material->base.id;
            disc->value.normal_world[2] = 1.0f;
            disc->value.radius = 1.0f;
        } else {
            fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 1.0f, material->base.id);
        }
        fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
        expect_grey(fixture);
    }
}

TEST(fine_bumps_are_flat_in_the_distance)
{
    struct fixture *fixture = *state;
    struct record_texture_use use = checks(fixture, 64, 16.0f);
    use.strength = 0.05f;
    struct scene_material *material = fixture_material(fixture);
    material->textures[MATERIAL_BUMP] = use;
    fixture_square(fixture, 1.0f, material->base.id, NULL);
    fixture_environment(fixture, 0.0f, 0.0f, 0.0f);
    fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, (float)PI);
    struct frame_result result = fixture_render(fixture);
    for (uint32_t y = 12; y < 20; y++)
        for (uint32_t x = 12; x < 20; x++)
            assert_near(fixture_pixel(&result, x, y)[0], 1.0, 0.01);
    frame_result_finish(&result);
}
