// SPDX-License-Identifier: MIT
// The traversal through a tree of tiles (svo/svo.h): from the root to the leaf or empty node that the ray is in, then from
// there to where the ray leaves it, and from the root again. Crassin et al. GigaVoxels. 2009.
//
// Define: SVO_LEVELS
#include "common/candidate.glsl"
#include "common/math.glsl"
#include "svo/held.glsl"
#include "svo/tree.glsl"

uniform vec3 lower_world;
uniform float cell_world;
uniform vec3 lower_cells, upper_cells; // whole numbers: nothing lies outside
uniform uint first_leaf;

const float SKIP_CELLS = 2.0; // of a ray that begins on a surface: its first cells hold it
const float SLOWEST = 1e-6;   // of a cell a length of the direction

// The first leaf, -1: none, and the middle of the ray's way through it.
int first_leaf_of(trace_ray r, out float distance_)
{
    float cells = 1.0 / cell_world;
    vec3 origin = (r.origin - lower_world) * cells, direction = r.direction * cells;
    bvec3 up = greaterThanEqual(direction, vec3(0.0));
    vec3 slow = mix(vec3(-SLOWEST * cells), vec3(SLOWEST * cells), up);
    direction = mix(direction, slow, lessThan(abs(direction), vec3(SLOWEST * cells)));
    vec3 inverse = 1.0 / direction, near = (mix(upper_cells, lower_cells, up) - origin) * inverse,
         far = (mix(lower_cells, upper_cells, up) - origin) * inverse;
    float t = max(max(r.t_min, 0.0) + SKIP_CELLS * cell_world, max_component(near)), end = min(r.t_max, min_component(far));
    ivec3 lower = ivec3(lower_cells), last = ivec3(upper_cells) - 1;
    ivec3 cell = clamp(ivec3(origin + t * direction), lower, last), upward = ivec3(up);
    int node = 0, shift = SVO_LEVELS, leaf = -1;
    while (t < end && leaf < 0) {
        uint word = texelFetch(records, node).x;
        ivec3 corner = ((cell >> shift) + upward) << shift;
        vec3 at = (vec3(corner) - origin) * inverse;
        float leaves = min_component(at);
        if (word == 0u) {
            ivec3 own = (cell >> shift) << shift;
            cell = clamp(ivec3(origin + leaves * direction), own, own + (1 << shift) - 1);
            cell = mix(cell, corner - 1 + upward, lessThanEqual(at, vec3(leaves)));
            bool is_out = any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, ivec3(1 << SVO_LEVELS)));
            t = is_out ? end : leaves;
            node = 0;
            shift = SVO_LEVELS;
        } else if (shift == 0) {
            leaf = node - int(first_leaf);
            distance_ = 0.5 * (t + min(leaves, end));
        } else {
            shift--;
            ivec3 bits = (cell >> shift) & 1;
            node = int(word & ~SVO_HOLDS) + (bits.x | bits.y << 1 | bits.z << 2);
        }
    }
    return leaf;
}

#ifdef ANY_HIT
bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    float distance_;
    int leaf = first_leaf_of(r, distance_);
    if (leaf < 0)
        return false;
#ifdef HAS_TRANSLUCENT
    return offer_any(r, candidate_of(leaf, distance_), optical_depth); // only the first: enough for what is compared
#else
    optical_depth = vec3(OPTICAL_DEPTH_MAX);
    return true;
#endif
}
#else
void trace_closest(trace_ray r, inout candidate best)
{
    float distance_;
    r.t_max = best.distance;
    int leaf = first_leaf_of(r, distance_);
    if (leaf >= 0)
        best = candidate_of(leaf, distance_);
}
#endif
