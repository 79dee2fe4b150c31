/* SPDX-License-Identifier: MIT */
/* The tracer `abuffer` against the reference, at the resolution that is its default and with each search: on the
 * same waves of secondary rays, and on whole pictures. It samples, so it is held to the size of a cell and to what
 * can be seen, not to rounding. What is primary is rasterised in both pictures, as in every frame without a lens.
 *
 * Models are those of the folder FARLIGHT_SCENES. Each test prints what it measured. FARLIGHT_TEST_PICTURES=folder
 * keeps the pictures. */
#include "tests/accuracy/against_reference.h"

#include "tests/bench/load_model.h"
#include "tests/harness/test.h"

#include <unistd.h>

#define AO_RAYS 128u

enum { DDA, LINEAR3, LINEAR1, SEARCH_COUNT };
static const struct search {
    const char *name;
    struct tracer_options options;
} searches[SEARCH_COUNT] = {
    [DDA] = {"dda", {.abuffer = {.search = ABUFFER_SEARCH_DDA}}},
    [LINEAR3] = {"linear3", {.abuffer = {.search = ABUFFER_SEARCH_LINEAR3}}},
    [LINEAR1] = {"linear1", {.abuffer = {.search = ABUFFER_SEARCH_LINEAR1}}},
};

/* ---- pictures ---- */

static struct frame_result render(struct fixture *fixture, unsigned tracer, const struct tracer_options *options,
                                  const char *name)
{
    char kept[128];
    fixture->request.tracer = tracer;
    fixture->request.tracer_options = *options;
    struct frame_result result = fixture_render(fixture);
    snprintf(kept, sizeof(kept), "abuffer_%s_%u_%u", name, tracer, (unsigned)options->abuffer.search);
    fixture_keep(&result, kept);
    return result;
}

static void expect_like_the_reference(struct fixture *fixture, const char *name,
                                      const double psnr_min[SEARCH_COUNT])
{
    struct frame_result expected = render(fixture, exact_tracer(), &searches[0].options, name);
    for (int i = 0; i < SEARCH_COUNT; i++) {
        struct frame_result got = render(fixture, TRACER_ABUFFER, &searches[i].options, name);
        double reached = psnr(&got, &expected);
        printf("%s, %s: PSNR %.1f dB\n", name, searches[i].name, reached);
        frame_result_finish(&got);
        if (!(reached >= psnr_min[i]))
            fail_msg("%s, %s: PSNR %.2f dB, at least %.1f is asked for", name, searches[i].name, reached,
                     psnr_min[i]);
    }
    frame_result_finish(&expected);
}

/* ---- Whitted's rays ---- */

static void expect_scene_like_the_reference(struct fixture *fixture, void (*add)(struct fixture *fixture),
                                            const char *name, const double psnr_min[SEARCH_COUNT])
{
    add(fixture);
    request_picture(fixture, 3);
    expect_like_the_reference(fixture, name, psnr_min);
}

/* Of closed shapes: the 36 dB that are asked of dda are asked of steps too. */
static const double closed_min[SEARCH_COUNT] = {36, 36, 36};

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

TEST(mirrors_are_like_the_references)
{
    expect_scene_like_the_reference(*state, add_mirrors, "mirrors", closed_min);
}

TEST(textures_in_a_mirror_are_like_the_references)
{
    expect_scene_like_the_reference(*state, add_textured, "textures in a mirror", closed_min);
}

TEST(every_sort_of_texture_is_applied)
{
    expect_scene_like_the_reference(*state, add_every_texture, "every texture", closed_min);
}

TEST(glass_is_like_the_references)
{
    expect_scene_like_the_reference(*state, add_glass, "glass", closed_min);
}

TEST(spheres_are_like_the_references)
{
    expect_scene_like_the_reference(*state, add_spheres, "spheres", closed_min);
}

/* Whether there is a hole is decided for a cell as a whole, so its rims are a cell's steps, and each of many rims
 * shows. What has holes is no body. */
TEST(cutouts_are_like_the_references)
{
    expect_scene_like_the_reference(*state, add_cutout, "cutouts over a mirror", (const double[]){34, 34, 34});
}

/* ---- ambient occlusion ---- */

static void expect_occlusion_like_the_references(struct fixture *fixture, const char *name,
                                                 const double psnr_min[SEARCH_COUNT])
{
    struct frame_request *request = &fixture->request;
    request->width = request->height = SIDE / 2;
    request->format = PIXEL_FORMAT_RGBA8;
    request->integrator = INTEGRATOR_AO;
    request->samples = 1;
    request->ao_rays = AO_RAYS;
    expect_like_the_reference(fixture, name, psnr_min);
}

