/* SPDX-License-Identifier: MIT */
#include "render/slices_ahead.h"

bool slices_ahead_add(struct slices_ahead *ahead, struct gpu_device *device, const struct gpu_buffer *wave_state,
                      const struct slices *slices, uint32_t sample, struct error *error)
{
    struct slice_ahead *slice = &ahead->ring[(ahead->oldest + ahead->count) % SLICES_AHEAD_MAX];
    slice->slices = *slices;
    slice->sample = sample;
    ahead->count++;
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

void slices_ahead_drop(struct slices_ahead *ahead)
{
    for (uint32_t i = 0; i < SLICES_AHEAD_MAX; i++)
        gpu_readback_drop(&ahead->ring[i].state);
    ahead->count = 0;
}

void slices_ahead_finish(struct slices_ahead *ahead, struct gpu_device *device)
{
    for (uint32_t i = 0; i < SLICES_AHEAD_MAX; i++)
        gpu_readback_finish(device, &ahead->ring[i].state);
    *ahead = (struct slices_ahead){0};
}
