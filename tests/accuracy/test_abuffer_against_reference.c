/* SPDX-License-Identifier: MIT */
/* The tracer `abuffer` against the reference, at the resolution that is its default and with each search: on the
 * same waves of secondary rays, and on whole pictures. It samples, so it is held to the size of a cell and to what
 * can be seen, not to rounding. What is primary is rasterised in both pictures, as in every frame without a lens.
 *
 * Models are those of the folder FARLIGHT_SCENES. Each test prints what it measured. FARLIGHT_TEST_PICTURES=folder
 * keeps the pictures. */
#include "ldc_scenes.h"

#include "tests/bench/load_model.h"
#include "trace/tracer.h"

#include <unistd.h>

#define BVH 0
#define REFERENCE 2
#define ABUFFER 4
#define SIDE 192u
#define AO_RAYS 128u

enum { DDA, LINEAR3, LINEAR1, SEARCH_COUNT };
static const struct search {
    const char *name;
    struct tracer_options options;
} searches[SEARCH_COUNT] = {
    [DDA] = {"dda", {.abuffer_search = ABUFFER_SEARCH_DDA}},
    [LINEAR3] = {"linear3", {.abuffer_search = ABUFFER_SEARCH_LINEAR3}},
    [LINEAR1] = {"linear1", {.abuffer_search = ABUFFER_SEARCH_LINEAR1}},
};

static unsigned exact_tracer; /* the reference, or bvh where a build leaves it out: their hits are the same */

/* ---- pictures ---- */

static double psnr(const struct frame_result *a, const struct frame_result *b)
{
    double sum = 0, count = 0;
    assert_int_equal(a->size_bytes, b->size_bytes);
    for (size_t i = 0; i < a->size_bytes; i++) {
        if (i % 4 == 3)
            continue;
        double difference = (double)a->pixels[i] - (double)b->pixels[i];
        sum += difference * difference;
        count++;
    }
    return sum > 0 ? 10 * log10(255.0 * 255.0 * count / sum) : INFINITY;
}

static struct frame_result render(struct fixture *fixture, unsigned tracer, const struct tracer_options *options,
                                  const char *name)
{
    char kept[128];
    fixture->request.tracer = tracer;
    fixture->request.tracer_options = *options;
    struct frame_result result = fixture_render(fixture);
    snprintf(kept, sizeof(kept), "abuffer_%s_%u_%u", name, tracer, (unsigned)options->abuffer_search);
    fixture_keep(&result, kept);
    return result;
}

static void expect_like_the_reference(struct fixture *fixture, const char *name,
                                      const double psnr_min[SEARCH_COUNT])
{
    struct frame_result expected = render(fixture, exact_tracer, &searches[0].options, name);
    for (int i = 0; i < SEARCH_COUNT; i++) {
        struct frame_result got = render(fixture, ABUFFER, &searches[i].options, name);
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
    struct frame_request *request = &fixture->request;
    add(fixture);
    request->width = request->height = SIDE;
    request->format = FRAME_RGBA8;
    request->depth = 3;
    fixture_look(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    expect_like_the_reference(fixture, name, psnr_min);
}

/* Of closed shapes: the 36 dB that are asked of dda are asked of steps too. */
static const double closed_min[SEARCH_COUNT] = {36, 36, 36};

static void mirrors_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_mirrors, "mirrors", closed_min);
}

static void textures_in_a_mirror_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_textured, "textures in a mirror", closed_min);
}

static void every_sort_of_texture_is_applied(void **state)
{
    expect_scene_like_the_reference(*state, add_every_texture, "every texture", closed_min);
}

static void glass_is_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_glass, "glass", closed_min);
}

static void spheres_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_spheres, "spheres", closed_min);
}

/* Whether there is a hole is decided for a cell as a whole, so its rims are a cell's steps, and each of many rims
 * shows. What has holes is no body. */
static void cutouts_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_cutout, "cutouts over a mirror", (const double[]){34, 34, 34});
}

/* ---- ambient occlusion ---- */

