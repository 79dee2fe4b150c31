/* SPDX-License-Identifier: MIT */
/* Equality of the hits of the tracer `bvh`, to the bit, however its scene came about: frames of an animation
 * must not depend on which frames were rendered before. Also the cost of instances that all move. */
#include "tests/unit/trace/tracer_fixture.h"

#include "trace/bvh/tracer.h"

#define RAY_COUNT 8192u
#define INSTANCES 60u
#define MOVING 1000u

static void fixture_init(struct fixture *fixture, struct scene *scene, const struct tracer_options *options)
{
    fixture_init_by(fixture, TRACER_BVH, scene, options);
}

static const struct bvh *bvh_of(const struct fixture *fixture)
{
    return (const struct bvh *)fixture->tracer;
}

/* ---- histories ---- */

enum look { LOOK_CUTOUT, LOOK_TINTED };

/* Materials, two soups, and a slab of two coincident squares on the plane z = 0. */
static struct scene *scene_of_shapes(enum look look)
{
    static const float square[4][3] = {{-4, -3, 0}, {4, -3.5f, 0}, {4, 3, 0}, {-4, 3, 0}};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3, 0, 1, 3, 1, 2, 3};
    struct test_edits edits = {.scene = test_scene_create()};
    struct scene_material *first = test_material(&edits, 1, 0.9f, 0.7f, 0.3f);
    struct scene_material *second = test_material(&edits, 2, 0.4f, 0.8f, 0.95f);
    if (look == LOOK_CUTOUT) {
        test_texture(&edits, 1, 13, 8, TEXTURE_RGBA8_SRGB, WRAP_REPEAT, WRAP_MIRROR, 17);
        first->value.alpha_mode = ALPHA_MASK;
        first->textures[MATERIAL_BASE_COLOUR].texture = 1;
    } else if (look == LOOK_TINTED) {
        first->value.transmission = 0.9f;
        second->value.alpha_mode = ALPHA_BLEND;
        second->value.base_colour[3] = 0.3f;
    }
    test_soup_mesh(&edits, 10, 90, 0.4f, 1);
    test_soup_mesh(&edits, 11, 60, 0.4f, 2);
    struct scene_mesh *slab = test_mesh(&edits, 12, square, 4, indices, 4);
    slab->ranges = test_ranges(&(struct record_material_range){0, 4, 2}, 1);
    slab->range_count = 1;
    test_commit(&edits);
    return edits.scene;
}

/* Every shape is there twice at the same place, so each hit of it is a tie of two instances. */
static void place(struct test_edits *edits, uint64_t seed)
{
    for (uint32_t i = 0; i < INSTANCES; i += 2) {
        float m[12];
        test_transform(m, test_uniform(&seed, 0.5f, 1), test_uniform(&seed, -1, -0.5f), 0.8f, (int)(i / 2 % 3),
                       test_uniform(&seed, 0, 6), test_uniform(&seed, -4, 4), test_uniform(&seed, -3, 3),
                       test_uniform(&seed, -3, 3));
        for (uint32_t k = i; k < i + 2; k++)
            test_node(edits, k + 1, 0, NODE_MESH, 10 + i / 2 % 3, m);
    }
}

/* Eight at a time begin close together and go almost the same way. */
static struct ray *make_rays(void)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    uint64_t seed = 51;
    float origin[3] = {0}, aim[3] = {0};
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        for (int k = 0; k < 3; k++) {
            if (i % 8 == 0) {
                origin[k] = test_uniform(&seed, -7, 7);
                aim[k] = test_uniform(&seed, -3, 3);
            }
            rays[i].origin_t_min[k] = origin[k] + test_uniform(&seed, -2e-3f, 2e-3f);
            rays[i].direction_t_max[k] = aim[k] + test_uniform(&seed, -0.03f, 0.03f) - origin[k];
        }
        rays[i].origin_t_min[3] = 1e-4f;
        rays[i].direction_t_max[3] = 1;
        if (i % 3) /* else to a light; or on, without end */
            rays[i].direction_t_max[3] = 1e9f;
    }
    return rays;
}

/* Closest hits and visibilities of a tree as it is built, or, `moved`, refitted from places all over, in two
 * steps. */
