// SPDX-License-Identifier: MIT
// Converts sums of samples to Y'CbCr 4:2:0 in the rows that server/base/ycbcr.h describes, from the same RGBA8 as
// resolve.comp's, so that pictures look alike in every conversion. An item is 8 columns of two rows: two words of luma in
// each, and one of Cb and of Cr.

#include "shared/path.h"
#include "common/dispatch.glsl"
#include "render/display.glsl"

#define YCBCR_VIDEO 1u // enum ycbcr

uniform uint row_count; // rows of the band in the picture; an odd last one stands for two
uniform uint ycbcr;

layout(std430, binding = BIND_RESOLVED) writeonly buffer resolved_block { uint resolved[]; };

// Red, green and blue of a pixel as codes of 8 bits, 0 .. 255. The picture's edge is repeated beyond it.
vec3 codes_of_pixel(uint x, uint y)
{
    uvec2 pixel = min(uvec2(x, y), uvec2(frame.width, row_count) - 1u);
    return round(display_of_sum(mean_of_sum(sum_of_pixel(pixel), pixel)).rgb * 255.0);
}

// Packs four codes, the first in the lowest byte.
uint word_of(vec4 codes)
{
    uvec4 bytes = uvec4(min(codes + 0.5, vec4(255.0)));
    return bytes.x | bytes.y << 8 | bytes.z << 16 | bytes.w << 24;
}

void main()
{
    uint item = item_index(), across = frame.tiles_across;
    uvec2 first = uvec2(item % across * 8u, item / across * 2u);
    if (first.y >= row_count)
        return;
    bool video = ycbcr == YCBCR_VIDEO;
    vec3 weights = video ? vec3(0.2126, 0.7152, 0.0722) : vec3(0.299, 0.587, 0.114);
    float black = video ? 16.0 : 0.0;
    float luma_scale = video ? 219.0 / 255.0 : 1.0;
    // Blue less luma lies within 1 - weights.b of 0, red less luma within 1 - weights.r.
    vec2 chroma_scale = (video ? 224.0 / 255.0 : 1.0) * 0.5 / (1.0 - weights.br);

    vec4 luma[4], cb, cr; // luma: left and right of the upper row, then of the lower one
    vec3 before = vec3(0.0);
    if (video) {
        uint x = max(first.x, 1u) - 1u;
        before = codes_of_pixel(x, first.y) + codes_of_pixel(x, first.y + 1u);
    }
    for (uint i = 0u; i < 4u; i++) {
        uint x = first.x + 2u * i, left = 2u * i & 3u, half_row = i >> 1;
        vec3 upper[2], lower[2];
        for (uint k = 0u; k < 2u; k++) {
            upper[k] = codes_of_pixel(x + k, first.y);
            lower[k] = codes_of_pixel(x + k, first.y + 1u);
            luma[half_row][left + k] = black + luma_scale * dot(weights, upper[k]);
            luma[2u + half_row][left + k] = black + luma_scale * dot(weights, lower[k]);
        }
        vec3 here = upper[0] + lower[0], behind = upper[1] + lower[1];
        vec3 mean = video ? (before + 2.0 * here + behind) / 8.0 : (here + behind) / 4.0;
        before = behind;
        vec2 chroma = 128.0 + chroma_scale * (mean.br - dot(weights, mean));
        cb[i] = chroma.x;
        cr[i] = chroma.y;
    }
    uint upper_row = first.y * across * 3u, lower_row = upper_row + across * 3u; // words: two of luma, one of chroma
    uint column = first.x / 4u, behind_luma = across * 2u + first.x / 8u;
    resolved[upper_row + column] = word_of(luma[0]);
    resolved[upper_row + column + 1u] = word_of(luma[1]);
    resolved[lower_row + column] = word_of(luma[2]);
    resolved[lower_row + column + 1u] = word_of(luma[3]);
    resolved[upper_row + behind_luma] = word_of(cb);
    resolved[lower_row + behind_luma] = word_of(cr);
}
