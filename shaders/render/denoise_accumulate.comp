// SPDX-License-Identifier: MIT
// Adds a slice to the sums that the denoiser has beside the picture, unless it must be done again: the light of the
// samples of the first half, and the guides of all samples. The picture does not have the slice yet.
// Defines: HAS_TILE_SAMPLES tiles may have stopped, and get no more (server/render/picture/noise.h).
//          HAS_NOTED_MOTION notes say whether they count, and where surfaces were.

#include "shared/denoise.h"
#include "common/dispatch.glsl"
#include "render/denoise_half.glsl"
#include "render/wave.glsl"

uniform uint slot_count;
uniform uint first_slot; // first slot of the slice, in its band
uniform uint sample_index, sample_shift;

#ifdef HAS_TILE_SAMPLES
uniform uint first_picture_slot; // first slot of the slice, in the picture
layout(binding = UNIT_TILE_SAMPLES) uniform usamplerBuffer tile_samples;
#endif

layout(std430, binding = BIND_SLICE_SUMS) readonly buffer sum_block { vec4 slice_sums[]; };
layout(std430, binding = BIND_DENOISE_NOTES) readonly buffer note_block { vec4 notes[]; };
layout(std430, binding = BIND_DENOISE_SUM) readonly buffer accumulation_block { vec4 accumulation[]; };
layout(std430, binding = BIND_DENOISE_DOUBLED) buffer doubled_block { vec4 doubled_lights[]; };
layout(std430, binding = BIND_DENOISE_HALF) buffer half_block { uvec4 first_half[]; };
layout(std430, binding = BIND_DENOISE_ALBEDO) buffer albedo_block { vec4 albedos[]; };
layout(std430, binding = BIND_DENOISE_NORMAL) buffer normal_block { vec4 normals[]; };
#ifdef HAS_NOTED_MOTION
layout(std430, binding = BIND_DENOISE_MOTION) buffer motion_block { vec4 motions[]; };
#endif

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
    vec4 sum = accumulation[slot], doubled = doubled_lights[slot], albedo = albedos[slot], normal = normals[slot];
    uvec4 half_ = first_half[slot];
    float noted = float(sample_index);
#ifdef HAS_NOTED_MOTION
    vec4 motion = motions[slot];
    noted = motion.w;
#endif
    for (uint i = 0u; i < count; i++) {
        uint first = DENOISE_NOTE_TEXELS * (begin + i);
        float counts = 1.0;
#ifdef HAS_NOTED_MOTION
        vec4 moved = notes[first + 2u];
        counts = moved.w > 0.0 ? 1.0 : DENOISE_WHISPER; // counts where it is the only one
        motion += vec4(moved.xyz, 1.0) * counts;
#endif
        albedo += counts * notes[first];
        normal += counts * notes[first + 1u];
        noted += counts;
        sum += slice_sums[begin + i];
        uint counted = sample_index + i + 1u;
        if (counted == 2u || counted > 2u && first_half_of(counted) != first_half_of(counted - 1u))
            half_ = words_of_half(doubled.rgb, doubled.rgb - light_of_half(half_));
        if ((counted & counted - 1u) == 0u)
            doubled.rgb = sum.rgb / (float(counted) * divisor_of(albedo.rgb / noted));
    }
    first_half[slot] = half_;
    doubled_lights[slot] = doubled;
    albedos[slot] = albedo;
    normals[slot] = normal;
#ifdef HAS_NOTED_MOTION
    motions[slot] = motion;
#endif
}