static void expect_occlusion_like_the_references(struct fixture *fixture, const char *name,
                                                 const double psnr_min[SEARCH_COUNT])
{
    struct frame_request *request = &fixture->request;
    request->width = request->height = SIDE / 2;
    request->format = FRAME_RGBA8;
    request->integrator = INTEGRATOR_AO;
    request->samples = 1;
    request->ao_rays = AO_RAYS;
    expect_like_the_reference(fixture, name, psnr_min);
}

/* The 34 dB that are asked of dda are asked of steps too. */
static const double occlusion_min[SEARCH_COUNT] = {34, 34, 34};

static void occlusion_of_closed_shapes_is_like_the_references(void **state)
{
    struct fixture *fixture = *state;
    add_mirrors(fixture);
    fixture_look(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
    expect_occlusion_like_the_references(fixture, "occlusion", occlusion_min);
}

/* A corner of a room, and in it what is not closed either: nothing has an inside. */
static void occlusion_of_open_shapes_is_like_the_references(void **state)
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
    struct scene_gpu gpu;
    struct scene_changes changes;
    struct error error = {0};
    float target[3], eye[3];
    scene_gpu_init(&gpu, fixture->device);
    assert_true(scene_gpu_update(&gpu, fixture->scene, NULL, &changes, NULL, &error));
    for (int k = 0; k < 3; k++) {
        static const float from[3] = {0.3f, 0.35f, 0.9f};
        target[k] = 0.5f * (gpu.lower_world[k] + gpu.upper_world[k]);
        eye[k] = target[k] + 1.1f * gpu.diagonal * from[k];
    }
    assert_true(frame_camera_look_at(&fixture->request.camera, eye, target, (const float[]){0, 1, 0}, 0.8f));
    scene_gpu_finish(&gpu);
}

static void occlusion_of_models_is_like_the_references(void **state)
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

/* What is asked: share of rays that agree on hit or miss, median of distances in cells, and below what 99 in 100
 * of them are. By planes of samples that is where a surface bends within a texel; dda holds what it finds against
 * triangles, and is off by what floats round but for the rays that meet none, fewer than one in 100. */
static const struct {
    double agreed_min, cells_max, most_cells_max[SEARCH_COUNT];
} rays_asked = {0.995, 0.1, {[DDA] = 0.01, [LINEAR3] = 0.1, [LINEAR1] = 0.1}};

/* The reference's own waves, its secondary rays answered by `abuffer` too. */
static void expect_rays_agree(struct fixture *fixture, const char *name, int search, float cell_metres,
                              double diagonal)
{
    fixture->request.tracer = exact_tracer;
    fixture->request.tracer_options = searches[search].options;
    fixture->request.compare = true;
    fixture->request.compare_with = ABUFFER;
    struct frame_result result = fixture_render(fixture);
    uint64_t rays = 0, disagreed = 0, compared = 0;
    double worst_median = 0, worst_most = 0;
    for (uint32_t i = 0; i < result.comparison_count; i++) {
        const struct wave_comparison *wave = &result.comparisons[i];
        static const char *const kinds[] = {"primary", "secondary", "shadow"};
        double agreed = 1 - (double)(wave->only_first + wave->only_second) / (double)(wave->rays ? wave->rays : 1);
        double median_cells = (double)wave->distance_median * diagonal / (double)cell_metres;
        double most_cells = (double)wave->distance_p99 * diagonal / (double)cell_metres;
        printf("%s, %s, wave %u, %s: %llu rays, %.3f %% agree on hit or miss, median distance %.4f cells, 99 %% "
               "below %.3f\n",
               name, searches[search].name, wave->wave, kinds[wave->kind], (unsigned long long)wave->rays,
               100 * agreed, median_cells, most_cells);
        if (wave->kind != RAY_SECONDARY)
            continue;
        rays += wave->rays;
        disagreed += wave->only_first + wave->only_second;
        if (wave->both_hit > 100) {
            worst_median = fmax(worst_median, median_cells);
            worst_most = fmax(worst_most, most_cells);
            compared++;
        }
    }
    frame_result_finish(&result);
    assert_in_range(rays, SIDE * SIDE / 20, UINT64_MAX); /* else nothing would have been shown */
    assert_true(compared > 0);
    double agreed = 1 - (double)disagreed / (double)rays;
    if (!(agreed >= rays_asked.agreed_min))
        fail_msg("%s, %s: %.3f %% of %llu rays agree on hit or miss", name, searches[search].name, 100 * agreed,
                 (unsigned long long)rays);
    if (!(worst_median <= rays_asked.cells_max))
        fail_msg("%s, %s: the median distance is %.3f cells off", name, searches[search].name, worst_median);
    if (!(worst_most <= rays_asked.most_cells_max[search]))
        fail_msg("%s, %s: one in 100 distances is %.3f cells off", name, searches[search].name, worst_most);
    fixture->request.compare = false;
}

