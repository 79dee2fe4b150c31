// SPDX-License-Identifier: MIT
// Uniforms of every pass of a frame (shared/frame.h).

#include "shared/frame.h"

layout(std140, binding = UNIFORM_FRAME) uniform frame_block { frame_uniforms frame_in_block; };
#ifdef UNIFORMS_AT_START // server/gpu/uniforms.h
#define COPY(member) f.member = at_start(frame_in_block.member)
frame_uniforms frame_at_start()
{
    frame_uniforms f;
    COPY(world_from_view[0]), COPY(world_from_view[1]), COPY(world_from_view[2]);
    COPY(extent_near), COPY(far_width), COPY(eye_steps), COPY(eyes_middle), COPY(lens), COPY(environment_colour);
    COPY(irradiance[0]), COPY(irradiance[1]), COPY(irradiance[2]), COPY(irradiance[3]), COPY(irradiance[4]);
    COPY(irradiance[5]), COPY(irradiance[6]), COPY(irradiance[7]), COPY(irradiance[8]);
    COPY(width), COPY(height), COPY(tiles_across), COPY(sample_index), COPY(sample_shift), COPY(environment_kind);
    COPY(light_count), COPY(depth), COPY(seed), COPY(group_shift), COPY(view_width), COPY(view_height);
    return f;
}
frame_uniforms frame = frame_at_start(); // except for members found by an index
#else
#define frame frame_in_block
#endif