/* The 34 dB that are asked of dda are asked of steps too. */
static const double occlusion_min[SEARCH_COUNT] = {34, 34, 34};

TEST(occlusion_of_closed_shapes_is_like_the_references)
{
    struct fixture *fixture = *state;
    add_mirrors(fixture);
    fixture_look(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    expect_occlusion_like_the_references(fixture, "occlusion", occlusion_min);
}

/* A corner of a room, and in it what is not closed either: nothing has an inside. */
TEST(occlusion_of_open_shapes_is_like_the_references)
{
    struct fixture *fixture = *state;
    static const float walls[3][12] = {{1, 0, 0, 0, 0, 0, 1, -1, 0, -1, 0, 0},
                                       {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1.7f},
                                       {0, 0, 1, -1.9f, 0, 1, 0, 0, -1, 0, 0, 0}};
    uint32_t grey = add_matte(fixture, 0.5f, 0.5f, 0.5f);
    for (int i = 0; i < 3; i++)
        fixture_square(fixture, 3, grey, walls[i]);
    for (int i = 0; i < 3; i++) {
        float m[12];
        uint32_t mesh = add_shape_mesh(fixture, (enum shape)i, 96, grey);
        fixture->edits[fixture->edit_count - 1].set.mesh.closed = false;
        turned(m, 0.7f, 0.4f * (float)i, 1.3f * (float)(i - 1), -0.4f, 0.3f * (float)(i - 1) - 0.6f);
        fixture_node(fixture, NODE_MESH, mesh, m);
    }
    fixture_look(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    expect_occlusion_like_the_references(fixture, "occlusion in a corner", occlusion_min);
}

/* A camera that sees all of it, from a little above. */
static void look_at_all(struct fixture *fixture)
{
    struct extent extent = scene_extent(fixture);
    float target[3], eye[3];
    for (int k = 0; k < 3; k++) {
        static const float from[3] = {0.3f, 0.35f, 0.9f};
        target[k] = 0.5f * (extent.lower_world[k] + extent.upper_world[k]);
        eye[k] = target[k] + 1.1f * extent.diagonal * from[k];
    }
    assert_true(frame_camera_look_at(&fixture->request.camera, eye, target, (const float[]){0, 1, 0}, 0.8f));
}

TEST(occlusion_of_models_is_like_the_references)
{
    struct fixture *fixture = *state;
    static const char *const models[] = {"common/teapot.obj", "common/dragon-47k.glb", "common/bunny-69k.obj"};
    const char *folder = getenv("FARLIGHT_SCENES");
    if (!folder) {
        printf("FARLIGHT_SCENES names no folder of models\n");
        skip();
    }
    for (size_t i = 0; i < sizeof(models) / sizeof(models[0]); i++) {
        char path[512];
        struct loaded_model model;
        struct error error = {0};
        snprintf(path, sizeof(path), "%s/%s", folder, models[i]);
        if (access(path, R_OK) != 0) {
            printf("there is no %s\n", path);
            continue;
        }
        fixture_clear(state);
        if (!load_model(&model, path, &error))
            fail_msg("%s: %s", path, error.text);
        scene_destroy(fixture->scene);
        fixture->scene = model.scene;
        model.scene = NULL;
        look_at_all(fixture);
        expect_occlusion_like_the_references(fixture, models[i], occlusion_min);
        load_model_finish(&model);
    }
}

/* ---- rays ---- */

/* By planes of samples, one in 100 distances is off where a surface bends within a texel; dda holds what it finds
 * against triangles, and is off by what floats round but for the rays that meet none, fewer than one in 100. */
static const struct agreement rays_asked[SEARCH_COUNT] = {
    [DDA] = {.agreed = 0.995, .median_cells = 0.1, .most_cells = 0.01},
    [LINEAR3] = {.agreed = 0.995, .median_cells = 0.1, .most_cells = 0.1},
    [LINEAR1] = {.agreed = 0.995, .median_cells = 0.1, .most_cells = 0.1},
};

static void expect_rays_agree(struct fixture *fixture, const char *name, float cell_metres)
{
    for (int i = 0; i < SEARCH_COUNT; i++) {
        char searched[96];
        snprintf(searched, sizeof(searched), "%s, %s", name, searches[i].name);
        fixture->request.tracer_options = searches[i].options;
        struct agreement found = compare_rays(fixture, TRACER_ABUFFER, searched, cell_metres);
        expect_agreement(searched, &found, &rays_asked[i]);
    }
}

static void request_whitted(struct fixture *fixture)
{
    request_picture(fixture, 3);
    fixture->request.tracer_options = searches[DDA].options;
}

TEST(secondary_rays_agree_with_the_reference)
{
    with_pairs_of_shapes(state, TRACER_ABUFFER, request_whitted, expect_rays_agree);
}
