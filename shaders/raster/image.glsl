// SPDX-License-Identifier: MIT
// Images along the axes that a surface is in, if it is not in all of them.
#include "raster/layout.h"

uniform float overlap; // AXES_OVERLAP, or 1: one image per triangle

// Whether the surface is in an image. `lean`: absolute values of its normal's components.
bool is_in_image(vec3 lean, int axis)
{
    float maximum = max(lean.x, max(lean.y, lean.z));
    if (overlap < 1.0)
        return lean[axis] >= overlap * maximum;
    int first = lean.x == maximum ? 0 : lean.y == maximum ? 1 : 2; // the first of equal ones
    return axis == first;
}
