// SPDX-License-Identifier: MIT
// The traversal through a sparse voxel octree (svo/svo.h), front to back down to the leaves. Laine, Karras. Efficient Sparse
// Voxel Octrees. 2010: the ray's cell as whole numbers whose highest differing bit says how far to climb, and a stack
// of the nodes above, which are so few here that they are variables.
//
// All directions are made to run upwards: where a component runs down, cells are counted from the other side.
//
// Defines: SVO_PLANES  a leaf is hit where the ray intersects its plane, within the cell; else anywhere in it
//          SVO_TOP_SHIFT  the root's grandchildren are cells of 2^SVO_TOP_SHIFT: 8 and less
#include "common/candidate.glsl"
#include "common/math.glsl"
#include "svo/held.glsl"
#include "svo/plane.glsl"
#include "svo/tree.glsl"

layout(binding = UNIT_SVO_PLANES) uniform usamplerBuffer planes;

uniform vec3 lower_world;
uniform float cell_world;
uniform vec3 lower_cells, upper_cells; // whole numbers: nothing lies outside

const int SIDE = 4 << SVO_TOP_SHIFT;
// A ray that begins on a surface begins within a cell that holds it, and often leaves it by another.
#ifdef SVO_PLANES
const float SKIP_CELLS = 1.0;
#else
const float SKIP_CELLS = 2.0;
#endif
// What is intersected a little outside of the cell counts, as the planes of two neighbours do not meet at their side.
const float PLANE_MARGIN_CELLS = 0.5;
// Of a cell a length of the direction.
const float SLOWEST = 1e-6;

struct svo_traversal {
    vec3 origin, direction, inverse; // cells; upwards
    ivec3 mirrored;                  // -1 where it was turned round
    int mirror_bits;                 // of grandchild_of()
    bool mirror_high;
    ivec3 cell;
    float t, end; // where it enters the cell; where it ends
    int shift;    // of the record
    int record, at_2, at_4, at_6;
};

// False: it passes by all.
bool begin(trace_ray r, out svo_traversal w)
{
    float cells = 1.0 / cell_world;
    w.origin = (r.origin - lower_world) * cells;
    w.direction = r.direction * cells;
    vec3 lower = lower_cells, upper = upper_cells;
    w.mirror_bits = 0;
    for (int i = 0; i < 3; i++) {
        w.mirrored[i] = 0;
        if (w.direction[i] < 0.0) {
            w.direction[i] = -w.direction[i];
            w.origin[i] = float(SIDE) - w.origin[i];
            float turned = float(SIDE) - lower[i];
            lower[i] = float(SIDE) - upper[i];
            upper[i] = turned;
            w.mirrored[i] = -1;
            w.mirror_bits |= i == 2 ? 16 : 3 << (2 * i);
        }
        w.direction[i] = max(w.direction[i], SLOWEST * cells);
    }
    w.mirror_high = w.mirrored.z != 0;
    w.inverse = 1.0 / w.direction;
    w.t = max(max(r.t_min, 0.0) + SKIP_CELLS * cell_world, max_component((lower - w.origin) * w.inverse));
    w.end = min(r.t_max, min_component((upper - w.origin) * w.inverse));
    w.cell = clamp(ivec3(w.origin + w.t * w.direction), ivec3(lower), ivec3(upper) - 1);
    w.shift = SVO_TOP_SHIFT;
    w.record = w.at_2 = w.at_4 = w.at_6 = 0;
    return w.t < w.end;
}

// Where the ray leaves the cell of 2^size that it is in.
float leaves_at(svo_traversal w, int size, out ivec3 upper, out vec3 at)
{
    upper = (w.cell | ((1 << size) - 1)) + 1;
    at = (vec3(upper) - w.origin) * w.inverse;
    return min_component(at);
}

