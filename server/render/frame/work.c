/* SPDX-License-Identifier: MIT */
/* Resources of frames in progress, passed from one frame to the next: of many viewers of a scene few have a frame
 * in progress at a time, and between two frames a viewer keeps its picture alone. */
#include "render/frame/state.h"

#include <stdlib.h>

static void work_destroy(struct frame_work *work, struct gpu_device *device)
{
    wave_passes_finish(&work->passes, device);
    trace_state_destroy(work->trace_state);
    trace_state_destroy(work->key_trace_state);
    comparison_destroy(work->comparison);
    primary_finish(&work->primary, device);
    layers_finish(&work->layers, device);
    denoise_filter_finish(&work->denoise, device);
    slices_ahead_finish(&work->ahead, device);
    for (int i = 0; i < 2; i++)
        gpu_readback_finish(device, &work->copies[i]);
    context_finish(&work->context);
    gpu_timer_destroy(work->context.timer);
    free(work);
}

static struct frame_work *work_create(struct frame_scene *shared, struct error *error)
{
    struct frame_work *work = calloc(1, sizeof(*work));
    if (work)
        work->context.timer = gpu_timer_create(shared->device);
    if (!work || !work->context.timer) {
        free(work);
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a frame");
        return NULL;
    }
    work->context.device = shared->device;
    work->context.layers = &work->layers;
    work->context.scene = &shared->copy;
    work->context.environment = &shared->environment;
    work->context.environment_choice = &shared->environment_choice;
    return work;
}

static struct frame_work *take_idle(struct frame_scene *shared, const struct integrator *integrator)
{
    struct frame_work **place = &shared->idle;
    if (!*place)
        return NULL;
    for (struct frame_work **one = place; *one; one = &(*one)->next)
        if ((*one)->passes.integrator == integrator)
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
    if (work && work->passes.integrator != integrator) {
        wave_passes_finish(&work->passes, shared->device);
        work->passes.integrator = integrator;
        slices_ahead_forget(&work->ahead);
    }
    return work;
}

/* As many stay as are in use, and one. */
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
    work->context.trace_state = *state;
    if (*state)
        trace_state_reset(*state);
    return *state;
}

uint64_t frame_work_device_bytes(const struct frame_work *work)
{
    uint64_t sum = context_device_bytes(&work->context) + work->primary.visible.size_bytes +
                   work->primary.depth.size_bytes + layers_device_bytes(&work->layers) +
                   denoise_filter_device_bytes(&work->denoise) + work->copies[0].capacity_bytes +
                   work->copies[1].capacity_bytes + wave_passes_device_bytes(&work->passes);
    if (work->trace_state)
        sum += trace_state_device_bytes(work->trace_state);
    if (work->key_trace_state)
        sum += trace_state_device_bytes(work->key_trace_state);
    if (work->comparison)
        sum += comparison_device_bytes(work->comparison);
    return sum;
}
