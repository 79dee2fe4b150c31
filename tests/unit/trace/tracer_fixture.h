/* SPDX-License-Identifier: MIT */
/* A tracer and the scene that it is brought to, for the tests of what a tracer promises beside its answers. */
#ifndef FARLIGHT_TESTS_TRACER_FIXTURE_H
#define FARLIGHT_TESTS_TRACER_FIXTURE_H

#include "tests/accuracy/motion_scenes.h"
#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/waves.h"

#include "gpu_scene/scene.h"
#include "trace/tracer.h"

struct fixture {
    struct scene *scene;
    struct gpu_scene gpu;
    struct test_edits edits;
    struct tracer *tracer;
    struct scene_changes changes; /* changes of the last update */
    struct stage_times times;     /* times of the last update */
    struct scene_motion motion;
    uint64_t memory_before_bytes; /* bytes on the device */
};

/* Commits the edits and brings the tracer to them, and to the motion if there is one. */
static inline bool try_update(struct fixture *fixture, struct error *error)
{
    if (fixture->edits.count > 0)
        test_commit(&fixture->edits);
    const struct scene_motion *motion = fixture->motion.pose_count ? &fixture->motion : NULL;
    expect_ok(gpu_scene_update(&fixture->gpu, fixture->scene, motion, &fixture->changes, NULL, error), error);
    stage_times_begin(&fixture->times);
    return tracer_update(fixture->tracer, &fixture->gpu,
                         &(struct tracer_update){.changed = fixture->changes.bits, .times = &fixture->times},
                         error);
}

static inline void update(struct fixture *fixture)
{
    struct error error = {0};
    expect_ok(try_update(fixture, &error), &error);
}

/* `number`: the tracer's; owns the scene. */
static inline void fixture_init_by(struct fixture *fixture, unsigned number, struct scene *scene,
                                   const struct tracer_options *options)
{
    struct error error = {0};
    *fixture = (struct fixture){
        .scene = scene, .edits = {.scene = scene}, .memory_before_bytes = device->memory_used_bytes};
    gpu_scene_init(&fixture->gpu, device);
    fixture->tracer = tracer_create(tracer_impl_by_number(number), device, options, &error);
    expect_ok(fixture->tracer != NULL, &error);
    update(fixture);
}

/* Nothing of it is left on the device: of several, the one that was made last goes first. */
static inline void fixture_finish(struct fixture *fixture)
{
    tracer_destroy(fixture->tracer);
    gpu_scene_finish(&fixture->gpu);
    scene_motion_finish(&fixture->motion);
    scene_destroy(fixture->scene);
    assert_int_equal(device->memory_used_bytes, fixture->memory_before_bytes);
}

static inline bool trace_by_tracer(void *user, const struct wave *wave, struct error *error)
{
    struct fixture *fixture = user;
    gpu_scene_bind(&fixture->gpu);
    return tracer_trace(fixture->tracer, &fixture->gpu, wave, error);
}

static inline struct hit trace_one(struct fixture *fixture, struct ray ray)
{
    struct hit hit;
    trace_rays(trace_by_tracer, fixture, WAVE_CLOSEST, &ray, 1, &hit, NULL);
    return hit;
}

/* How far something is below a point at a height of 10, a little askew so that no ray lies on an edge between
 * cells; negative where nothing is. */
static inline float distance_below(struct fixture *fixture, float x, float y)
{
    return trace_one(fixture, (struct ray){{x + 0.013f, y + 0.017f, 10, 0}, {0, 0, -1, 1e9f}}).distance;
}

/* Each is refused when a tracer is made, as one that cannot be, by the name of its field. */
struct refused_options {
    const char *field;
    struct tracer_options options;
};
static inline void expect_options_refused(unsigned number, const struct refused_options *rows, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct error error = {0};
        assert_null(tracer_create(tracer_impl_by_number(number), device, &rows[i].options, &error));
        assert_int_equal(error.kind, ERROR_INVALID);
        assert_string_equal(error.field, rows[i].field);
    }
}

#endif
