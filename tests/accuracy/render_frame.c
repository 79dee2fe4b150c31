/* SPDX-License-Identifier: MIT */
/* The order of a frame: both ways to the primary hits, slices and their splits, seeds, formats, cameras. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"
#include "tests/fixtures/framing.h"

static void primary_hits_agree_however_they_are_found(struct fixture *fixture, double share_allowed)
{
    fixture->request.tracing.primary = PRIMARY_RASTER;
    struct frame_result raster = fixture_render(fixture);
    fixture->request.tracing.primary = PRIMARY_TRACE;
    struct frame_result trace = fixture_render(fixture);
    uint32_t differing = 0, pixels = raster.width * raster.height;
    for (uint32_t i = 0; i < pixels; i++) {
        const float *a = fixture_pixel(&raster, i % raster.width, i / raster.width);
        const float *b = fixture_pixel(&trace, i % raster.width, i / raster.width);
        for (int c = 0; c < 4; c++)
            if (fabsf(a[c] - b[c]) > 1e-4f * (1.0f + fabsf(a[c]))) {
                differing++;
                break;
            }
    }
    if (differing > share_allowed * pixels)
        fail_msg("%u of %u pixels differ, allowed are %g", differing, pixels, share_allowed * pixels);
    frame_result_finish(&raster);
    frame_result_finish(&trace);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(rasterised_and_traced_primary_hits_agree_but_for_edges)
{
    fixture_mixture(*state);
    primary_hits_agree_however_they_are_found(*state, 0.002);
}

TEST(they_agree_in_an_orthographic_view)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.camera.fov_y = 0.0f;
    fixture->request.camera.ortho_height = 3.0f;
    primary_hits_agree_however_they_are_found(fixture, 0.002);
    fixture->request.camera.near = 3.2f; /* cuts the glass sphere open */
    primary_hits_agree_however_they_are_found(fixture, 0.002);
}

TEST(they_agree_inside_a_sphere_and_beyond_the_near_plane)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 20.0f, 0); /* the eye is in it */
    primary_hits_agree_however_they_are_found(fixture, 0.002);
    fixture->request.camera.near = 3.5f;
    primary_hits_agree_however_they_are_found(fixture, 0.002);
}

TEST(they_agree_where_transforms_mirror_and_stretch)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture_commit(fixture);
    const float transform[12] = {-1.5f, 0, 0, -0.2f, 0, 0.5f, 0.2f, 0.4f, 0, 0, 1, 0.5f};
    const float centre_radius[8] = {0.0f, 0.0f, 0.0f, 0.3f, 0.4f, 0.2f, 0.1f, 0.1f};
    struct scene_spheres *spheres = &fixture_edit(fixture, OBJECT_SPHERES)->set.spheres;
    spheres->base.id = fixture->next_id++;
    spheres->value.sphere_count = 2;
    spheres->centres_radii = fixture_blob(centre_radius, sizeof(centre_radius));
    fixture_node(fixture, NODE_SPHERES, spheres->base.id, transform);
    primary_hits_agree_however_they_are_found(fixture, 0.002);
}

TEST(holes_are_cut_out_of_rasterised_triangles_too)
{
    struct fixture *fixture = *state;
    /* a chessboard of 4x4 texels, every second one open */
    uint8_t texels[4 * 4 * 4];
    for (int i = 0; i < 16; i++)
        memset(texels + i * 4, (i + i / 4) % 2 ? 255 : 0, 4);
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->value.width = texture->value.height = 4;
    texture->value.nearest = true;
    texture->texels = fixture_blob(texels, sizeof(texels));
    struct scene_material *material = fixture_material(fixture);
    material->value.alpha_mode = ALPHA_MASK;
    material->value.unlit = true;
    material->textures[MATERIAL_BASE_COLOUR] = (struct record_texture_use){
        .texture = texture->base.id, .uv_transform = {1, 0, 0, 0, 1, 0}, .strength = 1.0f};
    fixture_square(fixture, 1.0f, material->base.id, NULL);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 5.0f, 1.0f);
    primary_hits_agree_however_they_are_found(fixture, 0.0);
    struct frame_result result = fixture_render(fixture);
    /* 32 pixels show 3.09 units; texel 0,0 (upper left) is open, the one to its right is not */
    assert_near(fixture_pixel(&result, 8, 8)[3], 0.0, 0.0);
    assert_near(fixture_pixel(&result, 13, 8)[3], 1.0, 0.0);
    frame_result_finish(&result);
}

