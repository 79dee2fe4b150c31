// SPDX-License-Identifier: MIT
// What the passes of a wave share.
#include "rayspace/layout.h"
#include "shared/bindings.h"

layout(std430, binding = BIND_RAYSPACE_CONTROL) buffer control_block { rayspace_control control; };

uint waiting_on(uint stack)
{
    return stack == 0u ? control.waiting_0 : stack == 1u ? control.waiting_1 : control.waiting_2;
}
