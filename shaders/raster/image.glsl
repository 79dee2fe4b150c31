// SPDX-License-Identifier: MIT
// The images along the axes that a surface is in, if it is not in all.
#include "raster/layout.h"

uniform float overlap; // AXES_OVERLAP, or 1: one image per triangle

// `lean`: absolute values of its normal's components.
bool is_in_image(vec3 lean, int axis)
{
    float most = max(lean.x, max(lean.y, lean.z));
    if (overlap < 1.0)
        return lean[axis] >= overlap * most;
    int first = lean.x == most ? 0 : lean.y == most ? 1 : 2; // of equal ones
    return axis == first;
}
