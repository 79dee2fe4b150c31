/* SPDX-License-Identifier: MIT */
/* The tracer `ldc` against the reference, at the resolution that is its default: on the same waves of secondary
 * rays, and on whole pictures. It samples, so it is held to the size of a cell and to what can be seen, not to
 * rounding. What is primary is rasterised in both pictures, as in every frame without a lens.
 *
 * Each test prints what it measured. FARLIGHT_TEST_PICTURES=folder keeps the pictures. */
#include "ldc_scenes.h"

#include "trace/tracer.h"

#define BVH 0
#define REFERENCE 2
#define LDC 3
#define RESOLUTION 1024u
#define SIDE 192u
/* What is asked of the tracer: share of rays that agree on hit or miss, distances in cells, and the pictures. */
#define AGREED_MIN 0.99
#define DISTANCE_CELLS_MAX 0.25
#define PSNR_MIN 38.0
#define PSNR_MIN_HOLES 34.0

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

static void request_picture(struct fixture *fixture)
{
    struct frame_request *request = &fixture->request;
    request->width = request->height = SIDE;
    request->format = FRAME_RGBA8;
    request->depth = 5;
    request->tracer_options.ldc_resolution = RESOLUTION;
    fixture_look(fixture, 1.5f, 2.2f, 5.5f, 0.7f);
}

static struct frame_result render(struct fixture *fixture, unsigned tracer, const char *name)
{
    char kept[128];
    fixture->request.tracer = tracer;
    struct frame_result result = fixture_render(fixture);
    snprintf(kept, sizeof(kept), "ldc_%s_%s", name, tracer == LDC ? "ldc" : "exact");
    fixture_keep(&result, kept);
    return result;
}

static void expect_like_the_reference(struct fixture *fixture, const char *name, double psnr_min)
{
    struct frame_result got = render(fixture, LDC, name), expected = render(fixture, exact_tracer, name);
    double reached = psnr(&got, &expected);
    printf("%s: PSNR %.1f dB\n", name, reached);
    for (int i = 0; i < TRACER_CUBES_MAX; i++)
        assert_int_equal(got.cubes[i].samples_lost, 0);
    frame_result_finish(&got);
    frame_result_finish(&expected);
    if (!(reached >= psnr_min))
        fail_msg("%s: PSNR %.2f dB, at least %.1f is asked for", name, reached, psnr_min);
}

static void expect_scene_like_the_reference(struct fixture *fixture, void (*add)(struct fixture *fixture),
                                            const char *name, double psnr_min)
{
    add(fixture);
    request_picture(fixture);
    expect_like_the_reference(fixture, name, psnr_min);
}

static void mirrors_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_mirrors, "mirrors", PSNR_MIN);
}

static void textures_in_a_mirror_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_textured, "textures in a mirror", PSNR_MIN);
}

static void every_sort_of_texture_is_stored(void **state)
{
    expect_scene_like_the_reference(*state, add_every_texture, "every texture", PSNR_MIN);
}

static void glass_is_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_glass, "glass", PSNR_MIN);
}

/* Whether there is a hole is decided for a cell as a whole, so its rims are a cell's steps, and each of many rims
 * shows. */
static void cutouts_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_cutout, "cutouts over a mirror", PSNR_MIN_HOLES);
}

static void spheres_are_like_the_references(void **state)
{
    expect_scene_like_the_reference(*state, add_spheres, "spheres", PSNR_MIN);
}

static void distributed_rays_see_what_the_references_see(void **state)
{
    struct fixture *fixture = *state;
    fixture->request.integrator = INTEGRATOR_DISTRIBUTED;
    fixture->request.samples = 4;
    expect_scene_like_the_reference(fixture, add_mirrors, "mirrors, distributed", PSNR_MIN);
}

