/* SPDX-License-Identifier: MIT */
/* Passes that make the voxels of an A-buffer. */
#include "trace/abuffer/voxels.h"

#include "gpu/program.h"
#include "abuffer/layout.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>

#define TEXEL_BYTES (4 * sizeof(uint32_t))

uint32_t abuffer_voxel_blocks(const struct abuffer_store *store)
{
    const uint32_t grid = store->voxels_along / ABUFFER_BLOCK_VOXELS;
    return grid * grid * grid;
}

bool abuffer_voxels_reserve(struct abuffer_store *store, struct error *error)
{
    const size_t texels = (size_t)abuffer_voxel_blocks(store) * ABUFFER_BLOCK_TEXELS;
    return gpu_buffer_reserve(store->device, &store->voxels, texels * TEXEL_BYTES, error);
}

/* Turns the sums of each voxel's samples into the data that traversal needs. */
static bool judge(struct abuffer_store *store, uint32_t first, uint32_t end, struct error *error)
{
    const struct gpu_program_source source = {.compute = "abuffer/voxels.comp"};
    const struct gpu_program *program = gpu_program_get(store->device, &source, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(store->device, &store->sums, UNIT_TRACER_0, GL_RGBA32I);
    gpu_buffer_bind_image(store->device, &store->voxels, IMAGE_ABUFFER_VOXELS, GL_RGBA32UI);
    gpu_buffer_bind_image(store->device, &store->subvoxels, IMAGE_ABUFFER_SUBVOXELS, GL_RG32UI);
    gpu_uniform_int(program, "has_subvoxels", abuffer_has_subvoxels(store));
    gpu_uniform_int(program, "without_steep", store->without_steep);
    gpu_uniform_int(program, "grid", (int32_t)(store->voxels_along / ABUFFER_BLOCK_VOXELS));
    gpu_uniform_uint(program, "first_item", first);
    gpu_uniform_uint(program, "end_item", end);
    gpu_dispatch(store->device, program, end - first);
    return true;
}

bool abuffer_voxels_pass(struct abuffer_store *store, unsigned pass, uint32_t first, uint32_t end,
                         struct error *error)
{
    const struct raster_blocks blocks = {.buffer = &store->voxels,
                                         .block_texels = ABUFFER_BLOCK_TEXELS,
                                         .grid = store->voxels_along / ABUFFER_BLOCK_VOXELS};
    return pass == 0 ? judge(store, first, end, error)
                     : raster_reach_pass(store->device, &blocks, pass - 1, first, end, error);
}
