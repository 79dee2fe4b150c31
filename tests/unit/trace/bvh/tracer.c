/* SPDX-License-Identifier: MIT */
/* What only the tracer `bvh` promises: edits cost what they change, and its bounds lose no hit that brute force
 * finds. That its answers are right is shown by tests/tracers. */
#include "tests/accuracy/test_scenes.h"

#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/bvh/tracer.h"
#include "gpu_scene/scene.h"
#include "trace/tracer.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <stddef.h>

#define RAY_COUNT 4096u

struct fixture {
    struct scene *scene;
    struct gpu_scene gpu;
    struct test_edits edits;
    struct tracer *tracer;
};

static void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

static void update(struct fixture *fixture)
{
    struct error error = {0};
    struct scene_changes changes;
    if (fixture->edits.count > 0)
        test_commit(&fixture->edits);
    expect_ok(gpu_scene_update(&fixture->gpu, fixture->scene, NULL, &changes, NULL, &error), &error);
    expect_ok(
        tracer_update(fixture->tracer, &fixture->gpu, &(struct tracer_update){.changed = changes.bits}, &error),
        &error);
}

static void fixture_init(struct fixture *fixture, struct scene *scene, const struct tracer_options *options)
{
    struct error error = {0};
    *fixture = (struct fixture){.scene = scene, .edits = {.scene = scene}};
    gpu_scene_init(&fixture->gpu, device);
    fixture->tracer = tracer_create(&tracer_bvh_impl, device, options, &error);
    expect_ok(fixture->tracer != NULL, &error);
    update(fixture);
}

static void fixture_finish(struct fixture *fixture)
{
    tracer_destroy(fixture->tracer);
    gpu_scene_finish(&fixture->gpu);
    scene_destroy(fixture->scene);
}

/* Two meshes in many instances. */
static struct scene *scene_of_instances(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    test_soup_mesh(&edits, 10, 500, 0.1f, 1);
    test_soup_mesh(&edits, 11, 300, 0.1f, 2);
    for (uint32_t i = 0; i < 20; i++) {
        float m[12];
        test_transform(m, 1, 1, 1, 0, 0.1f * (float)i, 3 * (float)(i % 5), 3 * (float)(i / 5), 0);
        test_node(&edits, i + 1, 0, NODE_MESH, 10 + i % 2, m);
    }
    test_commit(&edits);
    return edits.scene;
}

ALL_TESTS(open_device, close_device)

TEST(a_moved_node_costs_its_path_in_the_top_tree)
{
    struct fixture fixture;
    fixture_init(&fixture, scene_of_instances(), NULL);
    const struct tracer_stats *stats = &fixture.tracer->stats;
    assert_int_equal(stats->nodes_rebuilt, stats->nodes);
    assert_int_equal(stats->nodes_refitted, 0);
    uint32_t top_nodes = ((struct bvh *)fixture.tracer)->tree.top.element_count;
    float m[12];
    test_transform(m, 1, 1.1f, 1, 2, 0.3f, 1, 2, 0.5f);
    test_node(&fixture.edits, 7, 0, NODE_MESH, 10, m);
    update(&fixture);
    assert_int_equal(stats->nodes_rebuilt, 0);
    assert_in_range(stats->nodes_refitted, 1, top_nodes / 2);
    size_t element_bytes = bvh_element_bytes(&((struct bvh *)fixture.tracer)->tree.store.settings);
    uint64_t expected = sizeof(struct bvh_transform) + stats->nodes_refitted * element_bytes;
    assert_int_equal(stats->uploaded_bytes, expected);
    fixture_finish(&fixture);
}

TEST(a_changed_mesh_rebuilds_its_own_tree)
{
    struct fixture fixture;
    fixture_init(&fixture, scene_of_instances(), NULL);
    const struct tracer_stats *stats = &fixture.tracer->stats;
    uint64_t nodes = stats->nodes, first_upload = stats->uploaded_bytes;
    test_soup_mesh(&fixture.edits, 11, 40, 0.1f, 3);
    update(&fixture);
    assert_in_range(stats->nodes_rebuilt, 1, 79);
    assert_in_range(stats->nodes, 100, nodes - 1);
    assert_in_range(stats->uploaded_bytes, 1, first_upload / 4);
    fixture_finish(&fixture);
}