TEST(the_same_seed_gives_the_same_bytes)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.sampling.samples = 3;
    fixture->request.sampling.seed = 77;
    struct frame_result first = fixture_render(fixture);
    struct frame_result second = fixture_render(fixture);
    assert_same_picture(&first, &second);
    frame_result_finish(&second);
    fixture->request.sampling.seed = 78;
    second = fixture_render(fixture);
    assert_memory_not_equal(first.pixels, second.pixels, first.size_bytes);
    frame_result_finish(&first);
    frame_result_finish(&second);
}

TEST(a_wave_that_overflows_splits_its_slice_and_loses_nothing)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.light.depth = 6;
    struct frame_result large = fixture_render(fixture);
    assert_int_equal(large.splits, 0);
    frame_renderer_set_capacity(fixture->renderer, 512, 512);
    struct frame_result small = fixture_render(fixture);
    assert_true(small.splits > 0);
    assert_same_picture(&large, &small);
    assert_int_equal(large.secondary_rays, small.secondary_rays);
    assert_int_equal(large.shadow_rays, small.shadow_rays);
    frame_result_finish(&small);
    frame_renderer_set_capacity(fixture->renderer, 1, 1); /* less than one pixel needs: the wave must grow */
    fixture->request.picture.width = 8;
    fixture->request.picture.height = 6;
    small = fixture_render(fixture);
    assert_true(small.splits > 0);
    frame_result_finish(&large);
    frame_renderer_set_capacity(fixture->renderer, 0, 0);
    large = fixture_render(fixture);
    assert_same_picture(&large, &small);
    frame_result_finish(&large);
    frame_result_finish(&small);
}

TEST(formats_say_the_same)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.picture.exposure_stops = 1.0f;
    struct frame_result floats = fixture_render(fixture);
    fixture->request.picture.format = PIXEL_FORMAT_RGBA16F;
    struct frame_result halves = fixture_render(fixture);
    fixture->request.picture.format = PIXEL_FORMAT_RGBA8;
    fixture->request.picture.tone_map = TONE_NONE;
    struct frame_result bytes = fixture_render(fixture);
    fixture_keep(&bytes, "mixture");
    assert_int_equal(floats.size_bytes, 96 * 72 * 16);
    assert_int_equal(halves.size_bytes, 96 * 72 * 8);
    assert_int_equal(bytes.size_bytes, 96 * 72 * 4);
    for (uint32_t i = 0; i < 96 * 72; i++) {
        const float *pixel = fixture_pixel(&floats, i % 96, i / 96);
        uint16_t half;
        memcpy(&half, halves.pixels + i * 8, 2);
        double mantissa = (half & 1023) + ((half >> 10) ? 1024 : 0);
        double value = ldexp(mantissa, ((half >> 10) ? (half >> 10) : 1) - 25);
        assert_near(value, pixel[0], 1e-3 * pixel[0] + 1e-6);
        double clamped = pixel[0] > 1.0f ? 1.0 : (double)pixel[0];
        double srgb = clamped <= 0.0031308 ? 12.92 * clamped : 1.055 * pow(clamped, 1 / 2.4) - 0.055;
        assert_near(bytes.pixels[i * 4], srgb * 255.0, 0.6);
    }
    fixture->request.picture.format = PIXEL_FORMAT_RGBA32F;
    fixture->request.picture.exposure_stops = 0.0f;
    struct frame_result plain = fixture_render(fixture);
    assert_near(fixture_pixel(&floats, 50, 40)[1], 2.0f * fixture_pixel(&plain, 50, 40)[1], 1e-6);
    frame_result_finish(&plain);
    frame_result_finish(&floats);
    frame_result_finish(&halves);
    frame_result_finish(&bytes);
}

