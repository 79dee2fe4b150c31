/* SPDX-License-Identifier: MIT */
/* Brute force in parts: none is longer than a device bears, and all of them together give the same answers. */
#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/waves.h"

#include "trace/naive/parts.h"
#include "trace/tracer.h"

#include <stdlib.h>
#include <string.h>

#define RAY_COUNT 1024u

ALL_TESTS(open_device, close_device)

TEST(parts_have_each_primitive_once_and_are_no_longer_than_allowed)
{
    static const uint32_t counts[] = {5, 0, 1, 1u << 30, 7, 0}, maxima[] = {2, 3, 6, 1000, 1u << 16, UINT32_MAX};
    enum { INSTANCES = sizeof(counts) / sizeof(counts[0]) };
    struct gpu_scene_geometry geometries[INSTANCES] = {0};
    struct instance instances[INSTANCES] = {0};
    const struct gpu_scene scene = {.instances = instances,
                                    .geometries = geometries,
                                    .instance_count = INSTANCES,
                                    .geometry_count = INSTANCES};
    for (size_t m = 0; m < sizeof(maxima) / sizeof(maxima[0]); m++) {
        const bool is_small = maxima[m] < 1000;
        struct naive_part part = {0};
        uint64_t tests = 0, expected = INSTANCES;
        uint32_t parts = 0;
        for (uint32_t i = 0; i < INSTANCES; i++) {
            geometries[i].device.primitive_count = is_small && counts[i] > 100 ? 100 : counts[i];
            instances[i].geometry = i;
            expected += geometries[i].device.primitive_count;
        }
        while (naive_next_part(&scene, maxima[m], &part)) {
            assert_in_range(part.tests, 1, maxima[m]);
            if (maxima[m] <= 1u << 16) /* a group of rays at least */
                assert_in_range((uint64_t)part.tests * naive_rays_of(&part, 1u << 30), 1, 1u << 30);
            tests += part.tests;
            if (part.first_primitive > 0) /* an instance is entered once more by each part that begins in it */
                expected++;
            parts++;
        }
        assert_int_equal(tests, expected);
        assert_in_range(parts, expected / maxima[m], expected / maxima[m] * 2 + INSTANCES);
    }
}

static void *trace(struct gpu_scene *gpu, const struct ray *rays, enum wave_kind kind, uint32_t tests)
{
    const struct gpu_facts facts = device->facts;
    struct error error = {0};
    const size_t each = kind == WAVE_ANY ? sizeof(uint32_t) : sizeof(struct hit);
    struct gpu_buffer ray_buffer = {0}, answers = {0};
    gpu_facts_choose(&device->facts, facts.software && tests == 0);
    /* Where materials are evaluated at intersections, a test counts as eight rounds. */
    const uint32_t rounds = gpu->has_cutout || gpu->has_translucent ? 8 : 1;
    device->facts.ray_tests_max = tests > 0 ? tests * rounds : device->facts.ray_tests_max;
    struct tracer *tracer = tracer_create(&tracer_naive_impl, device, NULL, &error);
    expect_ok(tracer && tracer_update(tracer, gpu, &(struct tracer_update){0}, &error) &&
                  gpu_buffer_upload(device, &ray_buffer, rays, RAY_COUNT * sizeof(*rays), &error) &&
                  gpu_buffer_reserve(device, &answers, RAY_COUNT * each, &error),
              &error);
    gpu_scene_bind(gpu);
    const struct wave wave = {.kind = kind,
                              .ray_count = RAY_COUNT,
                              .rays = &ray_buffer,
                              .hits = kind == WAVE_ANY ? NULL : &answers,
                              .visibility = kind == WAVE_ANY ? &answers : NULL};
    expect_ok(tracer_trace(tracer, gpu, &wave, &error), &error);
    void *read = malloc(RAY_COUNT * each);
    gpu_buffer_read(device, &answers, 0, read, RAY_COUNT * each);
    gpu_buffer_finish(device, &ray_buffer);
    gpu_buffer_finish(device, &answers);
    tracer_destroy(tracer);
    device->facts = facts;
    return read;
}

/* Cutouts, tints, spheres, discs; parts that end within an instance and between two. */
TEST(answers_do_not_depend_on_the_parts)
{
    struct scene *(*const scenes[])(void) = {test_scene_soup, test_scene_spheres, test_scene_translucent};
    static const uint32_t tests[] = {2, 13, 100};
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    uint64_t seed = 51;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        for (int k = 0; k < 3; k++) {
            rays[i].origin_t_min[k] = test_uniform(&seed, -4, 4);
            rays[i].direction_t_max[k] = test_uniform(&seed, -1, 1) - rays[i].origin_t_min[k];
            rays[i].origin_t_min[3] = 0;
            rays[i].direction_t_max[3] = i % 16 ? 1e9f : -1;
        }
    for (size_t s = 0; s < sizeof(scenes) / sizeof(scenes[0]); s++) {
        struct error error = {0};
        struct scene_changes changes;
        struct scene *scene = scenes[s]();
        struct gpu_scene gpu;
        gpu_scene_init(&gpu, device);
        expect_ok(gpu_scene_update(&gpu, scene, NULL, &changes, NULL, &error), &error);
        for (int kind = WAVE_CLOSEST; kind <= WAVE_ANY; kind++) {
            const size_t each = kind == WAVE_ANY ? sizeof(uint32_t) : sizeof(struct hit);
            void *expected = trace(&gpu, rays, (enum wave_kind)kind, 0);
            for (size_t t = s == 0 ? 0 : 1; t < sizeof(tests) / sizeof(tests[0]); t++) {
                void *got = trace(&gpu, rays, (enum wave_kind)kind, tests[t]);
                assert_memory_equal(got, expected, RAY_COUNT * each);
                free(got);
            }
            free(expected);
        }
        gpu_scene_finish(&gpu);
        scene_destroy(scene);
    }
    free(rays);
}