/* ---- against brute force ---- */

static struct hit *trace(struct gpu_scene *gpu, const struct tracer_impl *impl,
                         const struct tracer_options *options, const struct ray *rays)
{
    struct error error = {0};
    struct gpu_buffer ray_buffer = {0}, hit_buffer = {0};
    struct tracer *tracer = tracer_create(impl, device, options, &error);
    expect_ok(tracer && tracer_update(tracer, gpu, &(struct tracer_update){0}, &error), &error);
    expect_ok(gpu_buffer_upload(device, &ray_buffer, rays, RAY_COUNT * sizeof(struct ray), &error), &error);
    expect_ok(gpu_buffer_reserve(device, &hit_buffer, RAY_COUNT * sizeof(struct hit), &error), &error);
    gpu_scene_bind(gpu);
    const struct wave wave = {.ray_count = RAY_COUNT, .rays = &ray_buffer, .hits = &hit_buffer};
    expect_ok(tracer_trace(tracer, gpu, &wave, &error), &error);
    struct hit *hits = malloc(RAY_COUNT * sizeof(struct hit));
    gpu_buffer_read(device, &hit_buffer, 0, hits, RAY_COUNT * sizeof(struct hit));
    gpu_buffer_finish(device, &ray_buffer);
    gpu_buffer_finish(device, &hit_buffer);
    tracer_destroy(tracer);
    return hits;
}

/* Both run the same intersections on the same numbers: what differs is a hit that a bound lost. Distances may
 * differ in the last places, as the compiler orders the arithmetic of two programs. `spurious_max`: hits that
 * brute force may report and a tree not: a line that comes from afar in the plane of a triangle has edge functions
 * of noise, which may agree in sign although the line passes the triangle at many times its size. */
static void expect_like_brute_force(struct scene *scene, const struct ray *rays, uint32_t hits_min,
                                    uint32_t spurious_max)
{
    static const struct tracer_options forms[] = {
        {.bvh = {.rays = 1}},
        {.bvh = {.bounds = BVH_BOUNDS_SPHERE, .rays = 1}},
        {.bench = {.bvh_layout = BVH_LAYOUT_PLAIN}},
        {.bvh = {.rays = 3}},
        {.bvh = {.rays = 4}},
        {.bvh = {.rays = 8}},
    };
    struct gpu_scene gpu;
    struct error error = {0};
    struct scene_changes changes;
    gpu_scene_init(&gpu, device);
    expect_ok(gpu_scene_update(&gpu, scene, NULL, &changes, NULL, &error), &error);
    struct hit *expected = trace(&gpu, &tracer_naive_impl, NULL, rays);
    uint32_t hit_count = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        hit_count += expected[i].distance >= 0;
    assert_in_range(hit_count, hits_min, RAY_COUNT);
    for (size_t form = 0; form < sizeof(forms) / sizeof(forms[0]); form++) {
        struct hit *hits = trace(&gpu, &tracer_bvh_impl, &forms[form], rays);
        uint32_t spurious = 0;
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            float got = hits[i].distance, wanted = expected[i].distance;
            if (!(fabsf(got - wanted) <= 1e-5f * fabsf(wanted)) && ++spurious > spurious_max)
                fail_msg("form %zu, ray %u: distance %.9g, brute force %.9g", form, i, (double)got,
                         (double)wanted);
        }
        free(hits);
    }
    free(expected);
    gpu_scene_finish(&gpu);
    scene_destroy(scene);
}

static struct ray make_ray(float x, float y, float z, float dx, float dy, float dz)
{
    return (struct ray){{x, y, z, 0}, {dx, dy, dz, 1e9f}};
}