// To the cell behind that one; false: the ray ends before.
bool advance(inout svo_traversal w, int size)
{
    ivec3 upper;
    vec3 at;
    w.t = leaves_at(w, size, upper, at);
    // Rounding may put a place before or behind the side that it is on: cells only ever count up, one side at a time.
    ivec3 inside = ivec3(w.origin + w.t * w.direction), last = upper - 1, next;
    for (int i = 0; i < 3; i++) {
        int k = inside[i] > w.cell[i] ? inside[i] : w.cell[i];
        k = k < last[i] ? k : last[i];
        next[i] = at[i] <= w.t ? upper[i] : k;
    }
    ivec3 differing = w.cell ^ next;
    int any = differing.x | differing.y | differing.z;
    // The number of the highest bit, from the exponent of a float.
    int highest = (floatBitsToInt(float(any)) >> 23) - 127;
    int shift = highest & ~1;
    if (shift > w.shift) {
        w.record = shift == 2 ? w.at_2 : shift == 4 ? w.at_4 : shift == 6 ? w.at_6 : 0;
        w.shift = shift;
    }
    w.cell = next;
    return w.t < w.end;
}

// The next leaf from where the ray is; -1: none.
int next_leaf(inout svo_traversal w)
{
    int leaf = -1;
    bool on = true;
    while (on) {
        uvec4 record = texelFetch(records, w.record);
        ivec3 q = w.cell >> w.shift;
        int bit = ((q.x & 3) | (q.y & 3) << 2 | (q.z & 1) << 4) ^ w.mirror_bits;
        bool is_high = ((q.z & 2) != 0) != w.mirror_high;
        uint word = is_high ? record.y : record.x;
        if (((word >> bit) & 1u) != 0u) {
            int place = int(is_high ? record.w : record.z) + bitCount(word & ((1u << bit) - 1u));
            if (w.shift == 0) {
                leaf = place;
                on = false;
            } else {
                w.at_2 = w.shift == 2 ? w.record : w.at_2;
                w.at_4 = w.shift == 4 ? w.record : w.at_4;
                w.at_6 = w.shift == 6 ? w.record : w.at_6;
                w.record = place;
                w.shift -= 2;
            }
        } else {
            bool octant_empty = ((word >> (bit & 10)) & SVO_EIGHT) == 0u;
            on = advance(w, w.shift + (octant_empty ? 1 : 0));
        }
    }
    return leaf;
}

// Whether the ray hits what is in a leaf, and where.
bool is_hit(svo_traversal w, int leaf, out float distance_)
{
    ivec3 upper;
    vec3 at;
    float leaves = min(leaves_at(w, 0, upper, at), w.end);
    distance_ = 0.5 * (w.t + leaves);
#ifdef SVO_PLANES
    uint bits = texelFetch(planes, leaf).x;
    if (bits == SVO_NO_PLANE)
        return true;
    vec4 plane = unpack_plane(bits);
    vec3 normal = mix(plane.xyz, -plane.xyz, lessThan(w.mirrored, ivec3(0)));
    float approach = dot(normal, w.direction);
    float intersection = (plane.w - dot(normal, w.origin - (vec3(upper) - 0.5))) / approach;
    float margin = PLANE_MARGIN_CELLS * cell_world;
    distance_ = intersection;
    return intersection >= w.t - margin && intersection <= leaves + margin;
#else
    return true;
#endif
}

// Adjacent cells count as one surface, which attenuates the light once.
bool is_other_surface(float t, float left_at)
{
#ifdef SVO_PLANES
    return true;
#else
    return t != left_at;
#endif
}

#ifdef ANY_HIT
bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    svo_traversal w;
    if (!begin(r, w))
        return false;
    float left_at = -1.0; // the leaf before
    for (;;) {
        int leaf = next_leaf(w);
        if (leaf < 0)
            return false;
        float distance_;
        if (is_hit(w, leaf, distance_)) {
#ifdef HAS_TRANSLUCENT
            if (is_other_surface(w.t, left_at) && offer_any(r, candidate_of(leaf, distance_), optical_depth))
                return true;
#else
            optical_depth = vec3(OPTICAL_DEPTH_MAX);
            return true;
#endif
        }
        if (!advance(w, 0))
            return false;
        left_at = w.t;
    }
}
#else
void trace_closest(trace_ray r, inout candidate best)
{
    svo_traversal w;
    r.t_max = best.distance;
    if (!begin(r, w))
        return;
    for (;;) {
        float distance_;
        int leaf = next_leaf(w);
        if (leaf < 0)
            return;
        if (is_hit(w, leaf, distance_)) {
            best = candidate_of(leaf, distance_);
            return;
        }
        if (!advance(w, 0))
            return;
    }
}
#endif
