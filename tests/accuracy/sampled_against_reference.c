/* SPDX-License-Identifier: MIT */
/* Tracers that sample against the reference, at the resolution that is their default: on whole pictures, and on
 * the same waves of secondary rays. They are held to the size of a cell and to what can be seen, not to rounding.
 * Each test prints what it measured. FARLIGHT_TEST_PICTURES=folder keeps the pictures. */
#include "tests/accuracy/against_reference.h"

#include "render/frame_state.h"
#include "tests/harness/test.h"

#define AO_RAYS 64u

/* Of secondary rays that two tracers answered. */
struct agreement {
    uint64_t rays;
    double agreed;       /* the share of them for which both have a hit, or none */
    double median_cells; /* of differences of distances, in the worst wave */
    double max_cells;    /* what 99 in 100 of them are below, in the worst wave */
};

/* What is asked of each: of pictures in dB, and of rays. */
enum picture_kind { CLOSED, HOLES, OCCLUSION, PICTURE_KINDS };
static const struct row {
    const char *name;
    unsigned tracer;
    struct tracer_options options;
    uint32_t depth;  /* of rays that are compared */
    unsigned search; /* of abuffer, whose structure is the same for each */
    /* Whether there is a hole is decided for a cell as a whole, so its rims are a cell's steps, and each of many
     * rims shows. What has holes is no body. 0: not asked. */
    double psnr_min[PICTURE_KINDS];
    /* By planes of samples, one in 100 distances is off where a surface bends within a texel; dda holds what it
     * finds against triangles, and is off by what floats round but for the rays that meet none, fewer than one in
     * 100. */
    struct agreement rays;
} rows[] = {
    {"ldc",
     TRACER_LDC,
     {.ldc = {.resolution = 1024}},
     5,
     0,
     {38, 34, 0},
     {.agreed = 0.99, .median_cells = 0.25, .max_cells = INFINITY}},
    {"abuffer, dda",
     TRACER_ABUFFER,
     {.abuffer = {.search = ABUFFER_SEARCH_DDA}},
     3,
     ABUFFER_SEARCH_DDA,
     {36, 34, 34},
     {.agreed = 0.995, .median_cells = 0.1, .max_cells = 0.01}},
    {"abuffer, linear3",
     TRACER_ABUFFER,
     {.abuffer = {.search = ABUFFER_SEARCH_DDA}},
     3,
     ABUFFER_SEARCH_LINEAR3,
     {36, 34, 34},
     {.agreed = 0.995, .median_cells = 0.1, .max_cells = 0.1}},
};
enum { ROWS = sizeof(rows) / sizeof(rows[0]) };

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* The structure that was built for an earlier row serves this one too. */
static void use_search(struct fixture *fixture, const struct row *row)
{
    struct tracer_set *set = &fixture->shared->tracers;
    for (size_t i = 0; i < sizeof(set->slots) / sizeof(set->slots[0]); i++)
        if (set->slots[i].tracer && set->slots[i].impl == tracer_impl_by_number(TRACER_ABUFFER))
            set->slots[i].tracer->options.abuffer.search = row->search;
}

/* ---- pictures ---- */

static struct frame_result render(struct fixture *fixture, unsigned tracer, const struct row *row,
                                  const char *name)
{
    char kept[128];
    fixture->request.tracer = tracer;
    fixture->request.tracer_options = row->options;
    use_search(fixture, row);
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
        if (asked == 0)
            continue;
        struct frame_result got = render(fixture, row->tracer, row, name);
        double reached = psnr(&got, &expected);
        printf("%s, %s: PSNR %.1f dB\n", name, row->name, reached);
        assert_int_equal(structure_row(&got.structure, "static/samples_lost").number, 0); /* of ldc */
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
        fixture->request.samples = scenes[i].samples;
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
    fixture_look(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    request->width = request->height = SIDE / 2;
    request->format = PIXEL_FORMAT_RGBA8;
    request->integrator = INTEGRATOR_AO;
    request->samples = 1;
    request->ao_rays = AO_RAYS;
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
        fixture->edits[fixture->edit_count - 1].set.mesh.closed = false;
        turned(m, 0.7f, 0.4f * (float)i, 1.3f * (float)(i - 1), -0.4f, 0.3f * (float)(i - 1) - 0.6f);
        fixture_node(fixture, NODE_MESH, mesh, m);
    }
    expect_occlusion_like_the_references(fixture, "occlusion in a corner");
}

/* Metres; lights belong to it. */
static float scene_diagonal(struct fixture *fixture)
{
    struct gpu_scene gpu;
    struct scene_changes changes;
    struct error error = {0};
    gpu_scene_init(&gpu, fixture->device);
    assert_true(gpu_scene_update(&gpu, fixture->scene, NULL, &changes, NULL, &error));
    const float diagonal = gpu.diagonal;
    gpu_scene_finish(&gpu);
    return diagonal;
}

/* ---- rays ---- */

