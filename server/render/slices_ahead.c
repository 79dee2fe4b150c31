/* SPDX-License-Identifier: MIT */
#include "render/slices_ahead.h"

#include "gpu/registry.h"

#include <epoxy/gl.h>

/* Rays of a slice: before one was measured, and at the least and most. Fewer do not fill a GPU. Nothing is known
 * of the first slice, and a driver ends what takes seconds: it is small, and the second one is as large as it
 * should be, or SLICE_GROWTH times as large, since its rays may cost more. */
#define SLICE_RAYS_FIRST (1u << 14)
#define SLICE_RAYS_MIN (1u << 12)
#define SLICE_RAYS_MAX (1u << 30)
#define SLICE_GROWTH 8u

static struct slice_ahead *next_of(struct slices_ahead *ahead)
{
    return &ahead->ring[(ahead->oldest + ahead->count) % SLICES_AHEAD_MAX];
}

static void stamp(struct gpu_device *device, unsigned *query)
{
    if (!*query)
        *query = gpu_object_create(device->registry, GPU_TIMESTAMP_QUERY);
    if (*query)
        glQueryCounter(*query, GL_TIMESTAMP);
}

uint32_t slices_ahead_rays(const struct slices_ahead *ahead, uint32_t maximum)
{
    const uint32_t rays = ahead->slice_rays ? ahead->slice_rays : SLICE_RAYS_FIRST;
    return rays < maximum ? rays : maximum;
}

void slices_ahead_begin(struct slices_ahead *ahead, struct gpu_device *device, const struct slices *slices,
                        uint32_t sample)
{
    struct slice_ahead *slice = next_of(ahead);
    slice->slices = *slices;
    slice->sample = sample;
    stamp(device, &slice->queries[0]);
}

bool slices_ahead_add(struct slices_ahead *ahead, struct gpu_device *device, const struct gpu_buffer *wave_state,
                      uint32_t rays, struct error *error)
{
    struct slice_ahead *slice = next_of(ahead);
    slice->rays = rays;
    ahead->count++;
    stamp(device, &slice->queries[1]);
    return gpu_readback_copy(device, &slice->state, wave_state, sizeof(struct wave_state), error) &&
           gpu_readback_fence(&slice->state, error);
}

bool slices_ahead_has_done(const struct slices_ahead *ahead)
{
    return ahead->count > 0 && gpu_readback_is_done(&ahead->ring[ahead->oldest].state);
}

bool slices_ahead_take(struct slices_ahead *ahead, struct gpu_device *device, const struct slice_ahead **slice,
                       struct wave_state *state, struct error *error)
{
    struct slice_ahead *oldest = &ahead->ring[ahead->oldest];
    *slice = oldest;
    ahead->oldest = (ahead->oldest + 1) % SLICES_AHEAD_MAX;
    ahead->count--;
    return gpu_readback_take(device, &oldest->state, state, error);
}

/* 0: it has none. The slice is done, and so are its time stamps. */
static uint64_t time_of(unsigned query)
{
    GLint available = 0;
    GLuint64 time_ns = 0;
    if (query)
        glGetQueryObjectiv(query, GL_QUERY_RESULT_AVAILABLE, &available);
    if (available)
        glGetQueryObjectui64v(query, GL_QUERY_RESULT, &time_ns);
    return time_ns;
}

uint32_t slices_ahead_next_rays(uint32_t rays, uint64_t took_ns, uint64_t step_ns)
{
    if (took_ns <= step_ns && took_ns >= step_ns / 4)
        return rays;
    const uint64_t fitting =
        took_ns > step_ns ? (uint64_t)rays * step_ns / took_ns : (uint64_t)rays * (step_ns / 2) / (took_ns + 1);
    uint64_t next = (uint64_t)rays * SLICE_GROWTH;
    while (next > fitting && next > SLICE_RAYS_MIN)
        next /= 2;
    return (uint32_t)(next < SLICE_RAYS_MIN ? SLICE_RAYS_MIN : next < SLICE_RAYS_MAX ? next : SLICE_RAYS_MAX);
}

void slices_ahead_learn(struct slices_ahead *ahead, const struct slice_ahead *slice, uint64_t step_ns)
{
    const uint64_t begin_ns = time_of(slice->queries[0]), end_ns = time_of(slice->queries[1]);
    const bool is_whole = slice->rays == slice->slices.slice_rays; /* no smaller rest of a band */
    if (begin_ns == 0 || end_ns <= begin_ns)
        return;
    const uint32_t next = slices_ahead_next_rays(slice->rays, end_ns - begin_ns, step_ns);
    if (is_whole || end_ns - begin_ns > step_ns)
        ahead->slice_rays = next;
}

void slices_ahead_forget(struct slices_ahead *ahead)
{
    ahead->slice_rays = 0;
}

void slices_ahead_drop(struct slices_ahead *ahead)
{
    for (uint32_t i = 0; i < SLICES_AHEAD_MAX; i++)
        gpu_readback_drop(&ahead->ring[i].state);
    ahead->count = 0;
}

void slices_ahead_finish(struct slices_ahead *ahead, struct gpu_device *device)
{
    for (uint32_t i = 0; i < SLICES_AHEAD_MAX; i++) {
        gpu_readback_finish(device, &ahead->ring[i].state);
        for (int end = 0; end < 2; end++)
            gpu_object_destroy(device->registry, GPU_TIMESTAMP_QUERY, ahead->ring[i].queries[end]);
    }
    *ahead = (struct slices_ahead){0};
}
