// SPDX-License-Identifier: MIT
// Evaluates the surface's material at each sample from the lists of fragments.
// Defines: those of ldc/sample.glsl.

#include "common/dispatch.glsl"
#include "ldc/sample.glsl"

uniform uint sample_count, first_sample; // those of the cube
uniform uint drawn_count;

layout(binding = UNIT_LDC_DRAWN) uniform usamplerBuffer drawn;
layout(binding = IMAGE_LDC_GEOMETRY, rg32ui) writeonly uniform uimageBuffer geometry_out;
layout(binding = IMAGE_LDC_SURFACE, rgba32ui) uniform uimageBuffer surface_; // the point to be sampled, then its words
layout(binding = IMAGE_LDC_PRIMITIVES, rg32ui) writeonly uniform uimageBuffer primitives_out;

// Entry of `drawn` for an id.
uvec4 drawn_of(uint id)
{
    uint first = 0u, count = drawn_count;
    while (count > 1u) {
        uint half_ = count >> 1;
        bool beyond = texelFetch(drawn, int(first + half_)).x <= id;
        first = beyond ? first + half_ : first;
        count = beyond ? count - half_ : half_;
    }
    return texelFetch(drawn, int(first));
}

void main()
{
    uint k = item_index();
    if (k >= sample_count)
        return;
    uvec4 found = imageLoad(surface_, int(first_sample + k));
    uvec4 of = drawn_of(found.z);
    vec2 middle = vec2(found.x & 4095u, found.x >> 12 & 4095u) + 0.5;
    uvec2 geometry_words;
    uvec4 surface_words;
    point p = make_point(of.z, found.z - of.y, of.w, int(found.x >> 24), middle, uintBitsToFloat(found.y));
    describe(p, geometry_words, surface_words);
    imageStore(geometry_out, int(first_sample + k), uvec4(geometry_words, 0u, 0u));
    imageStore(surface_, int(first_sample + k), surface_words);
    imageStore(primitives_out, int(first_sample + k), uvec4(primitive_words(p), 0u, 0u));
}
