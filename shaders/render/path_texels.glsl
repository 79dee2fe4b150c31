// SPDX-License-Identifier: MIT
// Conversion of a path from and to the texels of its buffer: PATH_TEXELS, RGBA32UI.

#include "shared/path.h"

path path_of_texels(uvec4 a, uvec4 b, uvec4 c)
{
    vec3 weight = uintBitsToFloat(a.xyz);
    return path(weight.r, weight.g, weight.b, a.w, uintBitsToFloat(b.x), uintBitsToFloat(b.y), b.z, uintBitsToFloat(b.w),
                c.x, uintBitsToFloat(c.y), uintBitsToFloat(c.z), uintBitsToFloat(c.w));
}

// Texels of a path. There are only three stores: each is code of its own, whose size hardly depends on the number of
// words.
struct path_texels {
    uvec4 a, b, c;
};

path_texels texels_of_path(path p)
{
    return path_texels(uvec4(floatBitsToUint(vec3(p.weight_r, p.weight_g, p.weight_b)), p.sample_slot),
                       uvec4(floatBitsToUint(vec2(p.cone_width, p.cone_spread)), p.flags, floatBitsToUint(p.time)),
                       uvec4(p.light_number, floatBitsToUint(vec3(p.light_distance, p.light_share, p.environment_share))));
}
