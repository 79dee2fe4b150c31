/* SPDX-License-Identifier: MIT */
/* Passes that measure the empty space round empty blocks. */
#include "trace/raster/reach.h"

#include "gpu/program.h"
#include "raster/layout.h"

#include <epoxy/gl.h>

bool raster_reach_pass(struct gpu_device *device, const struct raster_blocks *blocks, unsigned pass,
                       uint32_t first, uint32_t end, struct error *error)
{
    static const char *const passes[RASTER_REACH_PASSES] = {"REACH_X", "REACH_Y", "REACH_Z"};
    const struct gpu_define defines[] = {{passes[pass], "1"}, {NULL, NULL}};
    const struct gpu_program_source source = {.compute = "raster/reach.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(device, &source, error);
    if (!program)
        return false;
    gpu_buffer_bind_image(device, blocks->buffer, IMAGE_BLOCKS, GL_RGBA32UI);
    gpu_uniform_int(program, "first_texel", (int32_t)blocks->first_texel);
    gpu_uniform_int(program, "block_texels", (int32_t)blocks->block_texels);
    gpu_uniform_int(program, "grid", (int32_t)blocks->grid);
    gpu_uniform_uint(program, "first_item", first);
    gpu_uniform_uint(program, "end_item", end);
    gpu_dispatch(device, program, end - first);
    return true;
}
