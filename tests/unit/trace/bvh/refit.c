/* SPDX-License-Identifier: MIT */
/* Trees of meshes that deform: refitted where that is enough, built anew where it is not, and right in either
 * case. */
#include "tests/unit/trace/tracer_fixture.h"

#include "trace/bvh/tracer.h"

#define RAY_COUNT 4096u
#define TRIANGLES 1500u
#define NODE 2u

/* Adds a target that moves each triangle differently, and turns it a little. */
static void add_target(struct scene_mesh *mesh)
{
    float(*ways)[3] = malloc(TRIANGLES * 3 * sizeof(*ways));
    uint64_t seed = 41;
    for (uint32_t v = 0; v < TRIANGLES * 3; v++)
        for (int k = 0; k < 3; k++)
            ways[v][k] = (v % 3 ? ways[v - v % 3][k] + test_uniform(&seed, -0.01f, 0.01f)
                                : test_uniform(&seed, -0.3f, 0.3f));
    mesh->value.target_count = 1;
    mesh->arrays[MESH_TARGET_POSITIONS] = test_blob(ways, TRIANGLES * 3 * sizeof(*ways));
    mesh->weights = calloc(1, sizeof(*mesh->weights));
    mesh->weight_count = 1;
    free(ways);
}

/* Each triangle twice, so that every hit is a tie; and a mesh that stays as it is. */
static struct scene *scene_of_soup(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    float(*vertices)[3] = malloc(TRIANGLES * 3 * sizeof(*vertices));
    uint32_t *indices = malloc(TRIANGLES * 6 * sizeof(*indices));
    uint64_t seed = 9;
    for (uint32_t i = 0; i < TRIANGLES; i++) {
        float centre[3];
        for (int k = 0; k < 3; k++)
            centre[k] = test_uniform(&seed, -1, 1);
        for (uint32_t v = 3 * i; v < 3 * i + 3; v++) {
            for (int k = 0; k < 3; k++)
                vertices[v][k] = centre[k] + test_uniform(&seed, -0.05f, 0.05f);
            indices[v] = indices[3 * TRIANGLES + v] = v;
        }
    }
    test_mesh(&edits, 10, (const float(*)[3])vertices, TRIANGLES * 3, indices, TRIANGLES * 2);
    add_target(test_last_mesh(&edits));
    test_node(&edits, NODE, 0, NODE_MESH, 10, NULL);
    test_mesh(&edits, 11, (const float(*)[3])vertices, TRIANGLES * 3, indices, 300);
    float m[12];
    test_transform(m, 1, 1, 1, 1, 1, 2, 0, 0);
    test_node(&edits, 3, 0, NODE_MESH, 11, m);
    test_commit(&edits);
    free(vertices);
    free(indices);
    return edits.scene;
}

/* The target's weight as the shutter opens, and as it closes. */
static void pose(struct fixture *fixture, float open, float close)
{
    scene_motion_finish(&fixture->motion);
    test_motion_init(&fixture->motion, open == close ? 1 : 2);
    for (uint32_t p = 0; p < fixture->motion.pose_count; p++)
        test_pose_weights(&fixture->motion.poses[p], NODE, (const float[]){p == 0 ? open : close}, 1);
    update(fixture);
}

static void fixture_init(struct fixture *fixture, const struct tracer_options *options, float first)
{
    fixture_init_by(fixture, TRACER_BVH, scene_of_soup(), options);
    pose(fixture, first, first);
}

static uint32_t mesh_elements(const struct fixture *fixture)
{
    const struct bvh_store *store = &((const struct bvh *)fixture->tracer)->tree.store;
    for (uint32_t i = 0; i < store->entry_count; i++)
        if (store->entries[i].node == NODE)
            return store->entries[i].element_count;
    return 0;
}

