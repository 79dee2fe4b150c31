/* SPDX-License-Identifier: MIT */
/* Resources of frames in progress, passed from one frame to the next: of many viewers of a scene few have a frame
 * in progress at a time, and between two frames a viewer keeps its picture alone. */
#include "render/frame/work.h"

#include "render/frame/passes.h"
#include "render/passes/ground/ground.h"

#include <stdlib.h>

static void work_destroy(struct frame_work *work, struct gpu_device *device)
{
    passes_finish(work, device);
    trace_state_destroy(work->trace_state);
    trace_state_destroy(work->key_trace_state);
    comparison_destroy(work->comparison);
    slices_ahead_finish(&work->ahead, device);
    for (int i = 0; i < 2; i++)
        gpu_readback_finish(device, &work->copies[i]);
    context_finish(&work->wave);
    gpu_buffer_finish(device, &work->frame.uniform_buffer);
    gpu_timer_destroy(work->device.timer);
    free(work);
}

static struct frame_work *work_create(struct frame_scene *shared, struct error *error)
{
    struct frame_work *work = calloc(1, sizeof(*work));
    if (work)
        work->device.timer = gpu_timer_create(shared->device);
    if (!work || !work->device.timer) {
        free(work);
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a frame");
        return NULL;
    }
    work->device.gpu = shared->device;
    work->frame.device = work->wave.device = &work->device;
    work->frame.scene = &shared->copy;
    work->frame.environment = &shared->environment;
    work->frame.environment_choice = &shared->environment_choice;
    work->wave.frame = &work->frame;
    work->wave.notes = &work->layers.notes;
    work->shading.extra = &ground_shading;
    return work;
}

static struct frame_work *take_idle(struct frame_scene *shared, const struct integrator *integrator)
{
    struct frame_work **place = &shared->idle;
    if (!*place)
        return NULL;
    for (struct frame_work **one = place; *one; one = &(*one)->next)
        if ((*one)->frame.integrator == integrator)
            place = one;
    struct frame_work *work = *place;
    *place = work->next;
    shared->idle_count--;
    return work;
}

struct frame_work *frame_work_take(struct frame_scene *shared, const struct integrator *integrator,
                                   struct error *error)
{
    struct frame_work *work = take_idle(shared, integrator);
    if (!work)
        work = work_create(shared, error);
    if (work && work->frame.integrator != integrator) {
        shading_pass.finish(&work->shading, shared->device);
        work->frame.integrator = integrator;
        slices_ahead_forget(&work->ahead);
    }
    return work;
}

/* Keeps as much idle work as is in use, and one more. */
void frame_work_give(struct frame_scene *shared, struct frame_work *work)
{
    if (!work)
        return;
    work->next = shared->idle;
    shared->idle = work;
    shared->idle_count++;
    while (shared->idle_count > shared->frames + 1) {
        struct frame_work *extra = shared->idle->next;
        shared->idle->next = extra->next;
        shared->idle_count--;
        work_destroy(extra, shared->device);
    }
}

void frame_work_finish(struct frame_scene *shared)
{
    while (shared->idle) {
        struct frame_work *next = shared->idle->next;
        work_destroy(shared->idle, shared->device);
        shared->idle = next;
    }
    shared->idle_count = 0;
}

bool frame_work_trace_by(struct frame_work *work, struct trace_state **state, const struct tracer *tracer,
                         struct error *error)
{
    if (!*state || !trace_state_fits(*state, tracer->impl, &tracer->options)) {
        trace_state_destroy(*state);
        *state = trace_state_create(tracer->impl, tracer->device, &tracer->options, error);
        slices_ahead_forget(&work->ahead);
    }
    work->frame.trace_state = *state;
    if (*state)
        trace_state_reset(*state);
    return *state;
}

uint64_t frame_work_device_bytes(const struct frame_work *work)
{
    uint64_t sum = context_device_bytes(&work->wave) + work->primary.visible.size_bytes +
                   work->primary.depth.size_bytes + layers_device_bytes(&work->layers) +
                   denoise_filter_device_bytes(&work->denoise) + work->copies[0].capacity_bytes +
                   work->copies[1].capacity_bytes + wave_shading_device_bytes(&work->shading);
    if (work->trace_state)
        sum += trace_state_device_bytes(work->trace_state);
    if (work->key_trace_state)
        sum += trace_state_device_bytes(work->key_trace_state);
    if (work->comparison)
        sum += comparison_device_bytes(work->comparison);
    return sum;
}
