/* SPDX-License-Identifier: MIT */
/* Compaction on the host, where compiling the shaders would take longer than running them. */
#include "host_passes/host_passes.h"

#include "shared/path.h"

static uint32_t list_hits(const struct hit *hits, uint32_t ray_count, uint32_t *hit_list, uint32_t *hit_places)
{
    uint32_t count = 0;
    for (uint32_t k = 0; k < ray_count; k++) {
        const bool is_hit = hits[k].distance >= 0.0f;
        hit_places[k] = is_hit ? count : HIT_PLACE_NONE;
        hit_list[count] = k;
        count += is_hit;
    }
    return count;
}

static void count_children(const uint32_t *child_counts, uint32_t hit_count, uint32_t *children,
                           uint32_t *shadow_rays)
{
    *children = *shadow_rays = 0;
    for (uint32_t j = 0; j < hit_count; j++) {
        *children += child_counts[j] & CHILDREN_MASK;
        *shadow_rays += child_counts[j] >> SHADOW_RAYS_SHIFT;
    }
}

static void place_children(const uint32_t *child_counts, uint32_t hit_count, bool sorted,
                           uint32_t (*block_offsets)[2])
{
    const uint32_t blocks = (hit_count + COMPACT_BLOCK - 1) / COMPACT_BLOCK;
    uint32_t place = 0;
    for (uint32_t octant = 0; octant < (sorted ? OCTANTS : 1); octant++)
        for (uint32_t block = 0; block < blocks; block++) {
            const uint32_t first = block * COMPACT_BLOCK;
            block_offsets[octant * blocks + block][0] = place;
            for (uint32_t j = first; j < first + COMPACT_BLOCK && j < hit_count; j++)
                if (!sorted || (child_counts[j] >> CHILD_OCTANT_SHIFT & (OCTANTS - 1)) == octant)
                    place += child_counts[j] & CHILDREN_MASK;
        }
}

const struct host_passes *host_passes_of(const struct gpu_device *device)
{
    static const struct host_passes passes = {list_hits, count_children, place_children};
    return device->facts.shares_memory ? &passes : NULL;
}