TEST(an_edit_between_two_frames_is_seen_by_the_second)
{
    struct fixture *fixture = *state;
    struct scene_material *material = fixture_material(fixture);
    material->value.unlit = true;
    uint32_t id = material->base.id;
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 0.5f, id);
    uint32_t node = fixture->next_id - 1;
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 5.0f, 1.0f);
    struct frame_result result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 16, 16)[0], 1.0, 1e-6);
    uint64_t revision = result.revision;
    frame_result_finish(&result);
    struct scene_node *moved = &fixture_edit(fixture, OBJECT_NODE)->set.node;
    *moved = *scene_node(fixture->scene, node);
    moved->value.parent_from_node[3] = 1.0f;
    result = fixture_render(fixture);
    assert_near(fixture_pixel(&result, 16, 16)[3], 0.0, 0.0);
    assert_near(fixture_pixel(&result, 26, 16)[0], 1.0, 1e-6);
    assert_int_equal(result.revision, revision + 1);
    frame_result_finish(&result);
}

TEST(an_abandoned_frame_does_not_change_the_next_one)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    struct frame_result dropped = {0};
    fixture_mixture(fixture);
    struct frame_result expected = fixture_render(fixture);
    assert_true(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    for (int i = 0; i < 3; i++)
        assert_int_equal(frame_step(fixture->renderer, &dropped, &error), FRAME_MORE);
    frame_abandon(fixture->renderer);
    assert_int_equal(frame_step(fixture->renderer, &dropped, &error), FRAME_FAILED);
    struct frame_result result = fixture_render(fixture);
    assert_same_picture(&expected, &result);
    frame_result_finish(&expected);
    frame_result_finish(&result);
}

TEST(every_stage_of_the_frame_is_timed)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    struct frame_result result = fixture_render(fixture);
    static const enum stage stages[] = {STAGE_PRIMARY, STAGE_TRACE,    STAGE_SHADE,
                                        STAGE_RESOLVE, STAGE_READBACK, STAGE_FRAME};
    for (size_t i = 0; i < sizeof(stages) / sizeof(stages[0]); i++)
        if (stage_times_sum_ns(&result.times, stages[i], CLOCK_CPU) == 0)
            fail_msg("stage %s took no time", stage_name(stages[i]));
    assert_true(stage_times_sum_ns(&result.times, STAGE_TRACE, CLOCK_GPU) > 0);
    assert_int_equal(result.primary_rays, 96 * 72);
    assert_true(result.shadow_rays > 0 && result.secondary_rays > 0);
    assert_true(frame_renderer_device_bytes(fixture->renderer) > 96 * 72 * 16);
    frame_result_finish(&result);
}

TEST(an_empty_scene_and_a_single_pixel_are_pictures_too)
{
    struct fixture *fixture = *state;
    for (uint32_t width = 1; width <= 17; width += 8) {
        fixture->request.picture.width = width;
        fixture->request.picture.height = 18 - width;
        struct frame_result result = fixture_render(fixture);
        assert_int_equal(result.size_bytes, width * (18 - width) * 16);
        assert_true(fixture_pixel(&result, width - 1, 17 - width)[2] >
                    0.05f); /* the default sky; its ground has 0.09 */
        frame_result_finish(&result);
    }
}

TEST(a_picture_of_several_bands_has_no_seam)
{
    struct fixture *fixture = *state;
    fixture->request.picture.width = 1024;
    fixture->request.picture.height = 300; /* bands hold 256 Ki pixels: 256 rows, and the rest */
    fixture->request.picture.format = PIXEL_FORMAT_RGBA8;
    fixture->request.camera.fov_y = 0.84f; /* rows differ by two steps of the sky at most */
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.size_bytes, 1024 * 300 * 4);
    for (uint32_t y = 1; y < 300; y++)
        for (uint32_t x = 0; x < 1024; x += 255) {
            const uint8_t *pixel = result.pixels + ((size_t)y * 1024 + x) * 4;
            if (abs(pixel[1] - pixel[1 - 1024 * 4]) > 2 || pixel[3] != 255)
                fail_msg("pixel %u,%u is %u with alpha %u, the one above %u", x, y, pixel[1], pixel[3],
                         pixel[1 - 1024 * 4]);
        }
    frame_result_finish(&result);
}

