/* SPDX-License-Identifier: MIT */
#include "render/wave_trace.h"

#include "base/clock.h"
#include "render/compare/waves.h"

#include <epoxy/gl.h>

/* What a part is to take: a cancel is to be answered within 50 ms, and the next part may be slower. */
#define PART_NS UINT64_C(10000000)
/* The first part of a frame; and how many times as many rays as the last one a part may have, which may have been
 * of rays that leave the scene at once. */
#define PART_RAYS_FIRST 4096u
#define GROWTH_MAX 2u
#define PART_RAYS_MOST (1u << 30)

static bool trace(struct render_context *context, enum ray_kind kind, const struct wave *wave, struct error *error)
{
    context_span_begin(context, kind == RAY_PRIMARY ? STAGE_PRIMARY : STAGE_TRACE);
    context_bind(context); /* another scene's frame may have had its turn since the last step */
    bool traced = tracer_trace(context->tracer, context->scene, wave, error);
    context_span_end(context);
    return traced && gpu_check(context->device, "tracing a wave", error);
}

static bool trace_and_compare(struct render_context *context, enum ray_kind kind, const struct wave *wave,
                              struct error *error)
{
    context_span_begin(context, STAGE_COMPARE);
    bool ready = comparison_prepare(context->comparison, wave, context->wave_number, error);
    context_span_end(context);
    uint64_t start_ns = clock_now_ns();
    if (!ready || !trace(context, kind, wave, error))
        return false;
    glFinish(); /* so that the time is that of the whole wave, as it is for the other tracer */
    uint64_t trace_ns = clock_now_ns() - start_ns;
    context_span_begin(context, STAGE_COMPARE);
    bool compared = comparison_wave(context->comparison, wave, kind, context->wave_number, trace_ns, error);
    context_span_end(context);
    return compared;
}

/* Rays of one kind and bounce cost about the same from slice to slice. */
static uint32_t *part_rays(struct render_context *context, enum ray_kind kind)
{
    const uint32_t wave = context->wave_number < PART_WAVES ? context->wave_number : PART_WAVES - 1;
    return &context->part_rays[kind][wave];
}

/* A GPU does not say when a part is done unless it is waited for, and there a wave is a few milliseconds. */
static uint32_t part_end(const struct render_context *context, const struct wave *wave, uint32_t rays_most)
{
    const uint32_t left = wave->ray_count - context->traced;
    if (!context->device->facts.software || rays_most >= left)
        return wave->ray_count;
    const uint32_t parts = (left - 1) / rays_most + 1, even = (left - 1) / parts + 1;
    const uint32_t rays = (even + WAVE_PART_RAYS - 1) / WAVE_PART_RAYS * WAVE_PART_RAYS;
    return rays < left ? context->traced + rays : wave->ray_count;
}

static void learn(uint32_t *part_rays, uint32_t rays, uint64_t took_ns)
{
    const uint64_t wanted = rays * PART_NS / (took_ns + 1), most = GROWTH_MAX * (uint64_t)*part_rays;
    const uint64_t next = wanted < most ? wanted : most;
    *part_rays = next < WAVE_PART_RAYS ? WAVE_PART_RAYS : next < PART_RAYS_MOST ? (uint32_t)next : PART_RAYS_MOST;
}

static bool trace_part(struct render_context *context, enum ray_kind kind, const struct wave *wave, bool *done,
                       struct error *error)
{
    struct wave part = *wave;
    part.first_ray = context->traced;
    part.chosen = &context->chosen;
    uint32_t *most = part_rays(context, kind);
    part.end_ray = part_end(context, wave, *most);
    const uint64_t start_ns = clock_now_ns();
    if (!trace(context, kind, &part, error))
        return false;
    learn(most, part.end_ray - part.first_ray, clock_now_ns() - start_ns);
    *done = part.end_ray == wave->ray_count;
    context->traced = *done ? 0 : part.end_ray;
    return true;
}

bool wave_trace(struct render_context *context, enum ray_kind kind, const struct wave *wave, bool *done,
                struct error *error)
{
    if (!context->comparison)
        return trace_part(context, kind, wave, done, error);
    *done = true;
    return trace_and_compare(context, kind, wave, error);
}

void wave_trace_forget(struct render_context *context)
{
    for (enum ray_kind kind = 0; kind < RAY_KIND_COUNT; kind++)
        for (uint32_t wave = 0; wave < PART_WAVES; wave++)
            context->part_rays[kind][wave] = PART_RAYS_FIRST;
}
