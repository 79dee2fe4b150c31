// SPDX-License-Identifier: MIT
// Number of samples in the pixels of a band.
// Defines: HAS_TILE_SAMPLES tiles may have stopped, and have fewer samples (server/render/picture/noise.h).
//          HAS_NOTED_MOTION some samples may have no guide.

uniform uint sample_count;

#ifdef HAS_TILE_SAMPLES
uniform uint first_tile; // first tile of the band
layout(binding = UNIT_TILE_SAMPLES) uniform usamplerBuffer tile_samples;
#endif

float samples_of_slot(uint slot)
{
#ifdef HAS_TILE_SAMPLES
    uint stopped_at = texelFetch(tile_samples, int(first_tile + slot / TILE_SLOTS)).x;
    return float(stopped_at != 0u ? stopped_at : sample_count);
#else
    return float(sample_count);
#endif
}

#ifdef HAS_NOTED_MOTION
layout(std430, binding = BIND_DENOISE_MOTION) readonly buffer motion_block { vec4 motions[]; };
#endif

// Number of samples that have a guide.
float notes_of_slot(uint slot, float count)
{
#ifdef HAS_NOTED_MOTION
    return motions[slot].w;
#else
    return count;
#endif
}
