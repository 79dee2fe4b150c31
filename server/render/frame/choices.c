/* SPDX-License-Identifier: MIT */
/* Sizes of slices, and whether first hits are rasterised. */
#include "render/frame/choices.h"

#include "render/context/camera.h"
#include "shared/hit.h"
#include "shared/path.h"
#include "shared/ray.h"

/* Rays of a slice, unless the buffers of its waves would take more than 1 / SLICE_MEMORY_PART of the device's
 * memory; SLICE_RAYS_UNTOLD if the memory is not known. Long waves are traced in parts (waves/trace.h), except
 * where tracers are compared. */
#define SLICE_RAYS_UNTOLD (1u << 18)
#define SLICE_RAYS_MIN (1u << 12)
/* Minimum where there are many lights: a work group of the passes over hits. */
#define SLICE_RAYS_LIT_MIN (1u << 6)
#define SLICE_MEMORY_PART 64

/* Ignores the limit in force, which changes with the frames of others. */
uint32_t choices_slice_rays(const struct gpu_device *device, bool compared, uint32_t lights)
{
    const struct gpu_facts *facts = &device->facts;
    const uint64_t ray_bytes = CHOICES_WAVE_PER_SLICE *
                               (sizeof(struct ray) + sizeof(struct path) + sizeof(struct hit) + 2 * sizeof(uint));
    /* hits are a buffer texture */
    const uint64_t ray_texels = CHOICES_WAVE_PER_SLICE * sizeof(struct hit) / sizeof(vec4);
    const uint64_t bytes_max = facts->memory.bytes / SLICE_MEMORY_PART;
    uint64_t rays = facts->slice_rays_max;
    if (bytes_max == 0 && rays > SLICE_RAYS_UNTOLD)
        rays = SLICE_RAYS_UNTOLD;
    while (rays > SLICE_RAYS_MIN &&
           ((bytes_max && rays * ray_bytes > bytes_max) || rays * ray_texels > facts->texture_buffer_texels_max))
        rays /= 2;
    while (rays > SLICE_RAYS_LIT_MIN && rays * lights > facts->list_tests_max)
        rays /= 2;
    return (uint32_t)(compared ? rays / 2 : rays);
}

static uint64_t primitives_shown(const struct gpu_scene *scene)
{
    uint64_t count = scene->disc_count;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        count += scene->geometries[scene->instances[i].geometry].device.primitive_count;
    return count;
}

/* Where it is left to us. A tracer that samples would show its cells. */
static bool traces_first_hits(const struct render_frame *frame)
{
    const struct tracer_impl *impl = frame->tracer->impl;
    const uint64_t pixels = (uint64_t)frame->request.picture.width * frame->request.picture.height;
    return impl->traces_on_host ||
           (impl->finds_first_hits && gpu_measured_traces(&frame->device->gpu->measured, frame->spread,
                                                          primitives_shown(frame->scene), pixels));
}

bool choices_rasterise(const struct render_frame *frame)
{
    const struct frame_request *request = &frame->request;
    const bool flat = !(request->aperture > 0.0f) && !frame->scene->has_motion && !frame_has_views(request);
    return flat && !request->comparison.compare &&
           (request->tracing.primary == PRIMARY_RASTER ||
            (request->tracing.primary == PRIMARY_AUTO && !traces_first_hits(frame)));
}
