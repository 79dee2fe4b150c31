/* SPDX-License-Identifier: MIT */
/* The benchmark's rival, a sparse voxel octree: it hits what is there, where it is, and nothing else; so it is
 * worth being held against. The truth are two spheres' equations. */
#include "tests/bench/svo.h"

#include "shared/hit.h"
#include "shared/ray.h"
#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <stddef.h>

#define RAYS 20000u
#define STEPS 96u /* of the mesh, whose facets lie up to 1 - cos(pi / 96) = 0.0006 below their sphere */
#define RESOLUTION 128u
/* A cell's corners are as far from each other; a hit is somewhere in a cell that holds some of the surface. */
#define DIAGONAL_CELLS 1.7321f

/* The first is a mesh, the second a sphere; they are apart. */
static const float centres_radii[2][4] = {{0, 0, 0, 1}, {2.5f, 0.7f, 0.4f, 0.8f}};

struct fixture {
    struct scene *scene;
    struct gpu_scene gpu;
    struct gpu_buffer rays, answers;
    struct ray *cast;
};

static void must(bool done, const struct error *error)
{
    if (!done)
        fail_msg("%s: %s", error->field, error->text);
}

static struct scene *two_spheres(void)
{
    static float vertices[(STEPS + 1) * (STEPS + 1)][3];
    static uint32_t indices[STEPS * STEPS * 6];
    struct test_edits edits = {.scene = test_scene_create()};
    uint32_t *next = indices;
    for (uint32_t i = 0; i <= STEPS; i++) {
        for (uint32_t j = 0; j <= STEPS; j++) {
            const float theta = 3.14159265f * (float)i / STEPS, phi = 6.28318531f * (float)(j % STEPS) / STEPS;
            float *v = vertices[i * (STEPS + 1) + j];
            v[0] = sinf(theta) * cosf(phi);
            v[1] = cosf(theta);
            v[2] = -sinf(theta) * sinf(phi);
            const uint32_t a = i * (STEPS + 1) + j, b = a + STEPS + 1;
            if (i == STEPS || j == STEPS)
                continue;
            const uint32_t corners[6] = {a, b, a + 1, a + 1, b, b + 1};
            memcpy(next, corners, sizeof(corners));
            next += 6;
        }
    }
    test_mesh(&edits, 1, (const float(*)[3])vertices, (STEPS + 1) * (STEPS + 1), indices, STEPS * STEPS * 2);
    test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
    test_spheres(&edits, 1, &centres_radii[1], 1);
    test_node(&edits, 2, 0, NODE_SPHERES, 1, NULL);
    test_commit(&edits);
    return edits.scene;
}

static void cast_rays(struct ray *rays)
{
    uint64_t seed = 3;
    for (uint32_t i = 0; i < RAYS; i++) {
        float length = 0, *direction = rays[i].direction_t_max;
        for (int k = 0; k < 3; k++) {
            rays[i].origin_t_min[k] = test_uniform(&seed, -6, 6);
            direction[k] =
                test_uniform(&seed, k == 0 ? -1.0f : -0.8f, k == 0 ? 3.0f : 1.2f) - rays[i].origin_t_min[k];
            length += direction[k] * direction[k];
        }
        for (int k = 0; k < 3; k++)
            direction[k] /= sqrtf(length);
        rays[i].origin_t_min[3] = 0;
        direction[3] = 1e30f;
    }
}

static void begin(struct fixture *stage)
{
    struct error error = {0};
    struct scene_changes changes;
    *stage = (struct fixture){.scene = two_spheres(), .cast = malloc(RAYS * sizeof(*stage->cast))};
    cast_rays(stage->cast);
    gpu_scene_init(&stage->gpu, device);
    must(gpu_scene_update(&stage->gpu, stage->scene, NULL, &changes, NULL, &error) &&
             gpu_buffer_upload(device, &stage->rays, stage->cast, RAYS * sizeof(*stage->cast), &error) &&
             gpu_buffer_reserve(device, &stage->answers, RAYS * sizeof(struct hit), &error),
         &error);
}

static void end(struct fixture *stage)
{
    gpu_buffer_finish(device, &stage->rays);
    gpu_buffer_finish(device, &stage->answers);
    gpu_scene_finish(&stage->gpu);
    scene_destroy(stage->scene);
    free(stage->cast);
}

static struct tracer *build(struct fixture *stage, const struct tracer_impl *impl, uint32_t resolution)
{
    struct error error = {0};
    const struct tracer_options options = {.bench = {.baseline_side = resolution}};
    struct tracer *tracer = tracer_create(impl, device, &options, &error);
    must(tracer && tracer_update(tracer, &stage->gpu, &(struct tracer_update){0}, &error), &error);
    return tracer;
}

static void trace(struct fixture *stage, struct tracer *tracer, enum wave_kind kind, void *answers, size_t bytes)
{
    struct error error = {0};
    const struct wave wave = {.kind = kind,
                              .ray_count = RAYS,
                              .rays = &stage->rays,
                              .hits = &stage->answers,
                              .visibility = &stage->answers};
    gpu_scene_bind(&stage->gpu);
    must(tracer_trace(tracer, &stage->gpu, &wave, &error), &error);
    gpu_buffer_read(device, &stage->answers, 0, answers, bytes);
}

/* How near to a sphere's middle the ray comes, and how far along. */
static float nearest_to(const struct ray *ray, const float sphere[4], float *along)
{
    const float *o = ray->origin_t_min, *d = ray->direction_t_max;
    float squared = 0;
    *along = 0;
    for (int k = 0; k < 3; k++)
        *along += (sphere[k] - o[k]) * d[k];
    for (int k = 0; k < 3; k++) {
        const float from = o[k] + *along * d[k] - sphere[k];
        squared += from * from;
    }
    return sqrtf(squared);
}

