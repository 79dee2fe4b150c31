/* SPDX-License-Identifier: MIT */
/* Promises of the tracer `bvh` alone: edits cost what they change, and its bounds lose no hit that brute
 * force finds. tests/tracers shows that its hits are right. */
#include "tests/unit/trace/tracer_fixture.h"

#include "trace/bvh/tracer.h"
#include "trace/program.h"

#define RAY_COUNT 4096u

static void fixture_init(struct fixture *fixture, struct scene *scene)
{
    fixture_init_by(fixture, TRACER_BVH, scene, NULL);
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
    fixture_init(&fixture, scene_of_instances());
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
    fixture_init(&fixture, scene_of_instances());
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

/* Both run the same intersections on the same numbers: what differs is a hit that a bound lost. Distances may
 * differ in the last places, as the compiler orders the arithmetic of two programs. */
static void expect_like_brute_force(struct scene *scene, const struct ray *rays)
{
    struct fixture fixture;
    struct error error = {0};
    struct hit *hits = malloc(RAY_COUNT * sizeof(*hits)), *expected = malloc(RAY_COUNT * sizeof(*expected));
    uint32_t hit_count = 0;
    fixture_init(&fixture, scene);
    trace_rays(trace_by_tracer, &fixture, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
    tracer_destroy(fixture.tracer);
    fixture.tracer = tracer_create(&tracer_naive_impl, device, NULL, &error);
    expect_ok(fixture.tracer != NULL, &error);
    update(&fixture);
    trace_rays(trace_by_tracer, &fixture, WAVE_CLOSEST, rays, RAY_COUNT, expected, NULL);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float got = hits[i].distance, wanted = expected[i].distance;
        hit_count += wanted >= 0;
        if (!(fabsf(got - wanted) <= 1e-5f * fabsf(wanted)))
            fail_msg("ray %u: distance %.9g, brute force %.9g", i, (double)got, (double)wanted);
    }
    assert_in_range(hit_count, RAY_COUNT / 4, RAY_COUNT);
    free(hits);
    free(expected);
    fixture_finish(&fixture);
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
    expect_like_brute_force(scene_of_squares(), rays);
    free(rays);
}

TEST(grazing_rays_hit_as_by_brute_force)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    uint64_t seed = 22;
    for (uint32_t i = 0; i < RAY_COUNT; i++) /* a hair above the plane x = 0, or within it */
        rays[i] = make_ray(i % 4 ? test_uniform(&seed, 0, 1e-3f) : 0, -1, test_uniform(&seed, 0, 8),
                           test_uniform(&seed, -1e-4f, 0), 1, test_uniform(&seed, -0.2f, 0.2f));
    expect_like_brute_force(scene_of_squares(), rays);
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
    fixture_init(&fixture, scene_of_instances());
    assert_false(((struct bvh *)fixture.tracer)->tree.store.settings.whole);
    fixture_finish(&fixture);
    fixture_init(&fixture, scene_of_detail());
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
    expect_like_brute_force(scene_of_detail(), rays);
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
    const uint32_t packets[WAVES] = {device->facts.packet_rays, 1};
    struct fixture fixture;
    struct error error = {0};
    struct gpu_buffer rays[WAVES] = {0}, hits[WAVES] = {0};
    struct trace_state *waves[WAVES];
    fixture_init(&fixture, scene_of_instances());
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
            upload_rays(&rays[i], spreads[1 - i]); /* the other half is as in the other wave */
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
    static const float spreads[] = {0.002f, 0.4f};
    struct fixture fixture;
    struct error error = {0};
    struct gpu_buffer rays = {0}, hits = {0}, visibility = {0};
    struct hit *found[2];
    uint32_t seen[2][RAY_COUNT];
    const size_t hit_bytes = RAY_COUNT * sizeof(struct hit);
    fixture_init(&fixture, scene_of_instances());
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

/* Rays go forward only, so no link keeps them for ever, and a node whose link is wrong is looked into. */
TEST(a_link_that_leads_back_ends_no_ray_and_loses_no_hit)
{
    const struct gpu_facts facts = device->facts;
    struct fixture fixture;
    struct hit *hits[2];
    struct ray *rays = malloc(RAY_COUNT * sizeof(struct ray));
    uint64_t seed = 35;
    uint32_t hit_count = 0;
    fixture_init(&fixture, scene_of_instances());
    struct bvh_store *store = &((struct bvh *)fixture.tracer)->tree.store;
    assert_true(bvh_is_packed(&store->settings));
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        rays[i] = make_ray(6, 6, 20, test_uniform(&seed, -0.4f, 0.4f), test_uniform(&seed, -0.4f, 0.4f), -1);
    gpu_facts_choose(&device->facts, false); /* software GL leaves a loop by itself */
    for (int i = 0; i < 2; i++) {
        hits[i] = malloc(RAY_COUNT * sizeof(struct hit));
        trace_rays(trace_by_tracer, &fixture, WAVE_CLOSEST, rays, RAY_COUNT, hits[i], NULL);
        struct bvh_packed_element *elements = malloc(store->elements.size_bytes);
        const size_t count = store->elements.size_bytes / sizeof(*elements);
        gpu_buffer_read(device, &store->elements, 0, elements, store->elements.size_bytes);
        for (size_t k = 0; k < count; k++)
            if (elements[k].link >> BVH_LEAF_KIND_SHIFT == 0)
                elements[k].link = 0;
        gpu_buffer_write(device, &store->elements, 0, elements, store->elements.size_bytes);
        free(elements);
    }
    device->facts = facts;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        hit_count += hits[0][i].distance >= 0;
    assert_in_range(hit_count, RAY_COUNT / 16, RAY_COUNT);
    assert_memory_equal(hits[0], hits[1], RAY_COUNT * sizeof(struct hit));
    free(hits[0]);
    free(hits[1]);
    free(rays);
    fixture_finish(&fixture);
}

/* Traces so many tests of a ray at a time, as GPUs do; 0: all in one dispatch, as software GL does. */
static void *trace_as_hardware(struct scene *scene, const struct ray *rays, enum wave_kind kind,
                               const struct tracer_options *options, uint32_t ray_tests)
{
    const struct gpu_facts facts = device->facts;
    struct fixture fixture;
    void *answers = malloc(RAY_COUNT * sizeof(struct hit));
    fixture_init_by(&fixture, TRACER_BVH, scene, options);
    gpu_facts_choose(&device->facts, ray_tests == 0);
    device->facts.packet_rays = 1;
    device->facts.ray_tests_max = ray_tests;
    trace_rays(trace_by_tracer, &fixture, kind, rays, RAY_COUNT, answers, answers);
    device->facts = facts;
    fixture_finish(&fixture);
    return answers;
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

/* Where there is something of everything: cutouts and tints, instances at one place, discs. In packets, which the
 * paper's form has; the next test has rays alone. */
TEST(answers_do_not_depend_on_how_many_elements_a_dispatch_has)
{
    static const struct tracer_options all[] = {{.bvh.form = TRACER_FORM_PAPER}, {.bvh.nodes = BVH_NODES_EIGHT}};
    static const uint32_t tests[] = {50, 2};
    struct ray *rays = rays_for_packets(36);
    for (size_t i = 0; i < sizeof(all) / sizeof(*all); i++) {
        void *expected = trace_as_hardware(test_scene_translucent(), rays, WAVE_ANY, &all[i], 0);
        void *got = trace_as_hardware(test_scene_translucent(), rays, WAVE_ANY, &all[i], tests[i]);
        assert_memory_equal(got, expected, RAY_COUNT * sizeof(uint32_t));
        free(got);
        free(expected);
    }
    free(rays);
}

/* Closest hits and transmittances, in one dispatch and in many. */
TEST(nodes_of_each_kind_give_the_same_answers)
{
    static const struct tracer_options links = {.bvh.nodes = BVH_NODES_LINKS},
                                       eight = {.bvh.nodes = BVH_NODES_EIGHT};
    struct scene *(*const scenes[])(void) = {scene_of_instances, test_scene_translucent};
    for (size_t i = 0; i < sizeof(scenes) / sizeof(*scenes); i++) {
        struct ray *rays = rays_for_packets(40 + i);
        for (enum wave_kind kind = WAVE_CLOSEST; kind <= WAVE_ANY; kind++) {
            void *expected = trace_as_hardware(scenes[i](), rays, kind, &links, 65000);
            for (uint32_t tests = 3; tests <= 65000; tests += 64997) {
                void *got = trace_as_hardware(scenes[i](), rays, kind, &eight, tests);
                assert_memory_equal(got, expected,
                                    RAY_COUNT * (kind == WAVE_ANY ? sizeof(uint32_t) : sizeof(struct hit)));
                free(got);
            }
            free(expected);
        }
        free(rays);
    }
}

/* Rays that need many dispatches: a step ends between two of them, and others are traced before the next one. */
TEST(a_step_ends_between_the_dispatches_that_its_rays_take)
{
    const struct gpu_facts facts = device->facts;
    struct ray *rays = rays_for_packets(37), *other_rays = rays_for_packets(38);
    struct hit *other_hits = malloc(RAY_COUNT * sizeof(*other_hits)), *got = malloc(RAY_COUNT * sizeof(*got));
    struct gpu_buffer ray_buffer = {0}, hit_buffer = {0};
    struct error error = {0};
    struct fixture fixture;
    struct hit *expected = trace_as_hardware(scene_of_instances(), rays, WAVE_CLOSEST, NULL, 0);
    fixture_init(&fixture, scene_of_instances());
    expect_ok(gpu_buffer_upload(device, &ray_buffer, rays, RAY_COUNT * sizeof(*rays), &error), &error);
    gpu_facts_choose(&device->facts, false);
    device->facts.ray_tests_max = 8;
    struct trace_state *wave = begin_wave(&fixture, &ray_buffer, &hit_buffer);
    unsigned steps = 0;
    enum tracer_progress progress = TRACER_MORE;
    gpu_scene_bind(&fixture.gpu);
    while (progress == TRACER_MORE) {
        /* Steps alternate between the smallest range and the whole one. */
        progress = tracer_trace_step(fixture.tracer, &fixture.gpu, wave, steps++ % 2, &error);
        if (steps % 8 == 0 && progress == TRACER_MORE)
            trace_rays(trace_by_tracer, &fixture, WAVE_CLOSEST, other_rays, RAY_COUNT, other_hits, NULL);
    }
    device->facts = facts;
    expect_ok(progress == TRACER_DONE, &error);
    assert_in_range(steps, 8, UINT32_MAX);
    assert_true(trace_state_device_bytes(wave) > 0);
    trace_state_destroy(wave);
    gpu_buffer_read(device, &hit_buffer, 0, got, RAY_COUNT * sizeof(*got));
    assert_memory_equal(got, expected, RAY_COUNT * sizeof(*got));
    gpu_buffer_finish(device, &ray_buffer);
    gpu_buffer_finish(device, &hit_buffer);
    fixture_finish(&fixture);
    free(rays);
    free(other_rays);
    free(other_hits);
    free(expected);
    free(got);
}

TEST(an_unknown_form_is_refused)
{
    expect_options_refused(TRACER_BVH, &(struct refused_options){"options.bvh_form", {.bvh = {.form = 5}}}, 1);
    expect_options_refused(TRACER_BVH, &(struct refused_options){"options.bvh_nodes", {.bvh = {.nodes = 3}}}, 1);
}

/* Rays of the first step of a wave, of which nothing was learnt. */
static uint32_t first_step_of(struct scene *scene)
{
    struct ray *rays = rays_for_packets(39);
    struct gpu_buffer ray_buffer = {0}, hit_buffer = {0};
    struct error error = {0};
    struct fixture fixture;
    fixture_init(&fixture, scene);
    expect_ok(gpu_buffer_upload(device, &ray_buffer, rays, RAY_COUNT * sizeof(*rays), &error), &error);
    struct trace_state *wave = begin_wave(&fixture, &ray_buffer, &hit_buffer);
    gpu_scene_bind(&fixture.gpu);
    const enum tracer_progress progress =
        tracer_trace_step(fixture.tracer, &fixture.gpu, wave, UINT64_C(1000000000), &error);
    expect_ok(progress != TRACER_FAILED, &error);
    const uint32_t traced = wave->traced_rays;
    trace_state_destroy(wave);
    gpu_buffer_finish(device, &ray_buffer);
    gpu_buffer_finish(device, &hit_buffer);
    fixture_finish(&fixture);
    free(rays);
    return traced;
}

TEST(a_first_step_has_fewer_rays_where_each_may_meet_much)
{
    const struct gpu_facts facts = device->facts;
    gpu_facts_choose(&device->facts, true);
    device->facts.range_rays_first = RAY_COUNT;
    const uint32_t usual = first_step_of(scene_of_instances());
    const uint32_t translucent = first_step_of(test_scene_translucent());
    struct test_edits edits = {.scene = scene_of_instances()};
    for (uint32_t i = 1; i <= 100; i++)
        test_add(&edits, OBJECT_DISC)->set.disc = (struct scene_disc){
            .base.id = i, .value.centre_world = {100, 0, 0}, .value.normal_world = {0, 0, 1}, .value.radius = 1};
    test_commit(&edits);
    device->facts.list_tests_max = 100 * RAY_COUNT / 4;
    const uint32_t discs = first_step_of(edits.scene);
    device->facts = facts;
    assert_int_equal(usual, RAY_COUNT);
    assert_in_range(translucent, TRACE_RAYS_MULTIPLE, RAY_COUNT / 8);
    assert_in_range(discs, TRACE_RAYS_MULTIPLE, RAY_COUNT / 3);
}