static void secondary_rays_agree_with_the_reference(void **state)
{
    struct fixture *fixture = *state;
    static const struct {
        const char *name;
        enum shape shape;
        uint32_t steps;
    } rows[] = {
        {"a sphere", SHAPE_SPHERE, 128}, {"a torus", SHAPE_TORUS, 128}, {"a bumpy sphere", SHAPE_BUMPY, 224}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        for (int inside = 0; inside < 2; inside++) {
            char name[64];
            fixture_clear(state);
            struct scene_material *material = fixture_material(fixture);
            uint32_t id = material->base.id;
            material->roughness = 0.05f;
            material->metallic = inside ? 0.0f : 1.0f;
            material->transmission = inside ? 1.0f : 0.0f;
            material->ior = 1.5f;
            /* Two of them, so that there is something to be mirrored. */
            add_shape(fixture, rows[i].shape, rows[i].steps, id, 1, 0.4f, -0.9f, 0, 0);
            add_shape(fixture, rows[i].shape, rows[i].steps, id, 1, 1.1f, 0.95f, 0.2f, 0.4f);
            fixture_light(fixture, LIGHT_POINT, 2.5f, 4, 3, 300);
            fixture_look(fixture, 1.5f, 2.2f, 4.5f, 0.7f);
            snprintf(name, sizeof(name), "%s%s", rows[i].name, inside ? " of glass" : "");
            fixture->request.width = fixture->request.height = 16; /* for the size of a cell */
            fixture->request.format = FRAME_RGBA8;
            fixture->request.depth = 3;
            struct frame_result result = render(fixture, ABUFFER, &searches[DDA].options, name);
            fixture->request.width = fixture->request.height = SIDE;
            float cell_metres = result.cubes[TRACER_CUBE_STATIC].cell_metres;
            frame_result_finish(&result);
            /* Errors come in scene diagonals; the lamp belongs to the scene. */
            struct scene_gpu gpu;
            struct scene_changes changes;
            struct error error = {0};
            scene_gpu_init(&gpu, fixture->device);
            assert_true(scene_gpu_update(&gpu, fixture->scene, NULL, &changes, NULL, &error));
            double diagonal = (double)gpu.diagonal;
            scene_gpu_finish(&gpu);
            for (int search = 0; search < SEARCH_COUNT; search++)
                expect_rays_agree(fixture, name, search, cell_metres, diagonal);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(secondary_rays_agree_with_the_reference, fixture_clear),
        cmocka_unit_test_setup(mirrors_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(textures_in_a_mirror_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(every_sort_of_texture_is_applied, fixture_clear),
        cmocka_unit_test_setup(glass_is_like_the_references, fixture_clear),
        cmocka_unit_test_setup(spheres_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(cutouts_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(occlusion_of_closed_shapes_is_like_the_references, fixture_clear),
        cmocka_unit_test_setup(occlusion_of_open_shapes_is_like_the_references, fixture_clear),
        cmocka_unit_test_setup(occlusion_of_models_is_like_the_references, fixture_clear),
    };
    exact_tracer = tracer_impl_by_number(REFERENCE) ? REFERENCE : BVH;
    return cmocka_run_group_tests_name("abuffer against the reference", tests, fixture_setup, fixture_teardown);
}
