// SPDX-License-Identifier: MIT
// Which of a cube's images a surface is in.
#include "shared/ldc.h"

uniform float overlap; // LDC_OVERLAP, or 1: the paper's one image a triangle

// `lean`: absolute values of its normal's components.
bool is_in_image(vec3 lean, int axis)
{
    float most = max(lean.x, max(lean.y, lean.z));
    if (overlap < 1.0)
        return lean[axis] >= overlap * most;
    int first = lean.x == most ? 0 : lean.y == most ? 1 : 2; // of equal ones
    return axis == first;
}
