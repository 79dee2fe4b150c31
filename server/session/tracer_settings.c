/* SPDX-License-Identifier: MIT */
#include "session/tracer_settings.h"

#define RESOLUTION_LEAST 16u
#define ABUFFER_RESOLUTION 1280u /* where none is given */

static bool is_block(uint32_t texels)
{
    return texels >= 2 && (texels & (texels - 1)) == 0; /* the message says at most 32 */
}

static bool check_abuffer(const struct message_render *render, struct error *error)
{
    const uint32_t voxels = render->abuffer_voxels;
    const uint32_t resolution = render->abuffer_resolution ? render->abuffer_resolution : ABUFFER_RESOLUTION;
    if (resolution < RESOLUTION_LEAST) {
        error_set(error, ERROR_INVALID, "render.abuffer_resolution", "%u texels are too few", resolution);
        return error_remedy(error, "%u to 4096 along a side, or 0 for %u", RESOLUTION_LEAST, ABUFFER_RESOLUTION);
    }
    if (voxels && (voxels < 16 || (voxels & (voxels - 1)))) { /* the message says at most 256 */
        error_set(error, ERROR_INVALID, "render.abuffer_voxels", "a grid has no side of %u voxels", voxels);
        return error_remedy(error, "16, 32, 64, 128 or 256, or 0 for what suits the resolution");
    }
    if (voxels > resolution) {
        error_set(error, ERROR_INVALID, "render.abuffer_voxels", "%u are more than the %u texels", voxels,
                  resolution);
        return error_remedy(error, "fewer voxels, 0 for what suits the resolution, or a higher resolution");
    }
    return true;
}

bool tracer_settings_check(const struct message_render *render, struct error *error)
{
    if (render->bvh_rays_together > 4 && render->bvh_rays_together != 8)
        return error_set(error, ERROR_INVALID, "render.bvh_rays_together",
                         "1, 2, 3, 4 or 8 rays walk as one, not %u", render->bvh_rays_together);
    if (render->ldc_resolution && render->ldc_resolution < RESOLUTION_LEAST) {
        error_set(error, ERROR_INVALID, "render.ldc_resolution", "%u cells are too few", render->ldc_resolution);
        return error_remedy(error, "%u to 4096 along the longest side, or 0 for 1024", RESOLUTION_LEAST);
    }
    if (render->ldc_block && !is_block(render->ldc_block)) {
        error_set(error, ERROR_INVALID, "render.ldc_block", "a block has no side of %u texels", render->ldc_block);
        return error_remedy(error, "2, 4, 8, 16 or 32, or 0 for 8");
    }
    if (render->ldc_levels == PROTOCOL_LDC_LEVELS_CELLS && render->ldc_tolerance > 0) {
        error_set(error, ERROR_INVALID, "render.ldc_levels", "cells know nothing of a tolerance");
        return error_remedy(error, "a tolerance of 0, or another kind of levels");
    }
    if (render->ldc_rays_together > 1 && render->ldc_rays_together != 4)
        return error_set(error, ERROR_INVALID, "render.ldc_rays_together", "1 or 4 rays walk as one, not %u",
                         render->ldc_rays_together);
    return check_abuffer(render, error);
}

/* 0 stays: there is no limit. One below 1 MiB is a limit still. */
static uint32_t mebibytes_of(uint64_t bytes)
{
    const uint64_t mebibytes = bytes >> 20;
    return bytes == 0 ? 0 : mebibytes == 0 ? 1 : (uint32_t)mebibytes;
}

struct tracer_options tracer_settings(const struct session_limits *limits, const struct message_render *render)
{
    return (struct tracer_options){
        .bvh_bounds = (unsigned)render->bvh_bounds,
        .bvh_rays_together = render->bvh_rays_together,
        .ldc_resolution = render->ldc_resolution,
        .ldc_block = render->ldc_block,
        .ldc_build = (unsigned)render->ldc_build,
        .ldc_levels = (unsigned)render->ldc_levels,
        .ldc_images = (unsigned)render->ldc_images,
        .ldc_tolerance = render->ldc_tolerance,
        .ldc_rays_together = render->ldc_rays_together,
        .abuffer_resolution = render->abuffer_resolution,
        .abuffer_voxels = render->abuffer_voxels,
        .abuffer_search = (unsigned)render->abuffer_search,
        .ldc_layers_max = limits->ldc_layers,
        .ldc_mebibytes_max = mebibytes_of(limits->ldc_bytes),
        .abuffer_mebibytes_max = mebibytes_of(limits->abuffer_bytes),
    };
}