TEST(impossible_requests_are_refused_with_the_field)
{
    struct fixture *fixture = *state;
    const struct frame_request good = fixture->request;
    struct error error = {0};
    fixture->request.picture.width = 0;
    assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    assert_string_equal(error.field, "width");
    error = (struct error){0};
    fixture->request = good;
    fixture->request.tracing.tracer = 4711;
    assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    assert_string_equal(error.field, "tracer");
    error = (struct error){0};
    fixture->request = good;
    fixture->request.camera.world_from_view[3] = NAN;
    assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    assert_string_equal(error.field, "camera");
}

/* Where the corners of bounds are in the picture: -1 .. 1 from edge to edge. */
static void picture_bounds(const struct frame_camera *camera, const float lower[3], const float upper[3],
                           float aspect, double least[2], double most[2])
{
    const double tangent = tan((double)camera->fov_y / 2.0);
    for (int corner = 0; corner < 8; corner++) {
        double v[3] = {0};
        for (int i = 0; i < 3; i++)
            for (int axis = 0; axis < 3; axis++)
                v[axis] += ((double)((corner >> i & 1) ? upper[i] : lower[i]) -
                            (double)camera->world_from_view[i * 4 + 3]) *
                           (double)camera->world_from_view[i * 4 + axis];
        assert_true(v[2] < 0.0);
        for (int axis = 0; axis < 2; axis++) {
            double place = v[axis] / (-v[2] * tangent * (axis == 0 ? (double)aspect : 1.0));
            least[axis] = corner ? fmin(least[axis], place) : place;
            most[axis] = corner ? fmax(most[axis], place) : place;
        }
    }
}

/* Bounds touch two opposite edges, less the margin, and pass none. */
TEST(the_automatic_camera_is_as_near_as_its_margin_allows)
{
    const float lower[3] = {-3.0f, 1.0f, 2.0f}, upper[3] = {5.0f, 2.0f, 40.0f};
    for (int i = 0; i < 5 * 5 * 2 * 2; i++) {
        struct frame_framing framing = usual_framing;
        struct frame_camera camera;
        double least[2], most[2];
        framing.azimuth = 1.3f * (float)(i % 5);
        framing.elevation = (float)(i / 5 % 5 - 2) * 0.78539816f; /* up to straight down */
        framing.margin = i / 25 % 2 ? 0.1f : 0.0f;
        const float aspect = i / 50 ? 0.4f : 1.5f;
        const double edge = 1.0 - 2.0 * (double)framing.margin;
        frame_camera_auto(&camera, &framing, lower, upper, aspect);
        picture_bounds(&camera, lower, upper, aspect, least, most);
        bool touches = false;
        for (int axis = 0; axis < 2; axis++) {
            assert_true(least[axis] > -edge - 1e-4 && most[axis] < edge + 1e-4); /* floats of a place 40 m away */
            touches |= least[axis] < -edge + 1e-4 && most[axis] > edge - 1e-4;
        }
        assert_true(touches);
        framing.zoom = 2.0f;
        double larger_least[2], larger_most[2];
        frame_camera_auto(&camera, &framing, lower, upper, aspect);
        picture_bounds(&camera, lower, upper, aspect, larger_least, larger_most);
        for (int axis = 0; axis < 2; axis++)
            assert_near(larger_most[axis], 2.0 * most[axis], 1e-3);
    }
}

TEST(a_camera_needs_a_view_direction_and_an_upward_one)
{
    struct frame_camera camera;
    const float eye[3] = {1, 2, 3}, up[3] = {0, 0, 2};
    assert_false(frame_camera_look_at(&camera, eye, eye, up, 1.0f));
    const float above[3] = {1, 2, 9};
    assert_false(frame_camera_look_at(&camera, eye, above, up, 1.0f));
}