/* A wall of squares on whole numbers, in three planes: boxes without volume, edges and corners on the rays. */
static struct scene *scene_of_squares(void)
{
    enum { SIDE = 8 };
    float positions[3 * (SIDE + 1) * (SIDE + 1)][3];
    uint32_t indices[3 * SIDE * SIDE * 6], n = 0;
    for (uint32_t plane = 0; plane < 3; plane++) {
        uint32_t base = plane * (SIDE + 1) * (SIDE + 1);
        for (uint32_t i = 0; i <= SIDE; i++) {
            for (uint32_t j = 0; j <= SIDE; j++) {
                float *p = positions[base + i * (SIDE + 1) + j];
                p[plane] = (float)plane;
                p[(plane + 1) % 3] = (float)i;
                p[(plane + 2) % 3] = (float)j;
            }
        }
        for (uint32_t i = 0; i < SIDE; i++) {
            for (uint32_t j = 0; j < SIDE; j++, n += 6) {
                uint32_t a = base + i * (SIDE + 1) + j, b = a + SIDE + 1;
                memcpy(&indices[n], (uint32_t[6]){a, a + 1, b, a + 1, b + 1, b}, 6 * sizeof(*indices));
            }
        }
    }
    struct test_edits edits = {.scene = test_scene_create()};
    test_mesh(&edits, 1, (const float(*)[3])positions, 3 * (SIDE + 1) * (SIDE + 1), indices, n / 3);
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    return edits.scene;
}

TEST(rays_along_axes_through_edges_and_corners_hit_as_by_brute_force)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    uint64_t seed = 21;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float o[3], d[3] = {0, 0, 0};
        for (int k = 0; k < 3; k++)
            o[k] = (float)(test_random(&seed) % 21) * 0.5f - 1; /* on and between the vertices */
        d[i % 3] = i & 8 ? -1.0f : 1.0f;
        o[i % 3] = i & 8 ? 12.0f : -3.0f;
        if (i & 16)
            d[(i + 1) % 3] = i & 32 ? -0.0f : 0.5f;
        rays[i] = make_ray(o[0], o[1], o[2], d[0], d[1], d[2]);
    }
    expect_like_brute_force(scene_of_squares(), rays, RAY_COUNT / 4, 0);
    free(rays);
}

TEST(grazing_rays_hit_as_by_brute_force)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    uint64_t seed = 22;
    for (uint32_t i = 0; i < RAY_COUNT; i++) /* a hair above the plane x = 0, or within it */
        rays[i] = make_ray(i % 4 ? test_uniform(&seed, 0, 1e-3f) : 0, -1, test_uniform(&seed, 0, 8),
                           test_uniform(&seed, -1e-4f, 0), 1, test_uniform(&seed, -0.2f, 0.2f));
    expect_like_brute_force(scene_of_squares(), rays, RAY_COUNT / 4, 0);
    free(rays);
}

TEST(rays_from_far_away_hit_as_by_brute_force)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    uint64_t seed = 23;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float far = i % 2 ? 100.0f : 3e3f, o[3], d[3];
        for (int k = 0; k < 3; k++) {
            o[k] = far * test_uniform(&seed, -1, 1);
            d[k] = test_uniform(&seed, -1, 1) - o[k];
        }
        rays[i] = make_ray(o[0], o[1], o[2], d[0], d[1], d[2]);
    }
    expect_like_brute_force(test_scene_soup(), rays, RAY_COUNT / 10, 4);
    free(rays);
}

TEST(transforms_behind_the_origin_and_around_it_are_entered)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    uint64_t seed = 24;
    for (uint32_t i = 0; i < RAY_COUNT; i++) { /* from within the instances; short and long directions */
        float length = i % 3 ? 1e-3f : 50.0f;
        rays[i] = make_ray(test_uniform(&seed, -3, 3), test_uniform(&seed, -1, 3), test_uniform(&seed, -1, 1),
                           length * test_uniform(&seed, -1, 1), length * test_uniform(&seed, -1, 1),
                           length * test_uniform(&seed, -1, 1));
    }
    expect_like_brute_force(test_scene_soup(), rays, RAY_COUNT / 10, 0);
    expect_like_brute_force(test_scene_spheres(), rays, RAY_COUNT / 10, 0);
    free(rays);
}

