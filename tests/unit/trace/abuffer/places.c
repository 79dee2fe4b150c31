/* SPDX-License-Identifier: MIT */
/* Where a texel's run of samples begins is chance: it is the order in which the device reached the texels. */
#include "tests/unit/trace/abuffer/fixture.h"
#include "tests/harness/test.h"
#include "tests/unit/trace/abuffer/scenes.h"

#include "trace/abuffer/trace.h"

#define RAY_COUNT 16384u
#define RESOLUTION 128u
#define VOXELS 16u

struct answers {
    struct hit hits[RAY_COUNT];
    uint32_t visibilities[RAY_COUNT];
};

static bool traverse_wave(void *user, const struct wave *wave, struct error *error)
{
    struct fixture *fixture = user;
    const struct ray_range all = {.wave = wave, .end = wave->ray_count};
    gpu_scene_bind(&fixture->gpu);
    return abuffer_intersect(&fixture->store, &fixture->gpu, &all, &fixture->options, error);
}

/* Triangles of some cells all over the place: most rays pass planes of several before they hit one. */
static struct scene *scene_of_a_soup(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    test_soup_mesh(&edits, 10, 20000, 0.1f, 4);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    return edits.scene;
}

static void rays_through_it(struct ray *rays)
{
    uint64_t seed = 3;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float from[3], to[3];
        for (int k = 0; k < 3; k++) {
            from[k] = test_uniform(&seed, -2, 2);
            to[k] = test_uniform(&seed, -1, 1);
        }
        rays[i] = (struct ray){{from[0], from[1], from[2], 0},
                               {to[0] - from[0], to[1] - from[1], to[2] - from[2], 1e30f}};
    }
}

/* Moves all runs by one place. Samples are read two at a time, so this changes the number of rounds. */
static void shift_runs(struct fixture *fixture)
{
    struct abuffer_store *store = &fixture->store;
    struct error error = {0};
    const size_t count = store->sample_count, texel_count = store->texels.size_bytes / 8;
    uint32_t(*texels)[2] = read_all(&store->texels, texel_count * 8);
    uint32_t(*samples)[2] = read_all(&store->samples, count * 8), (*moved)[2] = calloc(count + 2, 8);
    uint32_t *ids = read_all(&store->ids, count * 4), *moved_ids = calloc(count + 1, 4);
    memcpy(moved[1], samples, count * 8);
    memcpy(&moved_ids[1], ids, count * 4);
    for (size_t i = 0; i < texel_count; i++)
        texels[i][0] += texels[i][1] > 0;
    expect_ok(gpu_buffer_upload(device, &store->texels, texels, texel_count * 8, &error) &&
                  gpu_buffer_upload(device, &store->samples, moved, (count + 2) / 2 * 16, &error) &&
                  gpu_buffer_upload(device, &store->ids, moved_ids, (count + 1) * 4, &error),
              &error);
    free(texels);
    free(samples);
    free(moved);
    free(ids);
    free(moved_ids);
}

ALL_TESTS(open_device, close_device)

/* Rays of one SIMD group look at different columns, for different numbers of rounds. Where a loop ended by a
 * condition at its end, software GL let rays that had left it run on with those that had not: those that had
 * looked at all four columns around an intersection, and would have begun a fifth, took what they read last for
 * their answer. Three of these rays then differed if their runs began at an odd place. */
TEST(answers_do_not_depend_on_where_runs_begin)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct answers *answers[2];
    struct fixture fixture;
    fixture_init(&fixture, scene_of_a_soup());
    fixture.options.abuffer.form = TRACER_FORM_FAST;
    build(&fixture, RESOLUTION, VOXELS);
    rays_through_it(rays);
    for (int shifted = 0; shifted < 2; shifted++) {
        answers[shifted] = malloc(sizeof(**answers));
        if (shifted)
            shift_runs(&fixture);
        trace_rays(traverse_wave, &fixture, WAVE_CLOSEST, rays, RAY_COUNT, answers[shifted]->hits, NULL);
        trace_rays(traverse_wave, &fixture, WAVE_ANY, rays, RAY_COUNT, NULL, answers[shifted]->visibilities);
    }
    uint32_t hit_count = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const struct hit *a = &answers[0]->hits[i], *b = &answers[1]->hits[i];
        hit_count += a->distance >= 0;
        if (a->distance != b->distance || (a->distance >= 0 && a->primitive + 1 != b->primitive) ||
            answers[0]->visibilities[i] != answers[1]->visibilities[i])
            fail_msg("ray %u: sample %u at %.9g; %u at %.9g where runs begin one place later", i, a->primitive,
                     (double)a->distance, b->primitive, (double)b->distance);
    }
    assert_in_range(hit_count, RAY_COUNT / 4, RAY_COUNT);
    fixture_finish(&fixture);
    free(answers[0]);
    free(answers[1]);
    free(rays);
}
