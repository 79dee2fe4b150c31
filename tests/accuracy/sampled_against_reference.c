/* SPDX-License-Identifier: MIT */
/* Whole pictures by tracers that sample against the reference, at the resolution that is their default. They are
 * held to the size of a cell and to what can be seen, not to rounding. Each test prints what it measured.
 * FARLIGHT_TEST_PICTURES=folder keeps the pictures. */
#include "tests/accuracy/against_reference.h"

#include "tests/harness/test.h"

#define AO_RAYS 64u

/* Asked of each tracer, in dB; 0: not asked. Whether there is a hole is decided for a cell as a whole, so its rims
 * are a cell's steps, and each of many rims shows. What has holes is no body. */
enum picture_kind { CLOSED, HOLES, OCCLUSION, PICTURE_KINDS };
static const struct row {
    const char *name;
    unsigned tracer;
    struct tracer_options options;
    double psnr_min[PICTURE_KINDS];
} rows[] = {
    {"ldc", TRACER_LDC, {.ldc = {.resolution = 1024}}, {38, 34, 0}},
    {.name = "abuffer", .tracer = TRACER_ABUFFER, .psnr_min = {36, 34, 34}},
};
enum { ROWS = sizeof(rows) / sizeof(rows[0]) };

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* ---- pictures ---- */

static struct frame_result render(struct fixture *fixture, unsigned tracer, const struct row *row,
                                  const char *name)
{
    char kept[128];
    fixture->request.tracing.tracer = tracer;
    fixture->request.tracer_options = row->options;
    struct frame_result result = fixture_render(fixture);
    snprintf(kept, sizeof(kept), "%s_%s", name, tracer == row->tracer ? row->name : "exact");
    fixture_keep(&result, kept);
    return result;
}

static void expect_like_the_reference(struct fixture *fixture, const char *name, enum picture_kind kind)
{
    struct frame_result expected = render(fixture, exact_tracer(), &rows[0], name);
    for (const struct row *row = rows; row < rows + ROWS; row++) {
        const double asked = row->psnr_min[kind];
        if (asked == 0 || (row > rows && !getenv("FARLIGHT_TEST_LONG"))) /* else the first alone */
            continue;
        struct frame_result got = render(fixture, row->tracer, row, name);
        double reached = psnr(&got, &expected);
        printf("%s, %s: PSNR %.1f dB\n", name, row->name, reached);
        assert_int_equal(structure_row(&got.structure, "static/samples_lost").number, 0); /* lost samples of ldc */
        frame_result_finish(&got);
        if (!(reached >= asked))
            fail_msg("%s, %s: PSNR %.2f dB, at least %.1f is asked for", name, row->name, reached, asked);
    }
    frame_result_finish(&expected);
}

/* Stored samples are filtered to a cell, which is narrower than a pixel here, and not to a ray's footprint: with
 * one sample a pixel textures alias more than exact hits, with several both tend to the same picture. */
static const struct {
    const char *name;
    void (*add)(struct fixture *fixture);
    enum picture_kind kind;
    uint32_t samples;
} scenes[] = {
    {"mirrors", add_mirrors, CLOSED, 1},
    {"textures in a mirror", add_textured, CLOSED, 4},
    {"every texture", add_every_texture, CLOSED, 1},
    {"glass", add_glass, CLOSED, 1},
    {"spheres", add_spheres, CLOSED, 1},
    {"cutouts over a mirror", add_cutout, HOLES, 1},
};

static void expect_scenes_like_the_references(struct fixture *fixture, size_t first, size_t end)
{
    for (size_t i = first; i < end; i++) {
        fixture_clear((void **)&fixture);
        scenes[i].add(fixture);
        request_picture(fixture, 5);
        fixture->request.sampling.samples = scenes[i].samples;
        expect_like_the_reference(fixture, scenes[i].name, scenes[i].kind);
    }
}

TEST(mirrors_are_like_the_references)
{
    expect_scenes_like_the_references(*state, 0, 1);
}

TEST_LONG(textures_glass_spheres_and_cutouts_are_like_the_references)
{
    expect_scenes_like_the_references(*state, 1, sizeof(scenes) / sizeof(scenes[0]));
}

/* ---- ambient occlusion ---- */

static void expect_occlusion_like_the_references(struct fixture *fixture, const char *name)
{
    struct frame_request *request = &fixture->request;
    fixture_set_camera(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    request->picture.width = request->picture.height = SIDE / 2;
    request->picture.format = PIXEL_FORMAT_RGBA8;
    request->light.integrator = INTEGRATOR_AO;
    request->sampling.samples = 1;
    request->light.ao_rays = AO_RAYS;
    expect_like_the_reference(fixture, name, OCCLUSION);
}

TEST_LONG(occlusion_of_closed_shapes_is_like_the_references)
{
    add_mirrors(*state);
    expect_occlusion_like_the_references(*state, "occlusion");
}

/* A corner of a room, and in it what is not closed either: nothing has an inside. */
TEST_LONG(occlusion_of_open_shapes_is_like_the_references)
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
        fixture->edits[fixture->edit_count - 1].set.mesh.value.closed = false;
        turned(m, 0.7f, 0.4f * (float)i, 1.3f * (float)(i - 1), -0.4f, 0.3f * (float)(i - 1) - 0.6f);
        fixture_node(fixture, NODE_MESH, mesh, m);
    }
    expect_occlusion_like_the_references(fixture, "occlusion in a corner");
}
