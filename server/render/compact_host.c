/* SPDX-License-Identifier: MIT */
#include "render/compact_host.h"

#include "shared/hit.h"
#include "shared/path.h"

bool compact_host_is_used(const struct render_context *context)
{
    return context->device->facts.software && context->counts_on_host;
}

bool compact_host_hits(struct render_context *context, struct error *error)
{
    struct gpu_device *device = context->device;
    const struct hit *hits = gpu_buffer_open(device, &context->hits, error);
    uint32_t *list = hits ? gpu_buffer_open(device, &context->hit_list, error) : NULL;
    uint32_t *places = list ? gpu_buffer_open(device, &context->hit_places, error) : NULL;
    uint32_t count = 0;
    for (uint32_t k = 0; places && k < context->ray_count; k++) {
        const bool is_hit = hits[k].distance >= 0.0f;
        places[k] = is_hit ? count : HIT_PLACE_NONE;
        list[count] = k;
        count += is_hit;
    }
    if (hits)
        gpu_buffer_unmap(device, &context->hits);
    if (list)
        gpu_buffer_unmap(device, &context->hit_list);
    if (places)
        gpu_buffer_unmap(device, &context->hit_places);
    context->hit_count = count;
    return places != NULL;
}

bool compact_host_count(struct render_context *context, struct gpu_buffer *child_counts, uint32_t *children,
                        uint32_t *shadow_rays, struct error *error)
{
    const uint32_t *counts = gpu_buffer_open(context->device, child_counts, error);
    *children = *shadow_rays = 0;
    if (!counts)
        return false;
    for (uint32_t j = 0; j < context->hit_count; j++) {
        *children += counts[j] & CHILDREN_MASK;
        *shadow_rays += counts[j] >> SHADOW_RAYS_SHIFT;
    }
    gpu_buffer_unmap(context->device, child_counts);
    return true;
}

bool compact_host_places(struct render_context *context, struct gpu_buffer *child_counts, bool sorted,
                         struct error *error)
{
    struct gpu_device *device = context->device;
    const uint32_t hit_count = context->hit_count, blocks = (hit_count + COMPACT_BLOCK - 1) / COMPACT_BLOCK;
    const uint32_t *counts = gpu_buffer_open(device, child_counts, error);
    uint32_t(*offsets)[2] = counts ? gpu_buffer_open(device, &context->block_offsets, error) : NULL;
    uint32_t place = 0;
    for (uint32_t octant = 0; offsets && octant < (sorted ? OCTANTS : 1); octant++)
        for (uint32_t block = 0; block < blocks; block++) {
            const uint32_t first = block * COMPACT_BLOCK;
            offsets[octant * blocks + block][0] = place;
            for (uint32_t j = first; j < first + COMPACT_BLOCK && j < hit_count; j++)
                if (!sorted || (counts[j] >> CHILD_OCTANT_SHIFT & (OCTANTS - 1)) == octant)
                    place += counts[j] & CHILDREN_MASK;
        }
    if (offsets)
        gpu_buffer_unmap(device, &context->block_offsets);
    if (counts)
        gpu_buffer_unmap(device, child_counts);
    return offsets != NULL;
}