/* A soup of a thousandth of a millimetre on a floor of twenty metres: far below a cell of one grid over both. */
static struct scene *scene_of_detail(void)
{
    enum { TRIANGLES = 400 };
    float positions[3 * TRIANGLES + 4][3] = {{-10, 0, -10}, {10, 0, -10}, {10, 0, 10}, {-10, 0, 10}};
    uint32_t indices[3 * TRIANGLES + 6] = {0, 1, 2, 0, 2, 3};
    uint64_t seed = 31;
    for (uint32_t i = 0; i < 3 * TRIANGLES; i++) {
        for (int k = 0; k < 3; k++)
            positions[4 + i][k] = 1e-6f * (i % 3 ? test_uniform(&seed, -0.2f, 0.2f) : test_uniform(&seed, 0, 1)) +
                                  (i % 3 ? positions[4 + i - i % 3][k] : 0);
        indices[6 + i] = 4 + i;
    }
    struct test_edits edits = {.scene = test_scene_create()};
    test_mesh(&edits, 1, (const float(*)[3])positions, 3 * TRIANGLES + 4, indices, TRIANGLES + 2);
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_commit(&edits);
    return edits.scene;
}

TEST(detail_below_the_grid_is_traversed_in_floats)
{
    struct fixture fixture;
    fixture_init(&fixture, scene_of_instances(), NULL);
    assert_false(((struct bvh *)fixture.tracer)->tree.store.settings.whole);
    fixture_finish(&fixture);
    fixture_init(&fixture, scene_of_detail(), NULL);
    assert_true(((struct bvh *)fixture.tracer)->tree.store.settings.whole);
    fixture_finish(&fixture);
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    uint64_t seed = 32;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float o[3], d[3];
        for (int k = 0; k < 3; k++) {
            o[k] = i % 2 ? test_uniform(&seed, -3e-6f, 3e-6f) : test_uniform(&seed, -5, 5);
            /* From afar the detail is below what a float tells apart: the floor. */
            d[k] =
                i % 2 ? 1e-6f * test_uniform(&seed, 0, 1) - o[k] : (k == 1 ? 0 : test_uniform(&seed, 1, 9)) - o[k];
        }
        rays[i] = make_ray(o[0], o[1], o[2], d[0], d[1], d[2]);
    }
    expect_like_brute_force(scene_of_detail(), rays, RAY_COUNT / 4, 0);
    free(rays);
}

/* A wave of rays, eight neighbours at a time `spread` radians from one direction, that all begin at one point. */
static void upload_rays(struct gpu_buffer *buffer, float spread)
{
    struct error error = {0};
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    uint64_t seed = 33;
    for (uint32_t i = 0; i < RAY_COUNT; i += 8)
        for (uint32_t k = i; k < i + 8; k++)
            rays[k] = make_ray(0, 0, 20, 0.5f + test_uniform(&seed, -spread, spread),
                               0.5f + test_uniform(&seed, -spread, spread), -1);
    expect_ok(gpu_buffer_upload(device, buffer, rays, RAY_COUNT * sizeof(struct ray), &error), &error);
    free(rays);
}

static struct trace_state *begin_wave(struct fixture *fixture, struct gpu_buffer *rays, struct gpu_buffer *hits)
{
    struct error error = {0};
    struct tracer *tracer = fixture->tracer;
    struct trace_state *state = trace_state_create(tracer->impl, device, &tracer->options, &error);
    expect_ok(state && gpu_buffer_reserve(device, hits, RAY_COUNT * sizeof(struct hit), &error), &error);
    const struct wave wave = {.ray_count = RAY_COUNT, .rays = rays, .hits = hits};
    expect_ok(tracer_trace_begin(tracer, &fixture->gpu, &wave, state, &error), &error);
    return state;
}

