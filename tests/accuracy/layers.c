/* SPDX-License-Identifier: MIT */
/* Layers beside a picture's light, against what is known of simple scenes. */
#include "tests/accuracy/sampled_scenes.h"
#include "tests/fixtures/frame_hooks.h"

#include "shared/layers.h"
#include "trace/tracer.h"
#include "tests/harness/test.h"

#define ALL (LAYER_BITS_SEEN | LAYER_BITS_CRYPTO)
#define BIT(layer) (1u << (layer))
/* Places some metres from the origin, in floats: a few roundings of 2^-24 of 10 m. */
#define ROUNDING_METRES 5e-6

static const float *pixel_of(const struct frame_result *result, enum layer layer, uint32_t x, uint32_t y)
{
    assert_true(result->layers & BIT(layer));
    size_t plane = (size_t)__builtin_popcount(result->layers & (BIT(layer) - 1));
    return fixture_pixel(result, x, (uint32_t)plane * result->height + y);
}

static struct frame_result render(struct fixture *fixture, uint32_t layers)
{
    fixture->request.picture.layers = layers;
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.layers, layers ? layers : BIT(LAYER_BEAUTY));
    assert_int_equal(result.size_bytes,
                     (size_t)result.width * result.height * 16 * (size_t)__builtin_popcount(result.layers));
    return result;
}

static double dot(const float a[3], const float b[3])
{
    return (double)a[0] * (double)b[0] + (double)a[1] * (double)b[1] + (double)a[2] * (double)b[2];
}

/* The unit ray of a pixel's middle from the fixture's perspective camera. */
static void ray_of(const struct fixture *fixture, uint32_t x, uint32_t y, double origin[3], double direction[3])
{
    const struct frame_request *request = &fixture->request;
    const float *m = request->camera.world_from_view;
    double half = tan((double)request->camera.fov_y / 2),
           aspect = (double)request->picture.width / request->picture.height;
    double view[3] = {((x + 0.5) / request->picture.width * 2 - 1) * half * aspect,
                      (1 - (y + 0.5) / request->picture.height * 2) * half, -1};
    double length = sqrt(view[0] * view[0] + view[1] * view[1] + 1);
    for (int i = 0; i < 3; i++) {
        origin[i] = (double)m[4 * i + 3];
        direction[i] = 0;
        for (int k = 0; k < 3; k++)
            direction[i] += (double)m[4 * i + k] * view[k] / length;
    }
}

/* A plane through `middle` that fills the picture: every pixel's place, depth and normal are known. */
static void expect_plane(struct fixture *fixture, const float normal[3], const float middle[3], double tolerance)
{
    struct frame_result result = render(fixture, BIT(LAYER_NORMAL) | BIT(LAYER_DEPTH) | BIT(LAYER_POSITION));
    const float *m = fixture->request.camera.world_from_view;
    for (uint32_t i = 0; i < result.width * result.height; i++) {
        uint32_t x = i % result.width, y = i / result.width;
        double origin[3], direction[3], above = 0, towards = 0, depth = 0;
        ray_of(fixture, x, y, origin, direction);
        for (int k = 0; k < 3; k++) {
            above += ((double)middle[k] - origin[k]) * (double)normal[k];
            towards += direction[k] * (double)normal[k];
        }
        const float *place = pixel_of(&result, LAYER_POSITION, x, y), *n = pixel_of(&result, LAYER_NORMAL, x, y);
        for (int k = 0; k < 3; k++) {
            double expected = origin[k] + above / towards * direction[k];
            assert_near(place[k], expected, tolerance);
            depth -= (expected - origin[k]) * (double)m[4 * k + 2];
        }
        for (int k = 0; k < 3; k++)
            assert_near(pixel_of(&result, LAYER_DEPTH, x, y)[k], depth, tolerance);
        assert_near(n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2], 1, 1e-3); /* 12 or more bits each */
        for (int layer = LAYER_NORMAL; layer <= LAYER_POSITION; layer++)
            assert_true(pixel_of(&result, (enum layer)layer, x, y)[3] == 1.0f);
    }
    frame_result_finish(&result);
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* Turned by 0.5 radians about y, and then away from the eye: its normal is still towards it. */
TEST(planes_are_where_they_are_and_look_to_the_eye)
{
    struct fixture *fixture = *state;
    const float c = cosf(0.5f), s = sinf(0.5f);
    const float at[12] = {c, 0, s, 0, 0, 1, 0, 0.3f, -s, 0, c, -1}, normal[3] = {s, 0, c}, middle[3] = {0, 0, -1};
    uint32_t node = fixture->next_id + 1;
    fixture_square(fixture, 5, 0, at);
    const unsigned tracers[] = {TRACER_BVH, TRACER_NAIVE, TRACER_REFERENCE};
    for (int way = 0; way < 4; way++) { /* which side, and how first hits are found */
        if (way == 2) {
            const float away[12] = {-c, 0, -s, 0, 0, 1, 0, 0.3f, s, 0, -c, -1};
            memcpy(fixture_edit(fixture, OBJECT_NODE)->set.node.value.parent_from_node, away, sizeof(away));
            fixture->edits[0].set.node.base.id = node;
            fixture->edits[0].set.node.value.kind = NODE_MESH;
            fixture->edits[0].set.node.value.object = node - 1;
        }
        fixture->request.tracing.primary = way % 2 ? PRIMARY_TRACE : PRIMARY_RASTER;
        for (size_t i = 0; i < (getenv("FARLIGHT_TEST_LONG") ? sizeof(tracers) / sizeof(tracers[0]) : 1); i++) {
            struct error none = {0};
            fixture->request.tracing.tracer = tracers[i];
            if (tracer_find(tracers[i], "", &none))
                expect_plane(fixture, normal, middle, ROUNDING_METRES);
        }
    }
}

