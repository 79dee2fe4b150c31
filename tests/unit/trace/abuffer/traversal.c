/* SPDX-License-Identifier: MIT */
/* Traversal of A-buffers where the contract does not look: deep columns, and the paper's own search. */
#include "tests/unit/trace/abuffer/fixture.h"
#include "tests/unit/trace/stack_scene.h"

#include "tests/harness/test.h"
#include "trace/abuffer/trace.h"

#define RAY_COUNT 4096u
#define RESOLUTION 128u
#define VOXELS 16u
#define CELL (2.0f / RESOLUTION) /* the scene is two metres wide */

static bool traverse_wave(void *user, const struct wave *wave, struct error *error)
{
    struct fixture *fixture = user;
    const struct ray_range all = {.wave = wave, .end = wave->ray_count};
    gpu_scene_bind(&fixture->gpu);
    return abuffer_intersect(&fixture->store, &fixture->gpu, &all, &fixture->options, error);
}

static void fixture_init_by(struct fixture *fixture, struct scene *scene, unsigned form)
{
    fixture_init(fixture, scene);
    fixture->options.abuffer.form = form;
    build(fixture, RESOLUTION, VOXELS);
}

static struct ray rays[RAY_COUNT];
static struct hit hits[RAY_COUNT];
static uint32_t visibilities[RAY_COUNT];

ALL_TESTS(open_device, close_device)

/* Rays begin between any two sheets; half of them end before they reach one. */
TEST(deep_columns_are_searched_at_their_depth)
{
    enum { SHEETS = 90 };
    const float apart = 1.3f * CELL;
    struct fixture fixture;
    uint64_t seed = 9;
    fixture_init_by(&fixture, sheets_scene(SHEETS, apart), TRACER_FORM_FAST);
    assert_int_equal(fixture.store.depth_max, SHEETS);
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        rays[i] = (struct ray){
            {test_uniform(&seed, -0.9f, 0.9f), test_uniform(&seed, -0.9f, 0.9f),
             apart * ((float)(test_random(&seed) % (SHEETS - 1)) + 0.5f), 0},
            {test_uniform(&seed, -1, 1), test_uniform(&seed, -1, 1), i % 2 ? 1 : -1, i & 2 ? 1 : 0.4f * apart}};
    trace_rays(traverse_wave, &fixture, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
    trace_rays(traverse_wave, &fixture, WAVE_ANY, rays, RAY_COUNT, NULL, visibilities);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float distance = i & 2 ? 0.5f * apart : -1;
        if (!(fabsf(hits[i].distance - distance) <= 1e-3f * apart) || visibilities[i] != (i & 2 ? 0 : UINT32_MAX))
            fail_msg("ray %u: distance %g, not %g; visibility %08x", i, (double)hits[i].distance, (double)distance,
                     visibilities[i]);
    }
    fixture_finish(&fixture);
}

static double ball_distance(const struct ray *ray, double radius)
{
    double a = 0, b = 0, c = -radius * radius;
    for (int k = 0; k < 3; k++) {
        const double o = (double)ray->origin_t_min[k], d = (double)ray->direction_t_max[k];
        a += d * d, b += o * d, c += o * o;
    }
    return b * b < a * c ? -1 : (-b - sqrt(b * b - a * c)) / a;
}

/* A voxel has one smooth surface: the paper's assumption. A ray misses the ball where it enters and leaves it
 * within a texel of one voxel, at most sqrt(3) times that across. Chords of a ball of radius r are at most c
 * for (c / 2r)^2 of parallel rays. */
TEST(the_paper_misses_no_more_of_a_ball_than_its_rim)
{
    static const float ball[1][4] = {{0, 0, 0, 1}};
    const double rim = pow(sqrt(3.0) / VOXELS, 2);
    uint64_t seed = 7;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float o[3], length = 0;
        for (int k = 0; k < 3; k++) {
            o[k] = test_uniform(&seed, -1, 1);
            length += o[k] * o[k];
        }
        rays[i] = (struct ray){.direction_t_max[3] = 1e30f};
        for (int k = 0; k < 3; k++) {
            rays[i].origin_t_min[k] = 3 * o[k] / sqrtf(length);
            rays[i].direction_t_max[k] = test_uniform(&seed, -1, 1) - rays[i].origin_t_min[k];
        }
    }
    struct test_edits edits = {.scene = test_scene_create()};
    struct fixture fixture;
    uint32_t met = 0, missed = 0, elsewhere = 0;
    test_spheres(&edits, 1, ball, 1);
    test_node(&edits, 1, 0, NODE_SPHERES, 1, NULL);
    test_commit(&edits);
    fixture_init_by(&fixture, edits.scene, TRACER_FORM_PAPER);
    trace_rays(traverse_wave, &fixture, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const double distance = ball_distance(&rays[i], 1), found = (double)hits[i].distance;
        double size = 0;
        for (int k = 0; k < 3; k++)
            size = fmax(size, fabs((double)rays[i].direction_t_max[k]));
        met += distance >= 0;
        elsewhere += distance < 0 && found >= 0;
        missed += distance >= 0 && !(fabs(found - distance) * size < 0.5 * (double)CELL);
    }
    print_message("of %u rays at the ball %u miss it, of others %u hit\n", met, missed, elsewhere);
    assert_in_range(met, RAY_COUNT / 4, RAY_COUNT);
    if (missed > rim * met || elsewhere > RAY_COUNT / 1000)
        fail_msg("%u missed of %u, %u where nothing is", missed, met, elsewhere);
    fixture_finish(&fixture);
}