static struct hit *trace(struct fixture *fixture, struct tracer *tracer, bool timed)
{
    struct error error = {0};
    struct gpu_buffer ray_buffer = {0}, times = {0}, answers = {0};
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    float *ray_times = malloc(RAY_COUNT * sizeof(*ray_times));
    struct hit *hits = malloc(RAY_COUNT * sizeof(*hits));
    uint64_t seed = 3;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        for (int k = 0; k < 3; k++) {
            rays[i].origin_t_min[k] = test_uniform(&seed, -3, 3);
            rays[i].direction_t_max[k] = test_uniform(&seed, -1, 1.5f) - rays[i].origin_t_min[k];
        }
        rays[i].origin_t_min[3] = 0;
        rays[i].direction_t_max[3] = 1e9f;
        ray_times[i] = test_uniform(&seed, 0, 1);
    }
    expect_ok(gpu_buffer_upload(device, &ray_buffer, rays, RAY_COUNT * sizeof(*rays), &error) &&
                  gpu_buffer_upload(device, &times, ray_times, RAY_COUNT * sizeof(*ray_times), &error) &&
                  gpu_buffer_reserve(device, &answers, RAY_COUNT * sizeof(*hits), &error),
              &error);
    gpu_scene_bind(&fixture->gpu);
    const struct wave wave = {
        .ray_count = RAY_COUNT, .rays = &ray_buffer, .hits = &answers, .times = timed ? &times : NULL};
    expect_ok(tracer_trace(tracer, &fixture->gpu, &wave, &error), &error);
    gpu_buffer_read(device, &answers, 0, hits, RAY_COUNT * sizeof(*hits));
    gpu_buffer_finish(device, &ray_buffer);
    gpu_buffer_finish(device, &times);
    gpu_buffer_finish(device, &answers);
    free(rays);
    free(ray_times);
    return hits;
}

/* Both look at the vertices that are on the device. */
static void expect_like_brute_force_at(struct fixture *fixture, bool timed)
{
    struct error error = {0};
    struct tracer *naive = tracer_create(&tracer_naive_impl, device, NULL, &error);
    expect_ok(naive && tracer_update(naive, &fixture->gpu, &(struct tracer_update){0}, &error), &error);
    struct hit *expected = trace(fixture, naive, timed), *hits = trace(fixture, fixture->tracer, timed);
    uint32_t hit_count = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        hit_count += expected[i].distance >= 0;
        /* The two programs order their arithmetic in their own ways; coordinates up to 3 are rounded to 2e-7. */
        if (!(fabsf(hits[i].distance - expected[i].distance) <= 1e-5f * fabsf(expected[i].distance) + 1e-6f))
            fail_msg("ray %u: distance %.9g, brute force %.9g", i, (double)hits[i].distance,
                     (double)expected[i].distance);
    }
    assert_in_range(hit_count, RAY_COUNT / 8, RAY_COUNT);
    free(expected);
    free(hits);
    tracer_destroy(naive);
}

static void expect_like_brute_force(struct fixture *fixture)
{
    expect_like_brute_force_at(fixture, true);
}

ALL_TESTS(open_device, close_device)

/* By nodes of each kind. */
static const struct tracer_options kinds[] = {{.bvh.nodes = BVH_NODES_LINKS}, {.bvh.nodes = BVH_NODES_EIGHT}};
#define KINDS (sizeof(kinds) / sizeof(*kinds))

static void expect_refits(const struct tracer_options *options)
{
    struct fixture fixture;
    fixture_init(&fixture, options, 0);
    const struct tracer_stats *stats = &fixture.tracer->stats;
    for (int step = 1; step <= 2; step++) {
        pose(&fixture, 0.2f * (float)step, 0.2f * (float)step);
        assert_int_equal(stats->nodes_rebuilt, 0);
        assert_in_range(stats->nodes_refitted, mesh_elements(&fixture), mesh_elements(&fixture) + 3);
        expect_like_brute_force(&fixture);
    }
    fixture_finish(&fixture);
}

TEST(a_mesh_that_deforms_is_refitted)
{
    for (size_t kind = 0; kind < KINDS; kind++)
        expect_refits(&kinds[kind]);
}

