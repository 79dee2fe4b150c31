// SPDX-License-Identifier: MIT
// How many samples the pixels of a band have, and which of them are of the first half.
// Defines: HAS_TILE_SAMPLES tiles may have stopped, and have fewer samples (server/render/picture_noise.h).

uniform uint sample_count;

#ifdef HAS_TILE_SAMPLES
uniform uint first_tile; // of the band
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

// Of so many samples: denoise_accumulate.comp says which.
float first_half_of(float samples)
{
    uint count = uint(samples), doubled = 1u << findMSB(count);
    return count < 4u ? 1.0 : float((doubled >> 1) + min(count - doubled, doubled >> 1));
}
