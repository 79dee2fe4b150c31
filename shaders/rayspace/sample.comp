// SPDX-License-Identifier: MIT
// Decides, by comparing neighbours in a sample of a wave, whether its rays are sorted and whether they are reversed. A
// single work group.
//
// Defines: ANY_HIT.
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "rayspace/control.glsl"
#include "rayspace/ray.glsl"

uniform uint sorts, turns; // settings: 0: decided by the sample, 1: always, 2: never

// Maximum distance of the directions of sorted neighbours. Neighbours with similar directions are some thousandths apart;
// with random ones, 1.3.
const float SORTED_APART = 0.3;
const uint EACH = 4u; // samples per invocation

shared vec3 sums[64]; // sums of distances between directions, origins, ends
shared uint counts[64];

void main()
{
    uint own = gl_LocalInvocationIndex, steps = max(ray_end, 1u);
    vec3 sum = vec3(0.0);
    uint count = 0u;
    for (uint i = 0u; i < EACH; i++) {
        // Divided in two steps: the product of both would overflow.
        uint first = uint(float(own * EACH + i) / float(64u * EACH) * float(steps));
        if (first + 1u >= ray_end)
            continue;
        live_ray a = live_ray_at(first), b = live_ray_at(first + 1u);
        if (a.end < 0.0 || b.end < 0.0)
            continue;
        sum += vec3(distance(a.direction, b.direction), min(distance(a.origin, b.origin), 1e30),
                    min(distance(a.origin + a.end * a.direction, b.origin + b.end * b.direction), 1e30));
        count++;
    }
    sums[own] = sum;
    counts[own] = count;
    barrier();
    if (own != 0u)
        return;
    for (uint k = 1u; k < 64u; k++) {
        sum += sums[k];
        count += counts[k];
    }
    bool sorted = sorts == 1u || (sorts == 0u && sum.x > SORTED_APART * float(count));
    control.sorted = sorted && ray_end > 1u ? 1u : 0u;
#ifdef ANY_HIT
    control.turned = turns == 1u || (turns == 0u && sum.z < sum.y) ? 1u : 0u;
#endif
    uvec3 groups = groups_of(control.sorted != 0u ? ray_count : 0u, 1u);
    control.sort_groups_x = groups.x;
    control.sort_groups_y = groups.y;
    control.sort_groups_z = groups.z;
}
