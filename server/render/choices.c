/* SPDX-License-Identifier: MIT */
#include "render/choices.h"

#include "shared/hit.h"
#include "shared/path.h"
#include "shared/ray.h"

/* Rays of a slice. Software GL has no latency to hide, and its caches are the CPU's; a GPU wants enough rays to
 * fill itself. What takes long is traced in parts (wave_trace.h), but where tracers are compared. */
#define SLICE_RAYS_SOFTWARE (1u << 15)
#define SLICE_RAYS_COMPARED (1u << 14)
/* On a GPU a slice is as large as it can do in a step (slices_ahead.h), if the buffers of its waves take no more
 * than this part of the device's memory; the second, where that is not known. */
#define SLICE_RAYS_HARDWARE (1u << 20)
#define SLICE_RAYS_UNTOLD (1u << 18)
#define SLICE_RAYS_MIN (1u << 12)
#define SLICE_MEMORY_PART 64

/* Not by the limit in force, which changes with the frames of others. */
static uint32_t hardware_slice_rays(const struct gpu_facts *facts)
{
    const uint64_t ray_bytes = CHOICES_WAVE_PER_SLICE *
                               (sizeof(struct ray) + sizeof(struct path) + sizeof(struct hit) + 2 * sizeof(uint));
    /* hits are a buffer texture */
    const uint64_t ray_texels = CHOICES_WAVE_PER_SLICE * sizeof(struct hit) / sizeof(vec4);
    const uint64_t bytes_max = facts->memory.bytes / SLICE_MEMORY_PART;
    uint64_t rays = bytes_max ? SLICE_RAYS_HARDWARE : SLICE_RAYS_UNTOLD;
    while (rays > SLICE_RAYS_MIN &&
           ((bytes_max && rays * ray_bytes > bytes_max) || rays * ray_texels > facts->texture_buffer_texels_max))
        rays /= 2;
    return (uint32_t)rays;
}

uint32_t choices_slice_rays(const struct gpu_device *device, bool compared)
{
    if (!device->facts.software)
        return hardware_slice_rays(&device->facts);
    return compared ? SLICE_RAYS_COMPARED : SLICE_RAYS_SOFTWARE;
}
