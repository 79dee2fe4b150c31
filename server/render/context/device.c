/* SPDX-License-Identifier: MIT */
/* Spans of a frame's passes, and programs in use. */
#include "render/context/device.h"

#include "base/clock.h"

/* Limit a little below the capacity of the timer's ring: spans beyond it would lose their GPU time. */
#define SPANS_MAX 240

void context_span_begin(struct render_device *device, enum stage stage)
{
    gpu_timer_begin(device->timer, stage, device->wave_number);
    device->span_count++;
}

void context_span_end(struct render_device *device)
{
    gpu_timer_end(device->timer);
    if (device->span_count >= SPANS_MAX && device->counts_on_host)
        context_collect(device);
    else if (device->span_count >= SPANS_MAX)
        context_collect_done(device);
}

/* A frame of many slices and samples has more spans than a record holds; spans of one stage, clock and wave
 * are added up to one, which begins where the first of them did. */
static void add_span(struct stage_times *times, uint64_t origin_ns, const struct record_stage_time *span)
{
    for (uint32_t i = 0; i < times->count; i++) {
        struct record_stage_time *own = &times->spans[i];
        if (own->stage == span->stage && own->clock == span->clock && own->wave == span->wave) {
            own->duration_ns += span->duration_ns;
            return;
        }
    }
    stage_times_add(times, span->stage, span->clock, span->wave, origin_ns + span->start_ns, span->duration_ns);
}

void context_add_times(struct render_device *device, const struct stage_times *spans)
{
    for (uint32_t i = 0; i < spans->count; i++)
        add_span(&device->times, spans->origin_ns, &spans->spans[i]);
}

struct stage_times *context_scratch_times(struct render_device *device)
{
    struct stage_times *spans = &device->collected;
    spans->origin_ns = device->times.origin_ns;
    spans->count = 0;
    return spans;
}

void context_collect(struct render_device *device)
{
    struct stage_times *spans = context_scratch_times(device);
    gpu_timer_collect(device->timer, spans);
    context_add_times(device, spans);
    device->span_count = 0;
}

void context_collect_done(struct render_device *device)
{
    struct stage_times *spans = context_scratch_times(device);
    device->span_count = (uint32_t)gpu_timer_collect_done(device->timer, spans);
    context_add_times(device, spans);
}

void context_add_cpu_time(struct render_device *device, enum stage stage, uint64_t start_ns)
{
    const struct record_stage_time span = {
        .stage = stage,
        .clock = CLOCK_CPU,
        .wave = device->wave_number,
        .start_ns = start_ns - device->times.origin_ns,
        .duration_ns = clock_now_ns() - start_ns,
    };
    add_span(&device->times, device->times.origin_ns, &span);
}

const struct gpu_program *context_use_with(struct render_device *device, const char *compute,
                                           const struct gpu_define *defines, struct error *error)
{
    const struct gpu_program_source source = {.compute = compute, .defines = defines};
    return gpu_program_get(device->gpu, &source, error);
}

const struct gpu_program *context_use(struct render_device *device, const char *compute, struct error *error)
{
    return context_use_with(device, compute, NULL, error);
}
