/* SPDX-License-Identifier: MIT */
/* The device of a test's program, and waves of rays on it. */
#ifndef FARLIGHT_TESTS_DEVICE_FIXTURE_H
#define FARLIGHT_TESTS_DEVICE_FIXTURE_H

#include "shared/hit.h"
#include "shared/ray.h"
#include "tests/fixtures/device.h"
#include "trace/wave.h"

#include <stdio.h>

static inline void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

/* What answers a wave; `user` is the test's. */
typedef bool wave_tracer(void *user, const struct wave *wave, struct error *error);

/* Reads back what it answers to `count` rays: hits, or of WAVE_ANY visibility; the other may be NULL. */
static inline void trace_rays(wave_tracer *tracer, void *user, enum wave_kind kind, bool crossings_only,
                              const struct ray *rays, uint32_t count, struct hit *hits, uint32_t *visibility)
{
    struct error error = {0};
    struct gpu_buffer ray_buffer = {0}, answers = {0};
    expect_ok(gpu_buffer_upload(device, &ray_buffer, rays, count * sizeof *rays, &error), &error);
    expect_ok(gpu_buffer_reserve(device, &answers, count * sizeof *hits, &error), &error);
    const struct wave wave = {.kind = kind,
                              .ray_count = count,
                              .end_ray = count,
                              .rays = &ray_buffer,
                              .hits = &answers,
                              .visibility = &answers,
                              .crossings_only = crossings_only};
    expect_ok(tracer(user, &wave, &error), &error);
    if (kind == WAVE_ANY)
        gpu_buffer_read(device, &answers, 0, visibility, count * sizeof *visibility);
    else
        gpu_buffer_read(device, &answers, 0, hits, count * sizeof *hits);
    expect_ok(gpu_check(device, "a wave", &error), &error);
    gpu_buffer_finish(device, &ray_buffer);
    gpu_buffer_finish(device, &answers);
}

/* Runs the tests on a device of their own, in main(), whose status it returns. */
#define RUN_ON_A_DEVICE(tests)                                                                                    \
    do {                                                                                                          \
        struct error error = {0};                                                                                 \
        device = gpu_device_create(&(struct gpu_options){.index = -1, .debug = true}, &error);                    \
        if (!device) {                                                                                            \
            printf("SKIP: no OpenGL device: %s\n", error.text);                                                   \
            return 0;                                                                                             \
        }                                                                                                         \
        int failures = cmocka_run_group_tests(tests, NULL, NULL);                                                 \
        gpu_device_destroy(device);                                                                               \
        return failures;                                                                                          \
    } while (0)

#endif