TEST(depth_is_along_the_view_of_an_orthographic_camera_too)
{
    struct fixture *fixture = *state;
    const float at[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -2};
    fixture_square(fixture, 5, 0, at);
    fixture->request.camera.fov_y = 0;
    fixture->request.camera.ortho_height = 3;
    struct frame_result result = render(fixture, BIT(LAYER_DEPTH) | BIT(LAYER_POSITION));
    for (uint32_t i = 0; i < 32; i++) {
        assert_near(pixel_of(&result, LAYER_DEPTH, i, 3)[0], 7, ROUNDING_METRES);
        assert_near(pixel_of(&result, LAYER_POSITION, i, 3)[0], (i + 0.5) / 32 * 3 - 1.5, ROUNDING_METRES);
    }
    frame_result_finish(&result);
}

/* Stored samples: what they hold to the size of a cell. */
TEST_LONG(sampled_structures_have_layers_too)
{
    struct fixture *fixture = *state;
    const float c = cosf(0.3f), s = sinf(0.3f);
    const float at[12] = {c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, -1}, normal[3] = {s, 0, c}, middle[3] = {0, 0, -1};
    struct scene_material *red = fixture_material(fixture);
    memcpy(red->value.base_colour, (float[4]){0.5f, 0.25f, 0.125f, 1}, sizeof(red->value.base_colour));
    uint32_t material = red->base.id;
    fixture_square(fixture, 5, material, at);
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.tracer_options.ldc.resolution = fixture->request.tracer_options.abuffer.resolution = 256;
    for (unsigned tracer = TRACER_LDC; tracer <= TRACER_ABUFFER; tracer++) {
        fixture->request.tracing.tracer = tracer;
        expect_plane(fixture, normal, middle, 10.0 / 256); /* a cell */
        struct frame_result result = render(fixture, BIT(LAYER_ALBEDO) | BIT(LAYER_ID));
        float node = tracer == TRACER_ABUFFER ? (float)(fixture->next_id - 1) : 0; /* cubes do not know it */
        for (uint32_t i = 0; i < 32; i++) {
            const float *albedo = pixel_of(&result, LAYER_ALBEDO, i, 31 - i);
            const float *id = pixel_of(&result, LAYER_ID, i, i);
            for (int k = 0; k < 3; k++)
                assert_near(albedo[k], 0.5 / (1 << k), 1.0 / 255); /* a stored colour's step */
            assert_true(id[0] == node && id[1] == (float)material && id[3] == 1);
        }
        frame_result_finish(&result);
    }
}

