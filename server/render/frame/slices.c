/* SPDX-License-Identifier: MIT */
/* Cuts a picture's slots into slices; halves of a slice that overflowed come first. */
#include "render/frame/slices.h"

#include "shared/path.h"

/* Bound: a dead ray costs some hundredths of one that is traced, and a slice as much as some hundred of
 * these. */
#define DEAD_PER_LIVE 4u

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
        while (2u << shift <= SAMPLES_TOGETHER_MAX && 2u << shift <= samples - end && 8u << shift <= samples)
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

/* The first slot from that one on of a tile that gets samples. */
static uint32_t next_going_on(const struct picture *picture, uint32_t slot)
{
    const uint32_t *stopped = picture->noise.samples;
    while (slot < picture_slot_count(picture) &&
           ((stopped && stopped[slot / TILE_SLOTS]) || !picture_has_tile(picture, slot / TILE_SLOTS)))
        slot = (slot / TILE_SLOTS + 1) * TILE_SLOTS;
    return slot;
}

/* Number of a slice's slots up to the last unfinished tile before so many finished ones that another slice
 * costs less than their dead rays. The first tile is unfinished. */
static uint32_t worth_together(const struct picture *picture, const struct slice *slice)
{
    const uint32_t end = slice->first_slot + slice->slot_count;
    uint32_t worth = 0, tiles = 0, live = 0;
    for (uint32_t slot = slice->first_slot; slot < end && tiles <= DEAD_PER_LIVE * live;) {
        const uint32_t tile = slot / TILE_SLOTS, next = (tile + 1) * TILE_SLOTS;
        slot = next < end ? next : end;
        tiles++;
        if (picture->noise.samples[tile])
            continue;
        live++;
        worth = slot - slice->first_slot;
    }
    return worth;
}

bool slices_take(struct slices *slices, const struct picture *picture, uint32_t sample_shift, struct slice *slice)
{
    if (slices->waiting_count > 0) {
        *slice = slices->waiting[--slices->waiting_count];
        return true;
    }
    slices->next_slot = next_going_on(picture, slices->next_slot);
    if (slices->next_slot >= picture_slot_count(picture))
        return false;
    const uint32_t band_end = picture_band_end(picture, slices->next_slot);
    const uint32_t run_end = picture_run_end(picture, slices->next_slot);
    const uint32_t left = (band_end < run_end ? band_end : run_end) - slices->next_slot;
    uint32_t slots = slices->slice_rays >> sample_shift;
    slice->first_slot = slices->next_slot;
    slice->slot_count = left < slots ? left : slots;
    if (picture->noise.samples)
        slice->slot_count = worth_together(picture, slice);
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
