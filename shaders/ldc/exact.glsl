// SPDX-License-Identifier: MIT
// Finds the surface behind an intersected plane: the sample's primitive, or that of a sample beside it.
//
// A sample's plane covers its whole texel, its triangle may not: beyond an edge the surface is that of another triangle,
// or there is none. The samples in the cells round the intersection name its candidate triangles. If none of these is
// hit, and none shows that the ray passes, the plane stands for a surface too small for a sample.
#include "ldc/cells.glsl"

#ifdef LDC_EXACT

#include "common/intersection.glsl"
#include "raster/line_triangle.glsl"

layout(binding = UNIT_TRACER_6) uniform usamplerBuffer ldc_primitives;

// Maximum distance of another triangle's intersection behind the plane's, in cells.
const float BEHIND = 4.0;
// Maximum distance, in cells, of intersections that count as the same.
const float AGAIN = 1e-3;
const int TRIES_MAX = 8; // after these the last plane is the answer

// The first entry of a cell, or LDC_ENTRY_NONE.
uint entry_at(cell_traversal w, ivec3 cell)
{
    ivec3 n = cell >> LDC_NODE_SHIFT;
    if (any(greaterThanEqual(uvec3(n), uvec3(w.grid))))
        return LDC_ENTRY_NONE;
    uint at = uint(w.first_node + (n.z * w.grid + n.y) * w.grid + n.x);
    uvec3 part = uvec3(cell) >> 2;
    for (int level = 0; level < 2 && at != LDC_ENTRY_NONE; level++) {
        uvec3 words = texelFetch(ldc_nodes, int(at)).xyz;
        uint bit = part_bit(part);
        bool upper_half = (part.z & 2u) != 0u;
        uint word = upper_half ? words.y : words.x;
        uint rank = uint(bitCount(word & ((1u << bit) - 1u))) + (upper_half ? uint(bitCount(words.x)) : 0u);
        at = (word >> bit & 1u) != 0u ? words.z + rank : LDC_ENTRY_NONE;
        part = uvec3(cell);
    }
    return at;
}

#ifdef HAS_SPHERES
bool settle_sphere(trace_ray r, vec3 o, vec3 d, uint primitive, float end, inout ldc_found found)
{
    vec4 sphere = texelFetch(spheres, int(primitive));
    vec2 distances;
    if (!intersect_sphere(o, d, sphere.xyz, sphere.w, distances))
        return false;
    float distance_ = distances.x > r.t_min ? distances.x : distances.y;
    if (!(distance_ > r.t_min && distance_ < end))
        return false;
    found.end = distance_;
    return true;
}
#endif

// Replaces the intersected sample by that of the triangle that the ray hits there, before `limit`. False: the ray passes.
bool settle(trace_ray r, cell_traversal w, float limit, inout ldc_found found)
{
    uvec2 which = texelFetch(ldc_primitives, int(found.sample_index)).xy;
    vec4 rows[3] = instance_at(which.x & LDC_INSTANCE_MASK).object_from_world;
    vec3 o = affine_point(rows, r.origin), d = affine_vector(rows, r.direction);
    float end = found.end + BEHIND / w.scale;
    end = end < limit ? end : limit;
#ifdef HAS_SPHERES
    if ((which.x & LDC_OF_SPHERES) != 0u)
        return settle_sphere(r, o, d, which.y, end, found);
#endif
    line_intersection own = intersect_line_triangle(o, d, which.y);
    bool is_inside = min_component(own.weights) >= 0.0;
    if (is_inside && own.distance > r.t_min && own.distance < limit) {
        found.end = own.distance;
        return true;
    }
    // Corner of cells nearest to the intersection.
    float s = found.end * w.scale - w.begin;
    vec3 p = w.o + s * w.d;
    ivec3 corner = ivec3(floor(p + 0.5));
    ivec3 turns = ivec3(lessThan(p, vec3(corner)));
    int own_cell = turns.x | turns.y << 1 | turns.z << 2; // first
    bool is_hit = false, passes = false;
    uint seen = which.y;
    uint entry = LDC_ENTRY_NONE;
    int k = 0;
    while (!is_hit && (k < 8 || entry != LDC_ENTRY_NONE)) {
        if (entry == LDC_ENTRY_NONE) {
            ivec3 back = ivec3(k ^ own_cell) >> ivec3(0, 1, 2) & 1;
            entry = entry_at(w, cube_cell(w, corner - back));
            k++;
        }
        if (entry != LDC_ENTRY_NONE) {
            uvec2 e = texelFetch(ldc_entries, int(entry)).xy;
            entry = e.y == 0u ? LDC_ENTRY_NONE : e.y;
            uint sample_index = e.x & LDC_ENTRY_SAMPLE_MASK;
            uvec2 beside = texelFetch(ldc_primitives, int(sample_index)).xy;
            if (beside.x == which.x && beside.y != which.y && beside.y != seen) {
                seen = beside.y;
                line_intersection c = intersect_line_triangle(o, d, beside.y);
                bool inside = min_component(c.weights) >= 0.0, ahead = c.distance > r.t_min;
                bool same_way = c.from_behind == own.from_behind;
                passes = passes || (same_way ? inside && !ahead : is_beyond_edge_of(own, c));
                is_hit = inside && ahead && c.distance < end;
                found.end = is_hit ? c.distance : found.end;
                found.sample_index = is_hit ? sample_index : found.sample_index;
            }
        }
    }
    // Moved forward, a ray that leaves a body would begin inside it once more.
    bool stands_before = !is_hit && !own.from_behind;
    found.end = stands_before ? max(found.end - LDC_STANDS_BEFORE / w.scale, r.t_min) : found.end;
    return is_hit || !passes && w.is_within;
}

// Continues from a rejected intersection up to s_end. A plane extended beyond its texel may have hidden the plane of the
// next texel at the same point.
void advance(inout cell_traversal w, float s, float s_end)
{
    w.beside_max = w.is_within ? LDC_BEYOND : LDC_SLACK;
    s = w.is_within ? s + AGAIN : s - AGAIN;
    w.s_min = s > w.s_min ? s : w.s_min;
    w.s = w.s_min;
    w.s_end = s_end;
    int cells = w.grid << LDC_NODE_SHIFT;
    w.cell = clamp(ivec3(w.o + w.s * w.d), ivec3(0), ivec3(cells - 1));
    w.at = node_at(w, w.cell);
    w.shift = 2;
}

#endif