TEST(albedo_is_the_textures_colour_and_covers_what_is_seen)
{
    struct fixture *fixture = *state;
    static const uint8_t texels[4][4] = {
        {255, 0, 0, 255}, {0, 255, 0, 255}, {0, 0, 255, 255}, {51, 102, 204, 255}};
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->value.width = texture->value.height = 2;
    texture->value.format = TEXTURE_RGBA8_LINEAR;
    texture->value.nearest = true;
    texture->texels = fixture_blob(texels, sizeof(texels));
    uint32_t image = texture->base.id;
    struct scene_material *material = fixture_material(fixture);
    material->value.metallic = 1;
    material->value.base_colour[0] = 0.5f;
    use_texture(material, MATERIAL_BASE_COLOUR, image);
    fixture_square(fixture, 1, material->base.id, NULL);
    for (uint32_t samples = 1; samples <= 16; samples *= 16) {
        fixture->request.sampling.samples = samples;
        struct frame_result result = render(fixture, BIT(LAYER_ALBEDO));
        /* The square is 2 of 3.09 m: pixels 6 to 26, whose neighbours a sample's filter reaches. */
        for (uint32_t quarter = 0; quarter < 4; quarter++) {
            const float *colour = pixel_of(&result, LAYER_ALBEDO, quarter & 1 ? 21 : 11, quarter & 2 ? 21 : 11);
            for (int k = 0; k < 3; k++)
                assert_near(colour[k], texels[quarter][k] / 255.0 * (k ? 1 : 0.5), 1e-5);
            assert_near(colour[3], 1, 1e-6);
        }
        const float *outside = pixel_of(&result, LAYER_ALBEDO, 1, 16);
        assert_true(outside[0] == 0 && outside[1] == 0 && outside[2] == 0 && outside[3] == 0);
        const float *edge = pixel_of(&result, LAYER_ALBEDO, 5, 11);
        if (samples > 1) {
            assert_true(edge[3] > 0 && edge[3] < 1);
            assert_near(edge[0] / edge[3], 0.5, 1e-5);
        }
        frame_result_finish(&result);
    }
}

/* The surface that lets light through is the one that is met. */
TEST(glass_and_what_is_blended_is_what_is_seen)
{
    struct fixture *fixture = *state;
    const float behind[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1};
    struct scene_material *veil = fixture_material(fixture);
    veil->value.alpha_mode = ALPHA_BLEND;
    memcpy(veil->value.base_colour, (float[4]){0.25f, 0.5f, 0.75f, 0.125f}, sizeof(veil->value.base_colour));
    uint32_t material = veil->base.id;
    fixture_square(fixture, 5, 0, behind);
    fixture_square(fixture, 5, material, NULL);
    struct frame_result result = render(fixture, ALL);
    const float *albedo = pixel_of(&result, LAYER_ALBEDO, 16, 16);
    assert_true(albedo[0] == 0.25f && albedo[1] == 0.5f && albedo[2] == 0.75f && albedo[3] == 1);
    assert_near(pixel_of(&result, LAYER_DEPTH, 16, 16)[0], 5, ROUNDING_METRES);
    assert_true(pixel_of(&result, LAYER_ID, 16, 16)[1] == (float)material);
    frame_result_finish(&result);
}

static void expect_id(const struct frame_result *result, uint32_t x, uint32_t node, uint32_t material, float there)
{
    const float *id = pixel_of(result, LAYER_ID, x, 16);
    if (!(id[0] == (float)node && id[1] == (float)material && id[2] == 0 && id[3] == there))
        fail_msg("column %u: node %g, material %g, %g, %g; expected %u, %u, 0, %g", x, (double)id[0],
                 (double)id[1], (double)id[2], (double)id[3], node, material, (double)there);
}

