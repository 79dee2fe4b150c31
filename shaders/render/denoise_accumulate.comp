// SPDX-License-Identifier: MIT
// Adds a slice to the sums that the denoiser has beside the picture, unless it must be done again: the radiance of the
// samples of the first half, and what all of them saw. Each doubling of the samples is halved in turn, so that both halves
// are as evenly spread as all of them; the first four so that both have one of either half of what is chosen.
// Defines: HAS_TILE_SAMPLES tiles may have stopped, and get no more (server/render/picture_noise.h).
//          HAS_NOTED_MOTION notes say whether they are to count, and where things were.

#include "shared/denoise.h"
#include "common/dispatch.glsl"
#include "render/wave.glsl"

uniform uint slot_count;
uniform uint first_slot; // of the slice, in its band
uniform uint sample_index, sample_shift;

#ifdef HAS_TILE_SAMPLES
uniform uint first_picture_slot; // of the slice, in the picture
layout(binding = UNIT_TILE_SAMPLES) uniform usamplerBuffer tile_samples;
#endif

layout(std430, binding = BIND_SLICE_SUMS) readonly buffer sum_block { vec4 slice_sums[]; };
layout(std430, binding = BIND_DENOISE_NOTES) readonly buffer note_block { vec4 notes[]; };
layout(std430, binding = BIND_DENOISE_HALF) buffer half_block { vec4 first_half[]; };
layout(std430, binding = BIND_DENOISE_ALBEDO) buffer albedo_block { vec4 albedos[]; };
layout(std430, binding = BIND_DENOISE_NORMAL) buffer normal_block { vec4 normals[]; };
#ifdef HAS_NOTED_MOTION
layout(std430, binding = BIND_DENOISE_MOTION) buffer motion_block { vec4 motions[]; };
#endif

bool is_of_first_half(uint index)
{
    return index < 4u ? index % 3u == 0u : (index >> findMSB(index) - 1 & 1u) == 0u;
}

void main()
{
    uint k = item_index();
    if (k >= slot_count || wave.stopped != 0u)
        return;
#ifdef HAS_TILE_SAMPLES
    if (texelFetch(tile_samples, int((first_picture_slot + k) / TILE_SLOTS)).x != 0u)
        return;
#endif
    uint begin = k << sample_shift, count = 1u << sample_shift, slot = first_slot + k;
    vec4 sum = first_half[slot], albedo = albedos[slot], normal = normals[slot];
    for (uint i = 0u; i < count; i++) {
        uint first = DENOISE_NOTE_TEXELS * (begin + i);
        float counts = 1.0;
#ifdef HAS_NOTED_MOTION
        vec4 motion = notes[first + 2u];
        counts = motion.w > 0.0 ? 1.0 : DENOISE_WHISPER; // if it is all that there is
        motions[slot] += vec4(motion.xyz, 1.0) * counts;
#endif
        sum += is_of_first_half(sample_index + i) ? slice_sums[begin + i] : vec4(0.0);
        albedo += counts * notes[first];
        normal += counts * notes[first + 1u];
    }
    first_half[slot] = sum;
    albedos[slot] = albedo;
    normals[slot] = normal;
}
