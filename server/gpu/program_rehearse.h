/* SPDX-License-Identifier: MIT */
/* Rehearsal of compute programs: llvmpipe compiles one at its first dispatch, for the formats of the bound
 * textures. A dispatch without groups is enough: the code goes into Mesa's cache on the disk, where the driver
 * finds it when the device's context dispatches the program. */
#ifndef FARLIGHT_GPU_PROGRAM_REHEARSE_H
#define FARLIGHT_GPU_PROGRAM_REHEARSE_H

#include "gpu/device.h"

/* Rehearses a linked compute program in the current context, which stays unchanged. If a pass binds other
 * formats the driver compiles the program again. */
void gpu_program_rehearse(const struct gpu_texel_formats *formats, unsigned program);

#endif
