// SPDX-License-Identifier: MIT
// A path from the texels of its buffer: PATH_TEXELS, RGBA32UI.

#include "shared/path.h"

path path_of_texels(uvec4 a, uvec4 b, uvec4 c)
{
    vec3 weight = uintBitsToFloat(a.xyz);
    return path(weight.r, weight.g, weight.b, a.w, uintBitsToFloat(b.x), uintBitsToFloat(b.y), b.z, uintBitsToFloat(b.w),
                c.x, uintBitsToFloat(c.y), uintBitsToFloat(c.z), uintBitsToFloat(c.w));
}