/* As a small picture says it. */
static float metres_of_a_cell(struct fixture *fixture, unsigned tracer)
{
    fixture->request.tracer = tracer;
    fixture->request.width = fixture->request.height = 16;
    struct frame_result result = fixture_render(fixture);
    fixture->request.width = fixture->request.height = SIDE;
    const float cell_metres =
        structure_row(&result.structure, tracer == TRACER_LDC ? "static/cell" : "cell").measure;
    frame_result_finish(&result);
    assert_true(cell_metres > 0);
    return cell_metres;
}

/* The reference's own waves, its secondary rays answered by another tracer too. */
static struct agreement compare_rays(struct fixture *fixture, const struct row *row, const char *name)
{
    fixture->request.tracer_options = row->options;
    fixture->request.depth = row->depth;
    use_search(fixture, row);
    const float cell_metres = metres_of_a_cell(fixture, row->tracer);
    const double cells = (double)(scene_diagonal(fixture) / cell_metres); /* errors come in diagonals */
    fixture->request.tracer = exact_tracer();
    fixture->request.compare = true;
    fixture->request.compare_with = row->tracer;
    struct frame_result result = fixture_render(fixture);
    fixture->request.compare = false;
    struct agreement found = {0};
    uint64_t disagreed = 0, compared = 0;
    for (uint32_t i = 0; i < result.comparison_count; i++) {
        const struct wave_comparison *wave = &result.comparisons[i];
        static const char *const kinds[] = {"primary", "secondary", "shadow"};
        uint64_t apart = wave->only_first + wave->only_second;
        double agreed = 1 - (double)apart / (double)(wave->rays ? wave->rays : 1);
        double median_cells = (double)wave->distance_median * cells,
               max_cells = (double)wave->distance_p99 * cells;
        printf("%s, wave %u, %s: %llu rays, %.3f %% agree on hit or miss, median distance %.4f cells, 99 %% below "
               "%.3f\n",
               name, wave->wave, kinds[wave->kind], (unsigned long long)wave->rays, 100 * agreed, median_cells,
               max_cells);
        if (wave->kind != RAY_SECONDARY)
            continue;
        found.rays += wave->rays;
        disagreed += apart;
        if (wave->both_hit > 100) {
            found.median_cells = fmax(found.median_cells, median_cells);
            found.max_cells = fmax(found.max_cells, max_cells);
            compared++;
        }
    }
    frame_result_finish(&result);
    assert_in_range(found.rays, SIDE * SIDE / 20, UINT64_MAX); /* else nothing would have been shown */
    assert_true(compared > 0);
    found.agreed = 1 - (double)disagreed / (double)found.rays;
    return found;
}

static void expect_agreement(const char *name, const struct agreement *found, const struct agreement *asked)
{
    if (!(found->agreed >= asked->agreed))
        fail_msg("%s: %.3f %% of %llu rays agree on hit or miss", name, 100 * found->agreed,
                 (unsigned long long)found->rays);
    if (!(found->median_cells <= asked->median_cells))
        fail_msg("%s: the median distance is %.3f cells off", name, found->median_cells);
    if (!(found->max_cells <= asked->max_cells))
        fail_msg("%s: one in 100 distances is %.3f cells off", name, found->max_cells);
}

/* Shapes as mirrors and then as glass, two of each so that there is something to be mirrored. Only the material is
 * edited: what samples shapes is built once for both. */
TEST_LONG(secondary_rays_agree_with_the_reference)
{
    struct fixture *fixture = *state;
    static const struct {
        const char *name;
        enum shape shape;
        uint32_t steps;
    } shapes[] = {{"a torus", SHAPE_TORUS, 128}, {"a bumpy sphere", SHAPE_BUMPY, 224}};
    for (size_t i = 0; i < sizeof(shapes) / sizeof(shapes[0]); i++) {
        fixture_clear(state);
        const uint32_t id = add_mirror(fixture, 1.0f, 1.0f, 1.0f);
        add_shape(fixture, shapes[i].shape, shapes[i].steps, id, 1, 0.4f, -0.9f, 0, 0);
        add_shape(fixture, shapes[i].shape, shapes[i].steps, id, 1, 1.1f, 0.95f, 0.2f, 0.4f);
        fixture_light(fixture, LIGHT_POINT, 2.5f, 4, 3, 300);
        request_picture(fixture, 5);
        fixture_look(fixture, 1.5f, 2.2f, 4.5f, 0.7f);
        for (int inside = 0; inside < 2; inside++) {
            if (inside) {
                struct scene_material *material = &fixture_edit(fixture, OBJECT_MATERIAL)->set.material;
                *material = *scene_material(fixture->scene, id);
                material->metallic = 0.0f;
                material->transmission = 1.0f;
                material->ior = 1.5f;
            }
            for (const struct row *row = rows; row < rows + ROWS; row++) {
                char name[96];
                snprintf(name, sizeof(name), "%s%s, %s", shapes[i].name, inside ? " of glass" : "", row->name);
                const struct agreement found = compare_rays(fixture, row, name);
                expect_agreement(name, &found, &row->rays);
            }
        }
    }
}