static void trace_history(struct fixture *fixture, enum look look, const struct tracer_options *options,
                          bool moved, struct hit *hits, uint32_t *light)
{
    struct test_edits edits = {.scene = scene_of_shapes(look)};
    struct ray *rays = make_rays();
    place(&edits, moved ? 6 : 5);
    test_commit(&edits);
    fixture_init(fixture, edits.scene, options);
    for (uint64_t seed = 7; moved && seed-- > 5;) {
        place(&fixture->edits, seed);
        update(fixture);
        assert_int_equal(fixture->tracer->stats.nodes_rebuilt, 0);
    }
    trace_rays(trace_by_tracer, fixture, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
    trace_rays(trace_by_tracer, fixture, WAVE_ANY, rays, RAY_COUNT, NULL, light);
    free(rays);
}

static void expect_same_answers(enum look look, const struct tracer_options *options)
{
    struct fixture built, moved;
    struct hit *hits[2];
    uint32_t *light[2], hit_count = 0, tinted = 0;
    for (int i = 0; i < 2; i++) {
        hits[i] = malloc(RAY_COUNT * sizeof(*hits[i]));
        light[i] = malloc(RAY_COUNT * sizeof(*light[i]));
        trace_history(i == 0 ? &built : &moved, look, options, i > 0, hits[i], light[i]);
    }
    const struct bvh_top *top = &bvh_of(&built)->tree.top, *other = &bvh_of(&moved)->tree.top;
    assert_true(top->element_count != other->element_count ||
                memcmp(top->leaves, other->leaves, top->element_count * sizeof(*top->leaves)) != 0);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const struct hit *a = &hits[0][i], *b = &hits[1][i];
        hit_count += a->distance >= 0;
        tinted += (light[0][i] & 0xff) != 0 && (light[0][i] & 0xff) != 0xff;
        if (memcmp(a, b, sizeof(*a)) != 0 || light[0][i] != light[1][i])
            fail_msg("ray %u: distance %.9g, primitive %u, instance %u, visibility %08x; %.9g, %u, "
                     "%u, %08x in the tree that was refitted",
                     i, (double)a->distance, a->primitive, a->instance, light[0][i], (double)b->distance,
                     b->primitive, b->instance, light[1][i]);
        assert_true(a->distance < 0 || a->instance % 2 == 0); /* the first of two */
    }
    assert_in_range(hit_count, RAY_COUNT / 4, RAY_COUNT);
    assert_in_range(tinted, look == LOOK_TINTED ? RAY_COUNT / 8 : 0, RAY_COUNT);
    for (int i = 0; i < 2; i++) {
        free(hits[i]);
        free(light[i]);
    }
    fixture_finish(&moved);
    fixture_finish(&built);
}

ALL_TESTS(open_device, close_device)

TEST(answers_do_not_depend_on_how_instances_came_to_where_they_are)
{
    const uint32_t packet_rays = device->facts.packet_rays;
    device->facts.packet_rays = device->facts.software ? 8 : 1; /* packets look at rays where the host can */
    expect_same_answers(LOOK_CUTOUT, NULL);
    device->facts.packet_rays = 1;
    expect_same_answers(LOOK_TINTED, NULL);
    device->facts.packet_rays = packet_rays;
}

/* ---- a thousand instances ---- */

static void place_moving(struct test_edits *edits, float time)
{
    for (uint32_t i = 0; i < MOVING; i++) {
        float m[12];
        test_transform(m, 1, 1, 1, (int)(i % 3), time + (float)i, 3 * (float)(i % 40) + sinf(time + (float)i),
                       cosf(time * 2 + (float)i), 3 * (float)(i / 40));
        test_node(edits, i + 1, 0, NODE_MESH, 10, m);
    }
}

TEST(a_thousand_moving_instances_rebuild_nothing)
{
    struct fixture fixture;
    struct test_edits edits = {.scene = test_scene_create()};
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    test_soup_mesh(&edits, 10, 200, 0.2f, 1);
    place_moving(&edits, 0);
    test_commit(&edits);
    fixture_init(&fixture, edits.scene, NULL);
    const struct tracer_stats *stats = &fixture.tracer->stats;
    const struct bvh *bvh = bvh_of(&fixture);
    for (int frame = 1; frame <= 20; frame++) {
        place_moving(&fixture.edits, 0.1f * (float)frame);
        update(&fixture);
        /* Nothing but where they are: of the scene its instances, of the trees the top one. */
        assert_int_equal(fixture.changes.uploaded_bytes, MOVING * sizeof(struct instance));
        assert_int_equal(stats->nodes_rebuilt, 0);
        assert_int_equal(stats->nodes_refitted, bvh->tree.top.element_count);
        assert_int_equal(stats->uploaded_bytes,
                         MOVING * sizeof(struct bvh_transform) +
                             bvh->tree.top.element_count * bvh_element_bytes(&bvh->tree.store.settings));
    }
    fixture_finish(&fixture);
}
