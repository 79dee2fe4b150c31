/* SPDX-License-Identifier: MIT */
/* That the tracer `bvh` answers the same to the bit however its scene came about: frames of an animation must not
 * depend on which frames were rendered before. And what instances that all move cost. */
#include "tests/accuracy/test_scenes.h"

#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/bvh/tracer.h"
#include "gpu_scene/scene.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <stddef.h>

#define RAY_COUNT 32768u
#define INSTANCES 60u
#define MOVING 1000u

struct fixture {
    struct scene *scene;
    struct gpu_scene gpu;
    struct test_edits edits;
    struct tracer *tracer;
    struct scene_changes changes; /* of the last update */
};

static void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

static void update(struct fixture *fixture)
{
    struct error error = {0};
    if (fixture->edits.count > 0)
        test_commit(&fixture->edits);
    expect_ok(gpu_scene_update(&fixture->gpu, fixture->scene, NULL, &fixture->changes, NULL, &error), &error);
    expect_ok(tracer_update(fixture->tracer, &fixture->gpu,
                            &(struct tracer_update){.changed = fixture->changes.bits}, &error),
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

static const struct bvh *bvh_of(const struct fixture *fixture)
{
    return (const struct bvh *)fixture->tracer;
}

/* ---- histories ---- */

enum look { LOOK_PLAIN, LOOK_CUTOUT, LOOK_TINTED, LOOKS };

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
        first->alpha_mode = ALPHA_MASK;
        first->textures[MATERIAL_BASE_COLOUR].texture = 1;
    } else if (look == LOOK_TINTED) {
        first->transmission = 0.9f;
        second->alpha_mode = ALPHA_BLEND;
        second->base_colour[3] = 0.3f;
    }
    test_soup_mesh(&edits, 10, 90, 0.4f, 1);
    test_soup_mesh(&edits, 11, 60, 0.4f, 2);
    struct scene_mesh *slab = test_mesh(&edits, 12, square, 4, indices, 4);
    slab->ranges = test_ranges(&(struct material_range){0, 4, 2}, 1);
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

static void *trace(struct fixture *fixture, const struct ray *rays, enum wave_kind kind)
{
    struct error error = {0};
    struct gpu_buffer ray_buffer = {0}, answers = {0};
    size_t bytes = RAY_COUNT * (kind == WAVE_ANY ? sizeof(uint32_t) : sizeof(struct hit));
    expect_ok(gpu_buffer_upload(device, &ray_buffer, rays, RAY_COUNT * sizeof(*rays), &error) &&
                  gpu_buffer_reserve(device, &answers, bytes, &error),
              &error);
    gpu_scene_bind(&fixture->gpu);
    const struct wave wave = {
        .kind = kind, .ray_count = RAY_COUNT, .rays = &ray_buffer, .hits = &answers, .visibility = &answers};
    expect_ok(tracer_trace(fixture->tracer, &fixture->gpu, &wave, &error), &error);
    void *read = malloc(bytes);
    gpu_buffer_read(device, &answers, 0, read, bytes);
    gpu_buffer_finish(device, &ray_buffer);
    gpu_buffer_finish(device, &answers);
    return read;
}

/* As it is built, and refitted from places all over, in two steps. */
static void make_histories(struct fixture *built, struct fixture *moved, enum look look,
                           const struct tracer_options *options)
{
    struct test_edits edits = {.scene = scene_of_shapes(look)};
    place(&edits, 5);
    test_commit(&edits);
    fixture_init(built, edits.scene, options);
    edits = (struct test_edits){.scene = scene_of_shapes(look)};
    place(&edits, 6);
    test_commit(&edits);
    fixture_init(moved, edits.scene, options);
    for (uint64_t seed = 7; seed-- > 5;) {
        place(&moved->edits, seed);
        update(moved);
        assert_int_equal(moved->tracer->stats.nodes_rebuilt, 0);
    }
    const struct bvh_top *a = &bvh_of(built)->tree.top, *b = &bvh_of(moved)->tree.top;
    assert_true(a->element_count != b->element_count ||
                memcmp(a->leaves, b->leaves, a->element_count * sizeof(*a->leaves)) != 0); /* other trees */
}

static void expect_same_answers(enum look look, const struct tracer_options *options)
{
    struct fixture built, moved;
    make_histories(&built, &moved, look, options);
    struct ray *rays = make_rays();
    struct hit *expected = trace(&built, rays, WAVE_CLOSEST), *hits = trace(&moved, rays, WAVE_CLOSEST);
    uint32_t hit_count = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        hit_count += expected[i].distance >= 0;
        if (memcmp(&expected[i], &hits[i], sizeof(*hits)) != 0)
            fail_msg("ray %u, packets of %u: distance %.9g, primitive %u, instance %u; %.9g, %u, %u in the tree "
                     "that was refitted",
                     i, options->bvh.rays, (double)expected[i].distance, expected[i].primitive,
                     expected[i].instance, (double)hits[i].distance, hits[i].primitive, hits[i].instance);
        assert_true(expected[i].distance < 0 || expected[i].instance % 2 == 0); /* of two the first */
    }
    assert_in_range(hit_count, RAY_COUNT / 4, RAY_COUNT);
    uint32_t *light = trace(&built, rays, WAVE_ANY), *other = trace(&moved, rays, WAVE_ANY), tinted = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        tinted += (light[i] & 0xff) != 0 && (light[i] & 0xff) != 0xff;
        if (light[i] != other[i])
            fail_msg("ray %u, packets of %u: visibility %08x, %08x in the tree that was refitted", i,
                     options->bvh.rays, light[i], other[i]);
    }
    assert_in_range(tinted, look == LOOK_TINTED ? RAY_COUNT / 8 : 0, RAY_COUNT);
    free(rays);
    free(expected);
    free(hits);
    free(light);
    free(other);
    fixture_finish(&built);
    fixture_finish(&moved);
}

ALL_TESTS(open_device, close_device)

TEST(answers_do_not_depend_on_how_instances_came_to_where_they_are)
{
    static const struct tracer_options forms[] = {
        {.bvh = {.rays = 1}},
        {.bvh = {.rays = 8}},
        {.bvh = {.rays = 3}},
        {.bvh = {.bounds = BVH_BOUNDS_SPHERE, .rays = 2}},
    };
    for (size_t form = 0; form < sizeof(forms) / sizeof(forms[0]); form++)
        expect_same_answers(LOOK_PLAIN, &forms[form]);
    for (enum look look = LOOK_CUTOUT; look < LOOKS; look++)
        for (size_t form = 0; form < 2; form++)
            expect_same_answers(look, &forms[form]);
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