/* A square, a sphere and a disc side by side, and nothing; the first material goes, and another gets its place. */
TEST(identifiers_are_the_clients)
{
    struct fixture *fixture = *state;
    const float left[12] = {0.5f, 0, 0, -1, 0, 0.5f, 0, 0, 0, 0, 1, 0};
    uint32_t materials[3];
    for (int i = 0; i < 3; i++)
        materials[i] = fixture_material(fixture)->base.id;
    fixture_square(fixture, 1, materials[0], left);
    uint32_t square_node = fixture->next_id - 1, square = square_node - 1;
    fixture_sphere(fixture, 0, 0, 0, 0.3f, materials[1]);
    uint32_t sphere_node = fixture->next_id - 1;
    struct scene_disc *disc = &fixture_edit(fixture, OBJECT_DISC)->set.disc;
    disc->base.id = fixture->next_id++;
    disc->value.material = materials[2];
    disc->value.normal_world[2] = 1;
    disc->value.centre_world[0] = 1;
    disc->value.radius = 0.4f;
    fixture_commit(fixture);
    const unsigned tracers[] = {TRACER_BVH, TRACER_NAIVE, TRACER_BVH};
    for (int i = 0; i < 3; i++) {
        fixture->request.tracing.tracer = tracers[i];
        fixture->request.tracing.primary = i == 2 ? PRIMARY_TRACE : PRIMARY_RASTER;
        fixture->request.sampling.samples = i == 2 ? 4 : 1;
        struct frame_result result = render(fixture, BIT(LAYER_ID));
        expect_id(&result, 5, square_node, materials[0], 1);
        expect_id(&result, 16, sphere_node, materials[1], 1);
        expect_id(&result, 26, 0, materials[2], 1);
        if (fixture->request.sampling.samples == 1)
            expect_id(&result, 31, 0, 0, 0);
        frame_result_finish(&result);
    }
    /* Nodes are removed before the objects that they show. */
    const struct scene_edit removed[] = {{.object = OBJECT_NODE, .id = square_node},
                                         {.object = OBJECT_MESH, .id = square},
                                         {.object = OBJECT_MATERIAL, .id = materials[0]}};
    for (int i = 0; i < 3; i++) {
        struct scene_edit *edit = fixture_edit(fixture, removed[i].object);
        *edit = removed[i];
        edit->kind = EDIT_REMOVE;
    }
    fixture_commit(fixture);
    uint32_t fresh = fixture_material(fixture)->base.id;
    fixture_square(fixture, 1, fresh, left);
    square_node = fixture->next_id - 1;
    struct frame_result result = render(fixture, BIT(LAYER_ID));
    expect_id(&result, 5, square_node, fresh, 1);
    expect_id(&result, 16, sphere_node, materials[1], 1);
    frame_result_finish(&result);
}

/* A ball on a floor: the layer holds what the integrator of that name shows, where something is. */
TEST_LONG(openness_is_that_of_the_integrator_ao)
{
    struct fixture *fixture = *state;
    const float floor[12] = {1, 0, 0, 0, 0, 0, 1, -0.5f, 0, -1, 0, 0};
    fixture_square(fixture, 3, 0, floor);
    fixture_sphere(fixture, 0, 0, 0, 0.5f, 0);
    fixture_set_camera(fixture, 0, 2, 4, 0.7f);
    fixture->request.sampling.samples = 2;
    fixture->request.light.ao_distance = 1.5f;
    fixture->request.light.ao_rays = 24;
    for (int falloff = 0; falloff < 2; falloff++) {
        fixture->request.tracing.tracer = TRACER_BVH;
        fixture->request.light.ao_falloff = (float)falloff;
        fixture->request.light.integrator = INTEGRATOR_AO;
        struct frame_result result = render(fixture, BIT(LAYER_BEAUTY) | BIT(LAYER_AO));
        double minimum = 1, sum = 0;
        uint32_t compared = 0;
        for (uint32_t i = 0; i < 32 * 32; i++) {
            const float *open_share = pixel_of(&result, LAYER_AO, i % 32, i / 32);
            const float *shown = pixel_of(&result, LAYER_BEAUTY, i % 32, i / 32);
            if (open_share[3] < 1)
                continue;
            for (int k = 0; k < 3; k++)
                assert_near(open_share[k], shown[k], 1e-6); /* same rays, summed in another order */
            minimum = fmin(minimum, (double)open_share[0]);
            sum += (double)open_share[0];
            compared++;
        }
        assert_true(compared > 300 && compared < 32 * 32);
        assert_true(minimum < 0.5 && sum / compared > 0.7); /* dark below the ball, open elsewhere */
        frame_result_finish(&result);
    }
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    struct frame_result result = render(fixture, BIT(LAYER_AO));
    assert_true(pixel_of(&result, LAYER_AO, 16, 0)[3] == 0); /* nothing is seen there, and it is not open either */
    assert_true(pixel_of(&result, LAYER_AO, 16, 0)[0] == 0);
    frame_result_finish(&result);
}