TEST(a_pose_that_stays_costs_nothing)
{
    struct fixture fixture;
    fixture_init(&fixture, NULL, 0);
    pose(&fixture, 0.3f, 0.3f);
    pose(&fixture, 0.3f, 0.3f);
    const struct tracer_stats *stats = &fixture.tracer->stats;
    assert_int_equal(stats->nodes_rebuilt + stats->nodes_refitted + stats->uploaded_bytes, 0);
    fixture_finish(&fixture);
}

TEST(a_mesh_that_deforms_while_the_shutter_is_open_is_met_at_each_rays_time)
{
    for (size_t kind = 0; kind < KINDS; kind++) {
        struct fixture fixture;
        fixture_init(&fixture, &kinds[kind], 0);
        pose(&fixture, 0.2f, 0.9f);
        expect_like_brute_force(&fixture);
        expect_like_brute_force_at(&fixture, false); /* rays without a time are as the shutter opens */
        fixture_finish(&fixture);
    }
}

/* At 8 times of each triangle's way neighbours have nothing to do with each other. */
static void expect_rebuilds(const struct tracer_options *options, uint32_t nodes_min)
{
    struct fixture fixture;
    fixture_init(&fixture, options, 0);
    const struct tracer_stats *stats = &fixture.tracer->stats;
    pose(&fixture, 8, 8);
    assert_in_range(stats->nodes_rebuilt, nodes_min, 4 * TRIANGLES);
    expect_like_brute_force(&fixture);
    pose(&fixture, 8.01f, 8.01f);
    assert_int_equal(stats->nodes_rebuilt, 0); /* good as new */
    expect_like_brute_force(&fixture);
    pose(&fixture, 0, 0); /* neighbours in this pose were far apart in the tree's own */
    assert_in_range(stats->nodes_rebuilt, nodes_min, 4 * TRIANGLES);
    expect_like_brute_force(&fixture);
    fixture_finish(&fixture);
}

TEST(a_tree_that_is_worn_out_is_built_anew)
{
    expect_rebuilds(&kinds[0], TRIANGLES / 4);
    expect_rebuilds(&kinds[1], TRIANGLES / 24); /* a node has at most 24 triangles */
}

TEST(answers_do_not_depend_on_earlier_poses)
{
    const struct tracer_options all[] = {kinds[0], kinds[1], {.bvh.form = TRACER_FORM_PAPER}};
    for (unsigned form = 0; form < sizeof(all) / sizeof(*all); form++) {
        struct fixture straight, roundabout;
        const struct tracer_options options = all[form];
        fixture_init(&straight, &options, 0.3f);
        struct hit *expected = trace(&straight, straight.tracer, true);
        fixture_init(&roundabout, &options, 0);
        pose(&roundabout, 8, 8);
        pose(&roundabout, 0.4f, 0.4f);
        pose(&roundabout, 0.3f, 0.3f);
        struct hit *hits = trace(&roundabout, roundabout.tracer, true);
        for (uint32_t i = 0; i < RAY_COUNT; i++)
            if (memcmp(&expected[i], &hits[i], sizeof(*hits)) != 0)
                fail_msg("ray %u, form %u: distance %.9g, primitive %u; %.9g, %u after other poses", i, form,
                         (double)expected[i].distance, expected[i].primitive, (double)hits[i].distance,
                         hits[i].primitive);
        free(expected);
        free(hits);
        fixture_finish(&roundabout);
        fixture_finish(&straight);
    }
}

/* Refitted trees, in which every hit is a tie of two triangles. */
TEST(nodes_of_each_kind_give_the_same_answers_to_the_bit)
{
    struct hit *hits[KINDS];
    for (size_t kind = 0; kind < KINDS; kind++) {
        struct fixture fixture;
        fixture_init(&fixture, &kinds[kind], 0);
        pose(&fixture, 0.2f, 0.5f);
        hits[kind] = trace(&fixture, fixture.tracer, true);
        fixture_finish(&fixture);
    }
    assert_memory_equal(hits[1], hits[0], RAY_COUNT * sizeof(*hits[0]));
    for (size_t kind = 0; kind < KINDS; kind++)
        free(hits[kind]);
}