static uint32_t packet_of(const struct trace_state *state)
{
    return ((const struct bvh_state *)state)->packet_rays;
}

/* Also in the middle of a wave, whatever was traced in between and whatever its other rays are. */
TEST(coherent_neighbours_are_traced_as_packets_and_a_wave_keeps_its_packet_size)
{
    enum { CLOSE, APART, WAVES };
    static const float spreads[WAVES] = {0.002f, 0.4f};
    const uint32_t packets[WAVES] = {device->facts.software ? 8 : 1, 1};
    struct fixture fixture;
    struct error error = {0};
    struct gpu_buffer rays[WAVES] = {0}, hits[WAVES] = {0};
    struct trace_state *waves[WAVES];
    fixture_init(&fixture, scene_of_instances(), NULL);
    for (int i = 0; i < WAVES; i++) {
        upload_rays(&rays[i], spreads[i]);
        waves[i] = begin_wave(&fixture, &rays[i], &hits[i]);
        assert_int_equal(packet_of(waves[i]), packets[i]);
    }
    gpu_scene_bind(&fixture.gpu);
    for (int round = 0; round < 3; round++) {
        for (int i = 0; i < WAVES; i++) {
            assert_int_equal(tracer_trace_step(fixture.tracer, &fixture.gpu, waves[i], 0, &error), TRACER_MORE);
            assert_int_equal(packet_of(waves[i]), packets[i]);
            upload_rays(&rays[i], spreads[1 - i]); /* what is left is as the other wave was */
        }
    }
    for (int i = 0; i < WAVES; i++) {
        trace_state_destroy(waves[i]);
        gpu_buffer_finish(device, &rays[i]);
        gpu_buffer_finish(device, &hits[i]);
    }
    fixture_finish(&fixture);
}

static void trace_of_frame(struct fixture *fixture, struct wave wave, uint64_t samples, void *answers,
                           size_t bytes)
{
    struct error error = {0};
    wave.frame_samples = samples;
    gpu_scene_bind(&fixture->gpu);
    expect_ok(tracer_intersect(fixture->tracer, &fixture->gpu, &wave, &error), &error);
    gpu_buffer_read(device, wave.kind == WAVE_ANY ? wave.visibility : wave.hits, 0, answers, bytes);
}

/* Its rays are traced by other programs, which are compiled sooner. */
TEST(a_small_frame_has_the_answers_of_a_large_one)
{
    static const float spreads[] = {0.002f, 0.05f, 0.4f};
    struct fixture fixture;
    struct error error = {0};
    struct gpu_buffer rays = {0}, hits = {0}, visibility = {0};
    struct hit *found[2];
    uint32_t seen[2][RAY_COUNT];
    const size_t hit_bytes = RAY_COUNT * sizeof(struct hit);
    fixture_init(&fixture, scene_of_instances(), NULL);
    expect_ok(gpu_buffer_reserve(device, &hits, hit_bytes, &error) &&
                  gpu_buffer_reserve(device, &visibility, sizeof(seen[0]), &error),
              &error);
    for (int i = 0; i < 2; i++)
        found[i] = malloc(hit_bytes);
    for (size_t i = 0; i < sizeof(spreads) / sizeof(spreads[0]); i++) {
        uint32_t met = 0;
        upload_rays(&rays, spreads[i]);
        const struct wave closest = {.ray_count = RAY_COUNT, .rays = &rays, .hits = &hits, .shared_origin = true};
        const struct wave any = {
            .kind = WAVE_ANY, .ray_count = RAY_COUNT, .rays = &rays, .visibility = &visibility};
        for (uint64_t large = 0; large < 2; large++) {
            const uint64_t samples = large ? UINT32_MAX : 1;
            gpu_buffer_clear(device, &hits, 0);
            trace_of_frame(&fixture, closest, samples, found[large], hit_bytes);
            trace_of_frame(&fixture, any, samples, seen[large], sizeof(seen[0]));
        }
        for (uint32_t k = 0; k < RAY_COUNT; k++)
            met += seen[0][k] == 0;
        assert_in_range(met, RAY_COUNT / 100, RAY_COUNT - RAY_COUNT / 100);
        assert_memory_equal(found[0], found[1], hit_bytes);
        assert_memory_equal(seen[0], seen[1], sizeof(seen[0]));
    }
    for (int i = 0; i < 2; i++)
        free(found[i]);
    gpu_buffer_finish(device, &rays);
    gpu_buffer_finish(device, &hits);
    gpu_buffer_finish(device, &visibility);
    fixture_finish(&fixture);
}