static void expect_attached(const struct frame_result *result, const struct frame_result *layers)
{
    const size_t count = (size_t)result->width * result->height;
    bool has_depth = result->attachments & 1u << ATTACHMENT_DEPTH,
         has_normals = result->attachments & 1u << ATTACHMENT_NORMALS;
    const uint8_t *depths = has_depth ? frame_result_attachment(result, ATTACHMENT_DEPTH) : NULL;
    const uint8_t *normals = has_normals ? frame_result_attachment(result, ATTACHMENT_NORMALS) : NULL;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t x = i % result->width, y = i / result->width;
        const float *n = pixel_of(layers, LAYER_NORMAL, x, y);
        if (has_depth)
            assert_memory_equal(depths + (size_t)4 * i, pixel_of(layers, LAYER_DEPTH, x, y), 4);
        double length = sqrt(dot(n, n));
        for (int k = 0; k < 3 && has_normals; k++) /* compared to the nearest step */
            assert_near(normals[4 * i + (uint32_t)k], n[3] > 0 ? ((double)n[k] / length / 2 + 0.5) * 255 : 0,
                        0.51);
        if (has_normals)
            assert_int_equal(normals[4 * i + 3], n[3] > 0 ? 255 : 0);
    }
}

TEST(attachments_are_those_layers_beside_a_picture_that_stays_as_it_is)
{
    struct fixture *fixture = *state;
    add_glass(fixture);
    fixture_set_camera(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.sampling.samples = 3;
    struct frame_result layers = render(fixture, BIT(LAYER_NORMAL) | BIT(LAYER_DEPTH));
    fixture->request.picture.layers = 0;
    for (int format = PIXEL_FORMAT_RGBA8; format <= PIXEL_FORMAT_RGBA32F; format++) {
        fixture->request.picture.format = (enum pixel_format)format;
        fixture->request.attachments = 0;
        struct frame_result alone = fixture_render(fixture);
        for (uint32_t attachments = 1; attachments <= 3; attachments++) {
            fixture->request.attachments = attachments;
            struct frame_result result = fixture_render(fixture);
            assert_int_equal(result.attachments, attachments);
            assert_int_equal(result.layers, BIT(LAYER_BEAUTY));
            assert_int_equal(result.size_bytes, alone.size_bytes);
            assert_memory_equal(result.pixels, alone.pixels, alone.size_bytes);
            expect_attached(&result, &layers);
            frame_result_finish(&result);
        }
        frame_result_finish(&alone);
    }
    /* The first sample's depth stays where others are added. */
    fixture->request.sampling.accumulate = true;
    fixture->request.sampling.samples = 1;
    for (int pass = 0; pass < 3; pass++) {
        struct frame_result result = fixture_render(fixture);
        assert_int_equal(result.samples, pass + 1);
        if (pass == 2)
            expect_attached(&result, &layers);
        frame_result_finish(&result);
    }
    frame_result_finish(&layers);
}

/* Whatever the slices, and how often they are done again: the picture is what it is alone, and so are the layers.
 */
TEST_LONG(neither_the_picture_nor_the_layers_depend_on_each_other)
{
    struct fixture *fixture = *state;
    const size_t plane_bytes = 32 * 32 * 16;
    add_glass(fixture);
    fixture_set_camera(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    fixture->request.sampling.samples = 3;
    fixture->request.tracing.tracer = TRACER_BVH;
    for (int integrator = INTEGRATOR_WHITTED; integrator <= INTEGRATOR_PATH; integrator++) {
        fixture->request.light.integrator = (enum integrator_kind)integrator;
        frame_renderer_set_capacity(fixture->renderer, 0, 0);
        struct frame_result alone = render(fixture, 0), together = render(fixture, ALL);
        struct frame_result beside = render(fixture, ALL & ~BIT(LAYER_BEAUTY));
        assert_memory_equal(together.pixels, alone.pixels, plane_bytes);
        assert_memory_equal(together.pixels + plane_bytes, beside.pixels, beside.size_bytes);
        if (integrator !=
            INTEGRATOR_RAYCAST) /* which sees through all surfaces: those behind are in Cryptomatte, too */
            assert_int_equal(beside.secondary_rays, 0);
        frame_renderer_set_capacity(fixture->renderer, 256,
                                    257); /* overflows in glass, which makes two rays of one */
        struct frame_result cut = render(fixture, ALL);
        assert_true(integrator != INTEGRATOR_WHITTED || cut.splits > 0);
        assert_memory_equal(cut.pixels, together.pixels, cut.size_bytes);
        frame_result_finish(&alone);
        frame_result_finish(&together);
        frame_result_finish(&beside);
        frame_result_finish(&cut);
    }
}

TEST_LONG(frames_that_go_on_hold_what_one_of_all_samples_does)
{
    struct fixture *fixture = *state;
    add_mirrors(fixture);
    fixture_set_camera(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.sampling.accumulate = true;
    fixture->request.sampling.samples = 6;
    struct frame_result at_once = render(fixture, ALL), last = {0};
    assert_int_equal(at_once.samples, 6);
    fixture->request.sampling.seed = 1; /* begins anew */
    struct frame_result other = render(fixture, ALL);
    fixture->request.sampling.seed = 0;
    fixture->request.sampling.samples = 2;
    for (int i = 0; i < 3; i++) {
        frame_result_finish(&last);
        last = render(fixture, ALL);
    }
    assert_int_equal(last.samples, 6);
    assert_memory_equal(last.pixels, at_once.pixels, at_once.size_bytes);
    struct frame_result fewer =
        render(fixture, BIT(LAYER_BEAUTY)); /* the layers that it would continue from are incomplete */
    assert_int_equal(fewer.samples, 2);
    frame_result_finish(&at_once);
    frame_result_finish(&other);
    frame_result_finish(&last);
    frame_result_finish(&fewer);
}

/* Through a lens the first sample is still one place: depth and position agree. */
TEST(places_agree_with_depths_through_a_lens)
{
    struct fixture *fixture = *state;
    add_mirrors(fixture);
    fixture_set_camera(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.sampling.samples = 8;
    fixture->request.aperture = 0.2f;
    struct frame_result result = render(fixture, BIT(LAYER_DEPTH) | BIT(LAYER_POSITION));
    const float *m = fixture->request.camera.world_from_view;
    uint32_t seen = 0;
    for (uint32_t i = 0; i < 32 * 32; i++) {
        const float *depth = pixel_of(&result, LAYER_DEPTH, i % 32, i / 32);
        const float *place = pixel_of(&result, LAYER_POSITION, i % 32, i / 32);
        assert_true(depth[3] == place[3] && (depth[3] == 0 || depth[3] == 1));
        const float from_eye[3] = {place[0] - m[3], place[1] - m[7], place[2] - m[11]};
        const float backwards[3] = {m[2], m[6], m[10]};
        if (depth[3] == 1) {
            assert_near(depth[0], -dot(from_eye, backwards), ROUNDING_METRES);
            seen++;
        }
    }
    assert_true(seen > 300);
    frame_result_finish(&result);
}

TEST(layers_that_there_are_not_or_no_pixel_holds_are_refused)
{
    struct fixture *fixture = *state;
    fixture->request.picture.layers = BIT(15);
    fixture_expect_no_layers(fixture, "number 15");
    fixture->request.picture.layers = BIT(LAYER_DEPTH);
    fixture->request.picture.format = PIXEL_FORMAT_RGBA16F;
    fixture_expect_no_layers(fixture, "rgba32f");
    fixture->request.picture.layers = BIT(LAYER_BEAUTY);
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.size_bytes, 32 * 32 * 8);
    frame_result_finish(&result);
}
