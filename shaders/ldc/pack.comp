// SPDX-License-Identifier: MIT
// Packs the fragments of texels into samples: sorted by depth and id, without duplicates, the nearest if there are more
// than the limit. Writes texels and quads, and the input of sample.comp. Define: PEELED the fragments are sorted,
// distinct, and samples already

#include "ldc/layout.h"
#include "common/dispatch.glsl"
#include "ldc/run.glsl"

uniform uint first_texel, first_sample, first_quad; // those of the cube
uniform uint layers_max;                            // at most 255

#ifdef PEELED
layout(binding = UNIT_LDC_FOUND) uniform usamplerBuffer found;
layout(binding = UNIT_LDC_PEELED_SURFACE) uniform usamplerBuffer peeled;
layout(binding = IMAGE_LDC_GEOMETRY, rg32ui) writeonly uniform uimageBuffer geometry_out;
layout(binding = IMAGE_LDC_PRIMITIVES, rg32ui) writeonly uniform uimageBuffer primitives_out;
#endif
layout(binding = IMAGE_LDC_SURFACE, rgba32ui) writeonly uniform uimageBuffer surface_out;
layout(binding = IMAGE_LDC_TEXELS, rgba32ui) writeonly uniform uimageBuffer texels_out;
layout(binding = IMAGE_LDC_QUADS, rgba32f) writeonly uniform imageBuffer quads_out;
layout(std430, binding = BIND_LDC_BUILD_COUNTS) buffer build_block { ldc_build_counts build; };

#ifndef PEELED
void in_order(inout uvec2 a, inout uvec2 b)
{
    bool turned = before(b, a);
    uvec2 minimum = turned ? b : a;
    b = turned ? a : b;
    a = minimum;
}

// Sorts the first four in registers, the rest by insertion: most texels have few fragments, and many are often nearly in
// order. True: some may coincide.
bool sort(run r)
{
    const uvec2 NONE = uvec2(0xffffffffu);
    bool coincide = false;
    if (r.count > 1u && r.count <= LDC_PACK_SORTS) {
        uvec2 a = load(r, 0u), b = load(r, 1u);
        uvec2 c = r.count > 2u ? load(r, 2u) : NONE, d = r.count > 3u ? load(r, 3u) : NONE;
        in_order(a, b);
        in_order(c, d);
        in_order(a, c);
        in_order(b, d);
        in_order(b, c);
        store(r, 0u, a);
        store(r, 1u, b);
        if (r.count > 2u)
            store(r, 2u, c);
        if (r.count > 3u)
            store(r, 3u, d);
        coincide = a.x == b.x || r.count > 2u && b.x == c.x || r.count > 3u && c.x == d.x;
    }
    if (r.count > LDC_PACK_SORTS) // sort.comp has sorted it
        return true;
    for (uint i = 4u; i < r.count; i++) {
        uvec2 moved = load(r, i);
        uint k = i;
        for (; k > 0u; k--) {
            uvec2 above = load(r, k - 1u);
            coincide = coincide || above.x == moved.x;
            if (!before(moved, above))
                break;
            store(r, k, above);
        }
        if (k != i)
            store(r, k, moved);
    }
    return coincide;
}

// Counts the distinct fragments in a sorted run.
uint count_kept(run r, bool coincide)
{
    uint kept = coincide ? 0u : r.count < layers_max ? r.count : layers_max, last = LDC_NO_DEPTH_BITS;
    for (uint i = 0u; coincide && i < r.count && kept < layers_max; i++) {
        uint depth = load(r, i).x;
        kept += depth != last ? 1u : 0u;
        last = depth;
    }
    return kept;
}
#endif

// Writes a texel with `kept` samples.
void emit(run r, uint kept, uint sample_, uint quad)
{
    uint last = LDC_NO_DEPTH_BITS, taken = 0u, quad_at = quad;
    vec2 range = vec2(LDC_NO_DEPTH, -LDC_NO_DEPTH);
    vec4 depths = vec4(LDC_NO_DEPTH);
    for (uint i = 0u; taken < kept; i++) {
        uvec2 fragment = load(r, i);
        if (fragment.x == last)
            continue;
        last = fragment.x;
        float depth = uintBitsToFloat(fragment.x);
        range = vec2(taken == 0u ? depth : range.x, depth);
        uint part = taken & 3u;
        depths = vec4(part == 0u ? depth : depths.x, part == 1u ? depth : part == 0u ? LDC_NO_DEPTH : depths.y,
                      part == 2u ? depth : part == 0u ? LDC_NO_DEPTH : depths.z, part == 3u ? depth : LDC_NO_DEPTH);
#ifdef PEELED
        imageStore(geometry_out, int(sample_ + taken), uvec4(fragment, 0u, 0u));
        int place = 2 * index_of(r, i);
        imageStore(surface_out, int(sample_ + taken), texelFetch(peeled, place));
        imageStore(primitives_out, int(sample_ + taken), texelFetch(peeled, place + 1));
#else
        imageStore(surface_out, int(sample_ + taken), uvec4(r.bits, fragment, 0u));
#endif
        taken++;
        if (part == 3u || taken == kept)
            imageStore(quads_out, int(quad_at++), depths);
    }
    imageStore(texels_out, int(first_texel + r.texel),
               uvec4(sample_, quad << LDC_TEXEL_QUAD_SHIFT | kept, floatBitsToUint(range)));
}

void main()
{
    uint begin = item_index() * LDC_PACK_TEXELS;
    if (begin >= occupied_count)
        return;
    uint end = begin + LDC_PACK_TEXELS < occupied_count ? begin + LDC_PACK_TEXELS : occupied_count;
    uvec2 bytes = uvec2(0u); // indices of the eight that are kept
    uint samples = 0u, quads = 0u;
    for (uint k = begin; k < end; k++) {
        run r = run_of(k);
#ifdef PEELED
        uint kept = texelFetch(found, int(r.texel)).x;
#else
        uint kept = count_kept(r, sort(r));
#endif
        samples += kept;
        quads += (kept + 3u) >> 2;
        uint shift = (k & 3u) * 8u;
        bytes = (k & 4u) == 0u ? uvec2(bytes.x | kept << shift, bytes.y) : uvec2(bytes.x, bytes.y | kept << shift);
        if (kept == layers_max && r.count > kept)
            atomicAdd(build.samples_lost, r.count - kept);
    }
    uint sample_ = first_sample + atomicAdd(build.samples, samples);
    uint quad = first_quad + atomicAdd(build.quads, quads);
    for (uint k = begin; k < end; k++) {
        uint kept = ((k & 4u) == 0u ? bytes.x : bytes.y) >> (k & 3u) * 8u & 255u;
        emit(run_of(k), kept, sample_, quad);
        sample_ += kept;
        quad += (kept + 3u) >> 2;
    }
}