/* The first of each eight goes nowhere; the others must neither wait for it nor be lost with it. */
TEST(rays_beside_a_NaN_ray_hit_as_by_brute_force)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    uint64_t seed = 34;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        rays[i] = make_ray(0, 0.5f, 6, i % 8 ? test_uniform(&seed, -0.3f, 0.3f) : NAN,
                           test_uniform(&seed, -0.3f, 0.3f), -1);
    expect_like_brute_force(test_scene_soup(), rays, RAY_COUNT / 10, 0);
    free(rays);
}

/* Rays go forward only, so no link keeps them for ever, and a node whose link is wrong is looked into. */
TEST(a_link_that_leads_back_ends_no_ray_and_loses_no_hit)
{
    struct fixture fixture;
    struct hit *hits[2];
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    struct gpu_buffer ray_buffer = {0}, hit_buffer = {0};
    struct error error = {0};
    uint64_t seed = 35;
    fixture_init(&fixture, scene_of_instances(), NULL);
    struct bvh_store *store = &((struct bvh *)fixture.tracer)->tree.store;
    assert_true(bvh_is_packed(&store->settings));
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        rays[i] = make_ray(6, 6, 20, test_uniform(&seed, -0.4f, 0.4f), test_uniform(&seed, -0.4f, 0.4f), -1);
    expect_ok(gpu_buffer_upload(device, &ray_buffer, rays, RAY_COUNT * sizeof(struct ray), &error), &error);
    expect_ok(gpu_buffer_reserve(device, &hit_buffer, RAY_COUNT * sizeof(struct hit), &error), &error);
    const struct wave wave = {.ray_count = RAY_COUNT, .rays = &ray_buffer, .hits = &hit_buffer};
    const bool software = device->facts.software;
    for (int i = 0; i < 2; i++) {
        gpu_scene_bind(&fixture.gpu);
        device->facts.software = false; /* which leaves a loop by itself */
        const bool traced = tracer_trace(fixture.tracer, &fixture.gpu, &wave, &error);
        device->facts.software = software;
        expect_ok(traced, &error);
        hits[i] = malloc(RAY_COUNT * sizeof(struct hit));
        gpu_buffer_read(device, &hit_buffer, 0, hits[i], RAY_COUNT * sizeof(struct hit));
        struct bvh_packed_element *elements = malloc(store->elements.size_bytes);
        const size_t count = store->elements.size_bytes / sizeof(*elements);
        gpu_buffer_read(device, &store->elements, 0, elements, store->elements.size_bytes);
        for (size_t k = 0; k < count; k++)
            if (elements[k].link >> BVH_LEAF_KIND_SHIFT == 0)
                elements[k].link = 0;
        gpu_buffer_write(device, &store->elements, 0, elements, store->elements.size_bytes);
        free(elements);
    }
    uint32_t hit_count = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        hit_count += hits[0][i].distance >= 0;
    assert_in_range(hit_count, RAY_COUNT / 16, RAY_COUNT);
    assert_memory_equal(hits[0], hits[1], RAY_COUNT * sizeof(struct hit));
    for (int i = 0; i < 2; i++)
        free(hits[i]);
    free(rays);
    gpu_buffer_finish(device, &ray_buffer);
    gpu_buffer_finish(device, &hit_buffer);
    fixture_finish(&fixture);
}