/* What moved lies in a cube of its own: rays see both as one, and each other's reflections and shadows. */
static void what_moves_is_seen_with_what_stands_still(void **state)
{
    struct fixture *fixture = *state;
    float m[12];
    add_mirrors(fixture);
    uint32_t mesh = add_shape_mesh(fixture, SHAPE_BUMPY, 96, add_matte(fixture, 0.2f, 0.5f, 0.8f));
    turned(m, 0.4f, 0, 0, 0.6f, 0);
    uint32_t node = fixture_node(fixture, NODE_MESH, mesh, m);
    request_picture(fixture);
    struct frame_result before = render(fixture, LDC, "before it moves");
    assert_int_equal(before.cubes[TRACER_CUBE_DYNAMIC].resolution, 0);
    frame_result_finish(&before);
    for (int step = 0; step < 2; step++) {
        turned(m, 0.4f, 0.3f, 0.4f, 0.3f + 0.2f * (float)step, 0.5f);
        set_node(fixture, node, mesh, m);
        struct frame_result after = render(fixture, LDC, "after it moved");
        assert_int_equal(after.cubes[TRACER_CUBE_DYNAMIC].resolution, RESOLUTION);
        assert_int_equal(after.cubes[TRACER_CUBE_STATIC].rebuilt, step == 0);
        assert_true(after.cubes[TRACER_CUBE_DYNAMIC].rebuilt);
        frame_result_finish(&after);
    }
    expect_like_the_reference(fixture, "two cubes", PSNR_MIN);
}

/* ---- frames ---- */

static void switching_to_another_tracer_and_back_builds_nothing(void **state)
{
    struct fixture *fixture = *state;
    static const struct {
        unsigned tracer;
        bool builds;
    } frames[] = {{LDC, true}, {BVH, false}, {LDC, false}, {BVH, false}, {LDC, false}};
    add_mirrors(fixture);
    request_picture(fixture);
    fixture->request.tracer_options.ldc_resolution = 128;
    for (size_t i = 0; i < sizeof(frames) / sizeof(frames[0]); i++) {
        struct frame_result result = render(fixture, frames[i].tracer, "switched");
        assert_int_equal(result.cubes[TRACER_CUBE_STATIC].rebuilt, frames[i].builds);
        assert_int_equal(result.cubes[TRACER_CUBE_STATIC].resolution, frames[i].tracer == LDC ? 128 : 0);
        frame_result_finish(&result);
    }
}

/* A picture that goes on does so only with what it was begun with. */
static void a_picture_of_other_cubes_begins_anew(void **state)
{
    struct fixture *fixture = *state;
    add_mirrors(fixture);
    fixture->request.tracer = LDC;
    fixture->request.accumulate = true;
    fixture->request.tracer_options.ldc_resolution = 64;
    for (uint32_t i = 1; i <= 2; i++) {
        struct frame_result result = fixture_render(fixture);
        assert_int_equal(result.samples, i);
        frame_result_finish(&result);
    }
    fixture->request.tracer_options.ldc_resolution = 128;
    struct frame_result result = fixture_render(fixture);
    assert_int_equal(result.samples, 1);
    frame_result_finish(&result);
}

static void what_moves_while_the_shutter_is_open_is_refused_at_once(void **state)
{
    struct fixture *fixture = *state;
    float m[12];
    uint32_t mesh = add_shape_mesh(fixture, SHAPE_SPHERE, 16, add_matte(fixture, 0.5f, 0.5f, 0.5f));
    uint32_t node = fixture_node(fixture, NODE_MESH, mesh, NULL);
    fixture_commit(fixture);
    struct pose_node places[2] = {{.node = node}, {.node = node}};
    struct scene_pose poses[2] = {{.nodes = &places[0], .node_count = 1}, {.nodes = &places[1], .node_count = 1}};
    for (int i = 0; i < 2; i++) {
        turned(m, 1, 0, (float)i, 0, 0);
        memcpy(places[i].parent_from_node, m, sizeof(m));
    }
    const struct scene_motion open = {.poses = poses, .pose_count = 2}, closed = {.poses = poses, .pose_count = 1};
    fixture->request.tracer_options.ldc_resolution = 64;
    for (int compare = 0; compare < 2; compare++) {
        struct error error = {0};
        fixture->request.tracer = compare ? BVH : LDC;
        fixture->request.compare = compare;
        fixture->request.compare_with = LDC;
        assert_false(frame_begin(fixture->renderer, fixture->scene, &open, &fixture->request, &error));
        assert_int_equal(error.kind, ERROR_UNSUPPORTED);
        assert_string_equal(error.field, "shutter");
        struct frame_result result = fixture_render_motion(fixture, &closed);
        frame_result_finish(&result);
    }
}

