// SPDX-License-Identifier: MIT
// Orientation of a surface to the axes: FACE_* bits of raster/layout.h.
#include "raster/layout.h"
#include "common/math.glsl"
#include "common/unit.glsl"

// FACE_* bits of a normal; `unit` points to the outside.
uint face_of(vec3 unit)
{
    vec3 lean = abs(unit);
    float maximum = max_component(lean);
    uint face = pack_unit_24(unit);
    for (int axis = 0; axis < 3; axis++) {
        face |= lean[axis] >= AXES_OVERLAP * maximum ? FACE_LEANS << axis : 0u;
        face |= lean[axis] < FACE_STEEP_BELOW ? FACE_STEEP << axis : 0u;
    }
    return face;
}

// Whether an image shows the surface well.
bool is_shown(uint face, int axis)
{
    return (face & FACE_STEEP << axis) == 0u || (face & FACE_LEANS << axis) != 0u;
}

// Dominant axis; the first of equal ones.
int axis_of(vec3 lean)
{
    return lean.x >= lean.y && lean.x >= lean.z ? 0 : lean.y >= lean.z ? 1 : 2;
}