/* Of the point of a ray to the surface of the nearer sphere. */
static float off_surface(const struct ray *ray, float distance)
{
    float minimum = 1e30f;
    for (int s = 0; s < 2; s++) {
        float squared = 0;
        for (int k = 0; k < 3; k++) {
            const float from = ray->origin_t_min[k] + distance * ray->direction_t_max[k] - centres_radii[s][k];
            squared += from * from;
        }
        minimum = fminf(minimum, fabsf(sqrtf(squared) - centres_radii[s][3]));
    }
    return minimum;
}

/* What a ray has to do with the spheres, where it is clear: which one it hits first, -1: none, -2: it begins in
 * one, or passes by so closely that cells may differ. */
static int truth_of(const struct ray *ray, float margin, float *distance)
{
    int first = -1;
    *distance = 1e30f;
    for (int s = 0; s < 2; s++) {
        const float radius = centres_radii[s][3];
        float along, near = nearest_to(ray, centres_radii[s], &along);
        const float half = near < radius ? sqrtf(radius * radius - near * near) : 0;
        const bool is_inside = near < radius + margin && fabsf(along) < half + 8 * margin;
        if (is_inside || (along > 0 && fabsf(near - radius) < margin))
            return -2;
        if (along > 0 && near < radius && along - half < *distance) {
            *distance = along - half;
            first = s;
        }
    }
    return first;
}

static void hits_are_of(const struct tracer_impl *impl, float off_max_cells, float off_usual_cells)
{
    struct fixture stage;
    begin(&stage);
    struct tracer *tracer = build(&stage, impl, RESOLUTION);
    struct hit *hits = malloc(RAYS * sizeof(*hits));
    const float cell = svo_facts(tracer).cell_world;
    uint32_t clear[3] = {0}, unusual = 0;
    trace(&stage, tracer, WAVE_CLOSEST, hits, RAYS * sizeof(*hits));
    for (uint32_t i = 0; i < RAYS; i++) {
        float distance;
        const int truth = truth_of(&stage.cast[i], DIAGONAL_CELLS * cell, &distance);
        if (truth == -2)
            continue;
        clear[truth + 1]++;
        if (truth == -1) {
            assert_true(hits[i].distance < 0);
            continue;
        }
        assert_int_equal(hits[i].instance, truth);
        const float off_cells = off_surface(&stage.cast[i], hits[i].distance) / cell;
        assert_true(off_cells <= off_max_cells);
        unusual += off_cells > off_usual_cells;
    }
    assert_true(clear[0] > RAYS / 20 && clear[1] > RAYS / 10 && clear[2] > RAYS / 10);
    assert_true(unusual <= (clear[1] + clear[2]) / 20);
    free(hits);
    tracer_destroy(tracer);
    end(&stage);
}

ALL_TESTS(open_device, close_device)

/* The middle of the way through a cell that the surface passes: off by half of the diagonal in all but a few. */
TEST(cells_are_hit_where_the_surface_is)
{
    hits_are_of(&svo_cells_impl, DIAGONAL_CELLS, DIAGONAL_CELLS / 2);
    hits_are_of(&svo_tiles_impl, DIAGONAL_CELLS, DIAGONAL_CELLS / 2);
}

/* What a cell has of these spheres is a tenth of a cell from its plane: it bends by 1 / (2 radius) cells, where a
 * radius is 28 cells, and a plane's distance is the mean of where texels of three images met it. */
TEST(planes_are_hit_nearer_to_it)
{
    hits_are_of(&svo_planes_impl, DIAGONAL_CELLS, 0.25f);
}

TEST(rays_to_anything_are_stopped_where_it_is)
{
    static const struct tracer_impl *const impls[] = {&svo_cells_impl, &svo_planes_impl, &svo_tiles_impl};
    struct fixture stage;
    begin(&stage);
    uint32_t *visibility = malloc(RAYS * sizeof(*visibility));
    for (int which = 0; which < 3; which++) {
        struct tracer *tracer = build(&stage, impls[which], RESOLUTION);
        const float margin = DIAGONAL_CELLS * svo_facts(tracer).cell_world;
        trace(&stage, tracer, WAVE_ANY, visibility, RAYS * sizeof(*visibility));
        for (uint32_t i = 0; i < RAYS; i++) {
            float distance;
            const int truth = truth_of(&stage.cast[i], margin, &distance);
            if (truth != -2)
                assert_int_equal(visibility[i] != 0, truth == -1);
        }
        tracer_destroy(tracer);
    }
    free(visibility);
    end(&stage);
}

/* A surface of s cells has as many leaves, times what its lean to the axes makes of them: 1 to sqrt(3), 1.5 in the
 * mean of a sphere. The list has less room at first than the finest one needs. */
TEST(every_resolution_has_the_leaves_of_its_surface)
{
    static const uint32_t resolutions[] = {16, 100, 512, 1024};
    struct fixture stage;
    begin(&stage);
    for (int i = 0; i < 4; i++) {
        struct tracer *tracer = build(&stage, &svo_cells_impl, resolutions[i]);
        const struct svo_build_facts facts = svo_facts(tracer);
        const double cell = (double)facts.cell_world;
        const double leaves = 4 * 3.14159265 * (1 + 0.8 * 0.8) / (cell * cell);
        assert_in_range(facts.leaves, (uint32_t)(0.6 * leaves), (uint32_t)(1.3 * leaves));
        assert_true(facts.fragments >= facts.leaves);
        tracer_destroy(tracer);
    }
    end(&stage);
}
