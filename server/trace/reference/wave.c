/* SPDX-License-Identifier: MIT */
/* Waves on the host. A thread traverses a range of rays, so that the GL thread returns at the end of its step
 * even where a single packet of rays takes a quarter of a second. */
#include "trace/reference/tracer.h"

#include "base/clock.h"
#include "base/host.h"
#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/step.h"

#include <stdlib.h>

/* Extra wait after the step's end: the traversal checks the clock between two packets, so it usually ends this
 * soon. */
#define GRACE_NS UINT64_C(500000)

/* ---- life ---- */

struct trace_state *reference_state_create(struct gpu_device *device, const struct tracer_options *options,
                                           struct error *error)
{
    (void)device, (void)options;
    struct reference_wave *wave = calloc(1, sizeof(*wave));
    if (!wave) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the state of a wave");
        return NULL;
    }
    pthread_mutex_init(&wave->lock, NULL);
    pthread_cond_init(&wave->done, NULL);
    return &wave->base;
}

static void join(struct reference_wave *wave)
{
    if (wave->reference)
        pthread_join(wave->thread, NULL);
    wave->reference = NULL;
}

static void cancel(struct reference_wave *wave)
{
    atomic_store(&wave->is_cancelled, true);
    join(wave);
    atomic_store(&wave->is_cancelled, false);
}

void reference_state_destroy(struct trace_state *state)
{
    struct reference_wave *wave = (struct reference_wave *)state;
    cancel(wave);
    pthread_cond_destroy(&wave->done);
    pthread_mutex_destroy(&wave->lock);
    free(wave->rays);
    free(wave->times);
    free(wave->answers);
    free(wave);
}

uint64_t reference_state_device_bytes(const struct trace_state *state)
{
    (void)state;
    return 0; /* its memory is the host's */
}

static bool reserve(struct reference_wave *wave, uint32_t ray_count, struct error *error)
{
    if (ray_count <= wave->ray_capacity)
        return true;
    free(wave->rays);
    free(wave->times);
    free(wave->answers);
    wave->rays = malloc((size_t)ray_count * sizeof(*wave->rays));
    wave->times = malloc((size_t)ray_count * sizeof(*wave->times));
    wave->answers = malloc((size_t)ray_count * sizeof(struct hit));
    wave->ray_capacity = wave->rays && wave->times && wave->answers ? ray_count : 0;
    return wave->ray_capacity > 0 ||
           error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a wave of %u rays", ray_count);
}

bool reference_trace_begin(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                           struct error *error)
{
    (void)tracer, (void)scene;
    struct reference_wave *wave = (struct reference_wave *)state;
    cancel(wave); /* a dropped wave may still be traversed */
    return reserve(wave, state->wave.ray_count, error);
}

/* ---- ranges ---- */

static void traverse(struct reference_wave *wave)
{
    struct reference *reference = wave->reference;
    uint32_t end = reference_traverse(reference, wave);
    atomic_fetch_sub(&reference->waves_under_way, 1);
    pthread_mutex_lock(&wave->lock);
    wave->end = end;
    wave->is_done = true;
    pthread_cond_signal(&wave->done);
    pthread_mutex_unlock(&wave->lock);
}

static void *run_thread(void *context)
{
    host_thread_lower_priority();
    traverse(context);
    return NULL;
}

/* Begins to traverse a range in a thread; without one, at once. */
static void begin_traversal(struct reference *reference, struct reference_wave *wave, const struct ray_range *rays)
{
    const struct wave *whole = &wave->base.wave;
    struct gpu_device *device = reference->base.device;
    const size_t first = rays->first, count = rays->end - rays->first;
    gpu_buffer_read(device, whole->rays, first * sizeof(struct ray), wave->rays + first,
                    count * sizeof(struct ray));
    if (whole->times)
        gpu_buffer_read(device, whole->times, first * sizeof(float), wave->times + first, count * sizeof(float));
    wave->traversed = *whole;
    wave->range = (struct ray_range){.wave = &wave->traversed, .first = rays->first, .end = rays->end};
    wave->step_end_ns = wave->base.step_end_ns;
    wave->is_done = false;
    wave->reference = reference;
    atomic_fetch_add(&reference->waves_under_way, 1);
    if (pthread_create(&wave->thread, NULL, run_thread, wave) == 0)
        return;
    traverse(wave);
    wave->reference = NULL;
}

/* Waits until about the end of the step. True: the traversal is done. */
static bool wait_done(struct reference_wave *wave, uint64_t step_end_ns)
{
    uint64_t until_ns = step_end_ns == STEP_WITHOUT_END ? STEP_WITHOUT_END : step_end_ns + GRACE_NS;
    return clock_wait_for(&wave->is_done, &wave->done, &wave->lock, until_ns);
}

bool reference_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                           const struct ray_range *rays, struct error *error)
{
    (void)scene;
    struct reference *reference = (struct reference *)tracer;
    struct reference_wave *wave = (struct reference_wave *)state;
    const uint64_t start_ns = clock_now_ns();
    if (!wave->reference)
        begin_traversal(reference, wave, rays);
    if (!wait_done(wave, state->step_end_ns)) {
        state->range_end = rays->first; /* the next step continues it */
        return true;
    }
    join(wave);
    tracer->stats.traversal_ns = clock_now_ns() - start_ns;
    if (!reference_check(reference, "tracing", error))
        return false;
    const struct wave *whole = &state->wave;
    const size_t first = wave->range.first, count = wave->end - first;
    state->range_end = wave->end;
    if (whole->kind == WAVE_ANY)
        gpu_buffer_write(tracer->device, whole->visibility, first * sizeof(uint32_t),
                         (const uint32_t *)wave->answers + first, count * sizeof(uint32_t));
    else
        gpu_buffer_write(tracer->device, whole->hits, first * sizeof(struct hit),
                         (const struct hit *)wave->answers + first, count * sizeof(struct hit));
    return true;
}
