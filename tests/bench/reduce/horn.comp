// SPDX-License-Identifier: MIT
// Stream reduction that is not hierarchical. Horn, Stream Reduction Operations for GPGPU Applications, GPU Gems 2,
// 2005: how many slots are empty up to each one is added up in log n passes, then every place looks for its slot.
// O(n log n).
//
// Defines, one of:
//   HORN_COUNT   1 for a slot that is empty
//   HORN_ADD     each sum has another one added, of slots before it
//   HORN_GATHER  every place looks for its slot, by bisection
#include "common/dispatch.glsl"
#include "rayspace/reduce.h"
#include "shared/bindings.h"

layout(binding = UNIT_RAYSPACE_SLOTS) uniform usamplerBuffer slots;
layout(binding = UNIT_TRACER_0) uniform usamplerBuffer sums;
#ifdef HORN_GATHER
layout(std430, binding = BIND_RAYSPACE_CONTROL) buffer control_block { rayspace_control control; };
layout(std430, binding = BIND_RAYSPACE_PAIRS) writeonly buffer pair_block { uvec4 pairs_written[]; };
#else
layout(std430, binding = BIND_RAYSPACE_SEGMENTS) writeonly buffer sum_block { uint sums_written[]; };
#endif

uniform uint slot_count;
uniform uint reach; // of HORN_ADD

void main()
{
    uint self = item_index();
    if (self >= slot_count)
        return;
#if defined HORN_COUNT
    sums_written[self] = texelFetch(slots, int(self)).w == RAYSPACE_SLOT_EMPTY ? 1u : 0u;
#elif defined HORN_ADD
    uint sum = texelFetch(sums, int(self)).x;
    if (self >= reach)
        sum += texelFetch(sums, int(self - reach)).x;
    sums_written[self] = sum;
#else
    uint kept_count = slot_count - texelFetch(sums, int(slot_count - 1u)).x;
    if (self == 0u)
        control.written = kept_count;
    if (self >= kept_count)
        return;
    uint low = self, high = slot_count - 1u; // the first slot with self + 1 kept up to it, itself among them
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (middle + 1u - texelFetch(sums, int(middle)).x > self)
            high = middle;
        else
            low = middle + 1u;
    }
    pairs_written[self] = texelFetch(slots, int(low));
#endif
}
