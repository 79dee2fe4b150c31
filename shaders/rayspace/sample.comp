// SPDX-License-Identifier: MIT
// Decides from a sample of a wave, whose neighbours are compared, whether its rays are sorted and whether they are turned
// round. One group.
//
// Defines: ANY_HIT.
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "rayspace/answer.glsl"
#include "rayspace/control.glsl"
#include "rayspace/ray.glsl"

uniform uint sorts, turns; // 0: never, 1: always, 2: as the sample says

// Neighbours of one direction are some thousandths apart; of directions by chance, 1.3.
const float SORTED_APART = 0.3;
const uint EACH = 4u; // of an invocation

shared vec3 sums[64]; // of distances of directions, origins, ends
shared uint counts[64];

void main()
{
    uint own = gl_LocalInvocationIndex, steps = max(ray_end, 1u);
    vec3 sum = vec3(0.0);
    uint count = 0u;
    for (uint i = 0u; i < EACH; i++) {
        // in two steps: the product of both does not fit
        uint first = uint(float(own * EACH + i) / float(64u * EACH) * float(steps));
        if (first + 1u >= ray_end)
            continue;
        live_ray a = live_ray_of(texelFetch(rays, int(2u * first)), texelFetch(rays, int(2u * first + 1u)),
                                 texelFetch(rays, int(2u * first + 1u)).w);
        live_ray b = live_ray_of(texelFetch(rays, int(2u * first + 2u)), texelFetch(rays, int(2u * first + 3u)),
                                 texelFetch(rays, int(2u * first + 3u)).w);
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
    bool sorted = sorts == 1u || (sorts == 2u && sum.x > SORTED_APART * float(count));
    control.sorted = sorted && ray_end > 1u ? 1u : 0u;
#ifdef ANY_HIT
    control.turned = turns == 1u || (turns == 2u && sum.z < sum.y) ? 1u : 0u;
#endif
    uint groups = control.sorted != 0u ? (ray_count + 63u) / 64u : 0u, x = min(groups, WAVE_GROUPS_MAX);
    control.sort_groups_x = x;
    control.sort_groups_y = x > 0u ? (groups + x - 1u) / x : 1u;
    control.sort_groups_z = 1u;
}
