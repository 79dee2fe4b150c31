/* SPDX-License-Identifier: MIT */
/* llvmpipe compiles a compute program when it is dispatched first, for the formats of the textures that are bound.
 * A dispatch without groups is enough: the code goes into Mesa's cache on the disk, where the driver finds it when
 * the device's context dispatches the program. */
#ifndef FARLIGHT_GPU_PROGRAM_REHEARSE_H
#define FARLIGHT_GPU_PROGRAM_REHEARSE_H

#include "gpu/device.h"

/* Of a linked compute program, in the current context, which is left as it was. Where a pass binds other formats
 * the driver compiles the program again. */
void gpu_program_rehearse(const struct gpu_texel_formats *formats, unsigned program);

#endif