/* As a GPU does it, a few elements at a time: cutouts and tints, spheres, instances at one place, discs. Elements
 * 0: as software GL does it, in one dispatch. */
struct hardware_wave {
    struct gpu_buffer rays, answers;
    size_t answer_bytes;
    struct tracer *tracer;
    struct wave wave;
};

static void hardware_wave_init(struct hardware_wave *this, struct gpu_scene *gpu, const struct ray *rays,
                               enum wave_kind kind, const struct tracer_options *options)
{
    struct error error = {0};
    *this = (struct hardware_wave){.tracer = tracer_create(&tracer_bvh_impl, device, options, &error)};
    this->answer_bytes = RAY_COUNT * (kind == WAVE_ANY ? sizeof(uint32_t) : sizeof(struct hit));
    expect_ok(this->tracer && tracer_update(this->tracer, gpu, &(struct tracer_update){0}, &error), &error);
    expect_ok(gpu_buffer_upload(device, &this->rays, rays, RAY_COUNT * sizeof(struct ray), &error) &&
                  gpu_buffer_reserve(device, &this->answers, this->answer_bytes, &error),
              &error);
    this->wave = (struct wave){.kind = kind,
                               .ray_count = RAY_COUNT,
                               .rays = &this->rays,
                               .hits = &this->answers,
                               .visibility = &this->answers};
    gpu_scene_bind(gpu);
}

static void *hardware_wave_finish(struct hardware_wave *this)
{
    void *answers = malloc(this->answer_bytes);
    gpu_buffer_read(device, &this->answers, 0, answers, this->answer_bytes);
    gpu_buffer_finish(device, &this->rays);
    gpu_buffer_finish(device, &this->answers);
    tracer_destroy(this->tracer);
    return answers;
}

static void *trace_as_hardware(struct gpu_scene *gpu, const struct ray *rays, enum wave_kind kind,
                               const struct tracer_options *options)
{
    struct error error = {0};
    struct hardware_wave own;
    const bool software = device->facts.software;
    hardware_wave_init(&own, gpu, rays, kind, options);
    device->facts.software = options->bench.bvh_elements == 0;
    const bool traced = tracer_trace(own.tracer, gpu, &own.wave, &error);
    device->facts.software = software;
    expect_ok(traced, &error);
    return hardware_wave_finish(&own);
}

/* Some are alone, and some go along with others: what a packet is made of. */
static struct ray *rays_for_packets(uint64_t seed)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        rays[i] = make_ray(test_uniform(&seed, -3, 3), test_uniform(&seed, -1, 3), test_uniform(&seed, -4, 4),
                           test_uniform(&seed, -1, 1), test_uniform(&seed, -1, 1), test_uniform(&seed, -1, 1));
        if (i % 5 > 1) {
            rays[i] = rays[i - 2];
            rays[i].direction_t_max[0] *= test_uniform(&seed, 0.98f, 1.02f);
        }
    }
    return rays;
}

