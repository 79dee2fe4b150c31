/* SPDX-License-Identifier: MIT */
#include "render/slices.h"

uint32_t slices_sample_shift(const struct slices *slices, uint32_t samples)
{
    uint32_t maximum = samples < slices->slice_rays ? samples : slices->slice_rays, shift = 0;
    while (2u << shift <= SAMPLES_TOGETHER_MAX && 2u << shift <= maximum)
        shift++;
    return shift;
}

uint32_t slices_group_shift(uint32_t samples, uint32_t done)
{
    uint32_t shift = 0, group = 0;
    for (uint32_t end = 0; end <= done; end += group) {
        shift = 0;
        while (2u << shift <= SAMPLES_TOGETHER_MAX && 2u << shift <= samples - end)
            shift++;
        group = 1u << shift;
    }
    return shift;
}

void slices_restart(struct slices *slices)
{
    slices->next_slot = 0;
    slices->waiting_count = 0;
}

bool slices_take(struct slices *slices, const struct picture *picture, uint32_t sample_shift, struct slice *slice)
{
    if (slices->waiting_count > 0) {
        *slice = slices->waiting[--slices->waiting_count];
        return true;
    }
    if (slices->next_slot >= picture_slot_count(picture))
        return false;
    uint32_t band_left = picture_band_end(picture, slices->next_slot) - slices->next_slot;
    uint32_t slots = slices->slice_rays >> sample_shift;
    slice->first_slot = slices->next_slot;
    slice->slot_count = band_left < slots ? band_left : slots;
    slices->next_slot += slice->slot_count;
    return true;
}

bool slices_split(struct slices *slices, const struct slice *slice)
{
    if (slice->slot_count == 1)
        return false;
    uint32_t half = slice->slot_count / 2;
    slices_put_back(slices, &(struct slice){slice->first_slot + half, slice->slot_count - half});
    slices_put_back(slices, &(struct slice){slice->first_slot, half});
    return true;
}

void slices_put_back(struct slices *slices, const struct slice *slice)
{
    slices->waiting[slices->waiting_count++] = *slice;
}
