// SPDX-License-Identifier: MIT
// Packing of a hit's colour.

// Colour of a hit in 32 bits: square roots of linear light, which keep dark colours smooth.
uint pack_hit_colour(vec4 colour)
{
    return packUnorm4x8(vec4(sqrt(clamp(colour.rgb, 0.0, 1.0)), colour.a));
}

vec4 unpack_hit_colour(uint word)
{
    vec4 roots = unpackUnorm4x8(word);
    return vec4(roots.rgb * roots.rgb, roots.a);
}