/* In all forms where there is something of everything, and elsewhere in one: each is a program of its own. */
TEST(answers_do_not_depend_on_how_many_elements_a_dispatch_has)
{
    enum { OF_EVERYTHING = 3 };
    struct scene *(*const scenes[])(void) = {scene_of_instances, test_scene_soup, test_scene_spheres,
                                             test_scene_translucent, scene_of_squares};
    static const uint32_t budgets[] = {1, 7, 50};
    static const struct {
        uint32_t rays;
        bool plain;
    } forms[] = {{1, false}, {3, false}, {8, false}, {1, true}};
    struct ray *rays = rays_for_packets(36);
    for (size_t s = 0; s < sizeof(scenes) / sizeof(scenes[0]); s++) {
        struct error error = {0};
        struct scene_changes changes;
        struct scene *scene = scenes[s]();
        struct gpu_scene gpu;
        gpu_scene_init(&gpu, device);
        expect_ok(gpu_scene_update(&gpu, scene, NULL, &changes, NULL, &error), &error);
        for (size_t f = 0; f < sizeof(forms) / sizeof(forms[0]); f++) {
            for (int kind = WAVE_CLOSEST; kind <= WAVE_ANY && (s == OF_EVERYTHING || f == s % 4); kind++) {
                struct tracer_options options = {.bvh.rays = forms[f].rays};
                options.bench.bvh_layout = forms[f].plain ? BVH_LAYOUT_PLAIN : BVH_LAYOUT_FAST;
                void *expected = trace_as_hardware(&gpu, rays, (enum wave_kind)kind, &options);
                options.bench.bvh_elements = budgets[(s + f) % 3];
                void *got = trace_as_hardware(&gpu, rays, (enum wave_kind)kind, &options);
                assert_memory_equal(got, expected,
                                    RAY_COUNT * (kind == WAVE_ANY ? sizeof(uint32_t) : sizeof(struct hit)));
                free(got);
                free(expected);
            }
        }
        gpu_scene_finish(&gpu);
        scene_destroy(scene);
    }
    free(rays);
}

/* Rays that need many dispatches: a step ends between two of them, and others are traced before the next one. */
TEST(a_step_ends_between_the_dispatches_that_its_rays_take)
{
    struct ray *rays = rays_for_packets(37), *other_rays = rays_for_packets(38);
    struct error error = {0};
    struct scene_changes changes;
    struct scene *scene = scene_of_instances();
    struct gpu_scene gpu;
    const bool software = device->facts.software;
    gpu_scene_init(&gpu, device);
    expect_ok(gpu_scene_update(&gpu, scene, NULL, &changes, NULL, &error), &error);
    for (uint32_t packet_rays = 1; packet_rays <= 8; packet_rays *= 8) {
        struct tracer_options options = {.bvh.rays = packet_rays};
        void *expected = trace_as_hardware(&gpu, rays, WAVE_CLOSEST, &options);
        options.bench.bvh_elements = 4;
        struct hardware_wave own, other;
        hardware_wave_init(&own, &gpu, rays, WAVE_CLOSEST, &options);
        hardware_wave_init(&other, &gpu, other_rays, WAVE_CLOSEST, &options);
        struct trace_state *trace_state =
            trace_state_create(&tracer_bvh_impl, device, &own.tracer->options, &error);
        expect_ok(trace_state && tracer_trace_begin(own.tracer, &gpu, &own.wave, trace_state, &error), &error);
        unsigned steps = 0;
        enum tracer_progress progress = TRACER_MORE;
        device->facts.software = false;
        while (progress == TRACER_MORE) {
            /* One of the smallest range and one without regard to it, in turns. */
            progress = tracer_trace_step(own.tracer, &gpu, trace_state, steps++ % 2, &error);
            if (steps % 4 == 0 && progress == TRACER_MORE && !tracer_trace(own.tracer, &gpu, &other.wave, &error))
                progress = TRACER_FAILED;
        }
        device->facts.software = software;
        expect_ok(progress == TRACER_DONE, &error);
        if (steps < 8)
            fail_msg("packets of %u: only %u steps", packet_rays, steps);
        assert_true(trace_state_device_bytes(trace_state) > 0);
        trace_state_destroy(trace_state);
        void *got = hardware_wave_finish(&own);
        assert_memory_equal(got, expected, RAY_COUNT * sizeof(struct hit));
        free(got);
        free(expected);
        free(hardware_wave_finish(&other));
    }
    gpu_scene_finish(&gpu);
    scene_destroy(scene);
    free(rays);
    free(other_rays);
}

TEST(an_impossible_packet_size_is_refused)
{
    struct error error = {0};
    assert_null(tracer_create(&tracer_bvh_impl, device, &(struct tracer_options){.bvh = {.rays = 5}}, &error));
    assert_int_equal(error.kind, ERROR_INVALID);
    assert_string_equal(error.field, "options.bvh_rays");
}