/* ---- rays ---- */

/* The reference's own waves, its secondary rays answered by `ldc` too. */
static void expect_rays_agree(struct fixture *fixture, const char *name, float cell_metres, double diagonal)
{
    fixture->request.tracer = exact_tracer;
    fixture->request.compare = true;
    fixture->request.compare_with = LDC;
    struct frame_result result = fixture_render(fixture);
    uint64_t rays = 0, disagreed = 0, compared = 0;
    double worst_median = 0;
    for (uint32_t i = 0; i < result.comparison_count; i++) {
        const struct wave_comparison *wave = &result.comparisons[i];
        static const char *const kinds[] = {"primary", "secondary", "shadow"};
        double agreed = 1 - (double)(wave->only_first + wave->only_second) / (double)(wave->rays ? wave->rays : 1);
        double median_cells = (double)wave->distance_median * diagonal / (double)cell_metres;
        printf("%s, wave %u, %s: %llu rays, %.3f %% agree on hit or miss, median distance %.4f cells, 99 %% below "
               "%.3f\n",
               name, wave->wave, kinds[wave->kind], (unsigned long long)wave->rays, 100 * agreed, median_cells,
               (double)wave->distance_p99 * diagonal / (double)cell_metres);
        if (wave->kind != RAY_SECONDARY)
            continue;
        rays += wave->rays;
        disagreed += wave->only_first + wave->only_second;
        if (wave->both_hit > 100) {
            worst_median = fmax(worst_median, median_cells);
            compared++;
        }
    }
    frame_result_finish(&result);
    assert_in_range(rays, SIDE * SIDE / 20, UINT64_MAX); /* else nothing would have been shown */
    assert_true(compared > 0);
    double agreed = 1 - (double)disagreed / (double)rays;
    if (!(agreed >= AGREED_MIN))
        fail_msg("%s: %.3f %% of %llu rays agree on hit or miss", name, 100 * agreed, (unsigned long long)rays);
    if (!(worst_median <= DISTANCE_CELLS_MAX))
        fail_msg("%s: the median distance is %.3f cells off", name, worst_median);
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
            request_picture(fixture);
            fixture_look(fixture, 1.5f, 2.2f, 4.5f, 0.7f);
            snprintf(name, sizeof(name), "%s%s", rows[i].name, inside ? " of glass" : "");
            fixture->request.width = fixture->request.height = 16; /* for the size of a cell */
            struct frame_result result = render(fixture, LDC, name);
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
            expect_rays_agree(fixture, name, cell_metres, diagonal);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(secondary_rays_agree_with_the_reference, fixture_clear),
        cmocka_unit_test_setup(mirrors_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(textures_in_a_mirror_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(every_sort_of_texture_is_stored, fixture_clear),
        cmocka_unit_test_setup(glass_is_like_the_references, fixture_clear),
        cmocka_unit_test_setup(cutouts_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(spheres_are_like_the_references, fixture_clear),
        cmocka_unit_test_setup(distributed_rays_see_what_the_references_see, fixture_clear),
        cmocka_unit_test_setup(what_moves_is_seen_with_what_stands_still, fixture_clear),
        cmocka_unit_test_setup(switching_to_another_tracer_and_back_builds_nothing, fixture_clear),
        cmocka_unit_test_setup(a_picture_of_other_cubes_begins_anew, fixture_clear),
        cmocka_unit_test_setup(what_moves_while_the_shutter_is_open_is_refused_at_once, fixture_clear),
    };
    exact_tracer = tracer_impl_by_number(REFERENCE) ? REFERENCE : BVH;
    return cmocka_run_group_tests_name("ldc against the reference", tests, fixture_setup, fixture_teardown);
}
