// SPDX-License-Identifier: MIT
// Rays through the surfaces that a view sees (quadtree/layout.h). Widmer, Pajak, Schulz, Pulli, Kautz, Goesele, Luebke.
// An Adaptive Acceleration Structure for Screen-space Ray Tracing. 2015, section 4.
//
// A ray is traced through the first layer of a face. Where it is behind what that layer holds, what it may hit there is
// in the next one, and only there is it traced through that. Where it is behind the last layer, nothing is known.
//
// Defines: QUADTREE_PLANES a hit is where the ray meets a node's plane, else where it meets the primitive; QUADTREE_DDA
// from texel to texel, not by the tree; QUADTREE_COUNT_STEPS hits are counts: nodes looked at, and layers.
#define INTERSECTION_FLAGS walk_flags

#include "shared/path.h"
#include "quadtree/face.glsl"

layout(binding = UNIT_QUADTREE_VISIBLE) uniform usampler2DArray quadtree_visible;
layout(binding = UNIT_QUADTREE_NODES) uniform usamplerBuffer quadtree_nodes;
layout(std430, binding = BIND_QUADTREE_COUNTS) buffer quadtree_counts_block { quadtree_counts counts_of_kinds[]; };

uniform uint ray_kind;

#ifdef ANY_HIT
#define found_type vec3 // optical depth
#else
#define found_type candidate
#endif

const float NEVER = 2.0; // beyond the end of a segment

// What a walk through one layer is about, and what it has found.
struct layer_walk {
    uint slice, layer;
    float u, u_end;    // where the ray is, and where it ends, as far as is known
    float u_behind;    // where it came behind this layer, for more than a texel; NEVER: it did not
    ivec2 last_before; // the texel over which it was last before the layer; negative: it was not
    ivec2 behind_texel; // the same when it came behind
    vec3 origin;       // x, y, w of the ray's origin; w below 0: it is not in this face
    vec2 offered;      // distances of the last two intersections, none of which counts twice
};

uint walk_flags = 0u;
uint walk_steps = 0u;

// ---- hits ----

bool is_met_before(layer_walk walk, float distance_)
{
    vec2 apart = abs(walk.offered - distance_);
    return min(apart.x, apart.y) <= 1e-5 * abs(distance_);
}

// True if the ray ends there.
bool offer(trace_ray r, candidate met, inout layer_walk walk, inout found_type found)
{
#ifdef ANY_HIT
    if (is_met_before(walk, met.distance))
        return false;
    walk.offered = vec2(met.distance, walk.offered.x);
    return offer_any(r, met, found);
#else
    float before = found.distance;
    offer_closest(r, met, found);
    if (found.distance >= before)
        return false;
    walk_flags = (walk.layer + 1u) << HIT_LAYER_SHIFT;
    return false; // the walk ends where the ray now does
#endif
}

// The primitive that a texel shows; false: none that is a hit of its own.
bool visible_at(ivec2 texel, uint slice, out uvec2 visible)
{
    ivec2 last = ivec2(quadtree.width, quadtree.height) - 1;
    visible = texelFetch(quadtree_visible, ivec3(clamp(texel, ivec2(0), last), int(slice)), 0).xy;
    return visible.x != VISIBLE_NOTHING && visible.x != VISIBLE_DISC;
}

// Of a sphere the root that is nearer to `near`.
bool intersect_visible(trace_ray r, uvec2 visible, float near, out candidate met)
{
    object_ray o = object_from_world_ray(r, visible.x - 1u);
    met = candidate(0.0, visible.y, visible.x - 1u, vec2(0.0));
#ifdef HAS_SPHERES
    if (geometry_at(instance_at(visible.x - 1u).geometry).kind == GEOMETRY_SPHERES) {
        vec4 sphere = texelFetch(spheres, int(visible.y));
        vec2 distances;
        if (!intersect_sphere(o.origin, o.direction, sphere.xyz, sphere.w, distances))
            return false;
        met.distance = abs(distances.x - near) < abs(distances.y - near) ? distances.x : distances.y;
        return true;
    }
#endif
    return intersect_primitive(r, o, visible.y, visible.x - 1u, met);
}

// The primitives of the texel and of those beside it on the side of the place; the first that is met is enough where
// surfaces go on from texel to texel. True: the ray ends.
bool offer_primitives(trace_ray r, vec2 place, float near, bool all_four, inout layer_walk walk, inout found_type found,
                      out bool has_met)
{
    ivec2 texel = ivec2(floor(place)), towards = ivec2(greaterThan(fract(place), vec2(0.5))) * 2 - 1;
    uvec2 tried = uvec2(VISIBLE_NOTHING);
    has_met = false;
    bool ends = false;
    for (int i = 0; i < 4 && (all_four || !has_met); i++) {
        uvec2 visible;
        candidate met;
        if (!visible_at(texel + ivec2(i & 1, i >> 1) * towards, walk.slice, visible) || visible == tried)
            continue;
        tried = visible;
        if (intersect_visible(r, visible, near, met) && met.distance > r.t_min) {
            has_met = true;
            ends = offer(r, met, walk, found) || ends;
        }
    }
    return ends;
}

// A plane through a neighbour of the surface that the ray begins on may pass beside its origin: no hit.
bool is_own_surface(layer_walk walk, vec3 place, vec2 slopes)
{
    vec3 away = abs(place - walk.origin);
    return walk.origin.z >= 0.0 && max(away.x, away.y) < QUADTREE_OWN_WAY &&
           away.z <= QUADTREE_OWN_WAY * (abs(slopes.x) + abs(slopes.y)) + QUADTREE_EDGE_SHARE * place.z;
}

// The ray meets the plane of a node at u. True: it ends.
bool meet(trace_ray r, face_segment s, float u, uvec2 node, inout layer_walk walk, inout found_type found)
{
    vec3 place = s.from + u * s.along;
    float near = distance_at(s, u);
#ifndef QUADTREE_PLANES
    bool has_met;
    if (offer_primitives(r, place.xy, near, plane_is_at_edge(node), walk, found, has_met))
        return true;
    if (has_met || plane_is_at_edge(node))
        return false;
#endif
    uvec2 visible;
    if (is_own_surface(walk, place, plane_slopes(node)) || !visible_at(ivec2(floor(place.xy)), walk.slice, visible))
        return false;
    bool ends_ = offer(r, candidate(near, visible.y, visible.x - 1u, vec2(0.0)), walk, found);
    walk_flags |= 0x40000000u;
    return ends_;
}

// ---- the walk through a layer ----

// A ray that is behind a plane's extension beyond the surface comes before its neighbour's within a texel: it counts as
// behind the layer where it stays so.
void note_behind(face_segment s, float gap, float w, float u_in, float u_out, inout float u_since, inout layer_walk walk)
{
    u_since = min(u_since, u_in);
    vec2 way = abs(s.along.xy) * (u_out - u_since);
    if (gap > QUADTREE_DEEP * w || max(way.x, way.y) > QUADTREE_OWN_WAY)
        if (u_since < walk.u_behind) {
            walk.u_behind = u_since;
            walk.behind_texel = walk.last_before;
        }
}

#ifdef ANY_HIT
#define SHORTEN(s, walk, found)
#else
#define SHORTEN(s, walk, found) walk.u_end = min(walk.u_end, place_at(s, found.distance))
#endif

// True: the ray ends.
bool walk_layer(trace_ray r, face_segment s, inout layer_walk walk, inout found_type found)
{
    const uint slice_first = walk.slice * quadtree.slice_nodes;
    vec2 along = mix(s.along.xy, vec2(1e-9), lessThan(abs(s.along.xy), vec2(1e-9)));
    vec2 inverse = 1.0 / along;
    ivec2 forward = ivec2(greaterThan(along, vec2(0.0))), size = ivec2(quadtree.padded_width, quadtree.padded_height);
    ivec2 texel = clamp(ivec2(floor(s.from.xy + s.along.xy * walk.u)), ivec2(0), size - 1);
#ifdef QUADTREE_DDA
    int level = 0;
#else
    int level = QUADTREE_TOP;
#endif
    ivec2 cell = texel >> level;
    bool is_before = false, is_behind = false; // neither: it has just begun
    float u_since = NEVER; // since when it is behind
    walk.last_before = ivec2(-1);
    while (walk.u < walk.u_end) {
        walk_steps++;
        uvec2 node = texelFetch(quadtree_nodes, int(slice_first + node_index(0u, uint(level), uvec2(cell)))).xy;
        vec2 exits = (vec2((cell + forward) << level) - s.from.xy) * inverse;
        float u_out = clamp(min(exits.x, exits.y), walk.u, walk.u_end);
        float w_in = s.from.z + s.along.z * walk.u, w_out = s.from.z + s.along.z * u_out;
        if (node_is_plane(node)) {
            vec2 slopes = plane_slopes(node), centre = (vec2(cell) + 0.5) * float(1 << level);
            float w = plane_w(node) + dot(slopes, s.from.xy - centre), growth = dot(slopes, s.along.xy);
            float gap_in = w + growth * walk.u - w_in, gap_out = w + growth * u_out - w_out; // above 0: it is behind
            float u_meet = NEVER;
            if ((gap_in > 0.0) != (gap_out > 0.0))
                u_meet = mix(walk.u, u_out, clamp(gap_in / (gap_in - gap_out), 0.0, 1.0));
            else if (is_before && gap_in > 0.0 && gap_in <= QUADTREE_EDGE_SHARE * w_in + quadtree.bounds.x)
                u_meet = walk.u; // between two planes that do not quite meet
#ifndef QUADTREE_PLANES
            // Within a texel of an edge, of which its middle sees the other side.
            else if (gap_in > 0.0 ? !is_behind : !is_before) {
                bool has_met;
                if (offer_primitives(r, (s.from + walk.u * s.along).xy, distance_at(s, walk.u), true, walk, found, has_met))
                    return true;
                SHORTEN(s, walk, found);
                if (walk.u_end <= u_out)
                    return false;
            }
#endif
            if (u_meet != NEVER) {
                if (meet(r, s, u_meet, node, walk, found))
                    return true;
                SHORTEN(s, walk, found);
                if (walk.u_end <= u_out)
                    return false;
            }
            is_before = gap_out <= 0.0;
            is_behind = !is_before;
            if (is_before) {
                u_since = NEVER;
                walk.last_before = clamp(ivec2(floor(s.from.xy + s.along.xy * mix(walk.u, u_out, 0.999))), cell << level,
                                         ((cell + 1) << level) - 1);
            } else {
                note_behind(s, gap_out, w_out, gap_in > 0.0 ? walk.u : u_meet, u_out, u_since, walk);
            }
        } else {
            vec2 range = box_range(node);
            if (min(w_in, w_out) <= range.x && max(w_in, w_out) >= range.y) {
                level--;
                ivec2 low = cell * 2;
                cell = clamp(ivec2(floor(s.from.xy + s.along.xy * walk.u)) >> level, low, low + 1);
                continue;
            }
            is_before = min(w_in, w_out) > range.x;
            is_behind = !is_before;
            if (is_before) {
                u_since = NEVER;
                walk.last_before = clamp(ivec2(floor(s.from.xy + s.along.xy * mix(walk.u, u_out, 0.999))), cell << level,
                                         ((cell + 1) << level) - 1);
            } else {
                note_behind(s, range.y - max(w_in, w_out), w_out, walk.u, u_out, u_since, walk);
            }
        }
        ivec2 next = cell;
        if (exits.x < exits.y)
            next.x += forward.x * 2 - 1;
        else
            next.y += forward.y * 2 - 1;
        walk.u = u_out;
        if (any(lessThan(next, ivec2(0))) || any(greaterThanEqual(next << level, size)))
            break;
#ifdef QUADTREE_DDA
        cell = next;
#else
        // One level below the last node that both are in.
        int up = min(findMSB((cell.x ^ next.x) | (cell.y ^ next.y)), QUADTREE_TOP - level);
        level += up;
        cell = next >> up;
#endif
    }
    return false;
}

// ---- faces ----

// What is known of a ray in all faces.
struct view_walk {
    float t_unknown; // from where on nothing is; 1e30: all is known
    uint layers;     // that it had to look at
    bool has_left;   // it is unknown as the ray is outside what the view sees
    uint fill_slice; // where it was last before a surface
    ivec2 fill_texel;
};

// Through the layers of a face, from one to the next where the ray is behind it. True: the ray ends.
bool walk_face(trace_ray r, uint face, face_segment s, vec3 origin, inout view_walk seen, inout found_type found)
{
    layer_walk walk;
    float u_from = 0.0, u_end = 1.0;
    bool has_hit = false;
    walk.offered = vec2(-1.0);
    walk.origin = origin;
    for (uint layer = 0u; layer < quadtree.layers && u_from < u_end; layer++) {
        walk.layer = layer;
        walk.slice = face * quadtree.layers + layer;
        walk.u = u_from;
        walk.u_end = u_end;
        walk.u_behind = NEVER;
        seen.layers = max(seen.layers, layer + 1u);
        if (walk_layer(r, s, walk, found)) {
#ifdef ANY_HIT
            return true;
#else
            has_hit = true; // but where the ray was behind the layer before, something may be in the next one
            walk.u_end = min(walk.u_end, place_at(s, found.distance));
#endif
        }
        u_end = walk.u_end;
        u_from = walk.u_behind;
    }
    float t = distance_at(s, min(u_from, 1.0));
    if (u_from < u_end && t < seen.t_unknown) {
        seen.t_unknown = t;
        seen.has_left = false;
        seen.fill_slice = walk.slice;
        seen.fill_texel = walk.behind_texel;
    }
    return has_hit;
}

// A view does not see what is beside it. But what lies between another eye near its own and its pyramid is taken to
// be empty.
void note_outside(trace_ray r, vec2 t, float t_end, inout view_walk seen)
{
    bool is_eye = distance(r.origin, quadtree.eye_world.xyz) <= quadtree.eye_world.w;
    float t_outside = !(t.x < t.y) || (t.x > r.t_min && !is_eye) ? r.t_min : t.y < t_end ? t.y : 1e30;
    if (t_outside < seen.t_unknown) {
        seen.t_unknown = t_outside;
        seen.has_left = true;
    }
}

// How far along a ray something may be that the view sees.
float last_distance(trace_ray r)
{
    return (length(r.origin - quadtree.eye_world.xyz) + quadtree.depths.y) / length(r.direction);
}

uint face_towards(vec3 p)
{
    if (quadtree.faces == 1u)
        return 0u;
    vec3 size = abs(p);
    uint axis = size.x >= max(size.y, size.z) ? 0u : size.y >= size.z ? 1u : 2u;
    return 2u * axis + uint(p[axis] < 0.0);
}

#ifdef ANY_HIT
#define NEAREST(found, r) r.t_max
#else
#define NEAREST(found, r) found.distance
#endif

bool walk_view(trace_ray r, inout view_walk seen, inout found_type found)
{
    vec3 from_eye = r.origin - quadtree.eye_world.xyz;
    float t_last = last_distance(r);
    uint first = face_towards(from_eye + r.t_min * r.direction);
    for (uint i = 0u; i < quadtree.faces; i++) {
        uint face = i == 0u ? first : i <= first ? i - 1u : i;
        float t_end = min(t_last, NEAREST(found, r));
        vec3 origin = face_vector(face, from_eye), direction = face_vector(face, r.direction);
        vec2 t = clip_to_face(origin, direction, vec2(r.t_min, t_end));
        if (t.x < t.y) {
            bool is_inside = origin.z >= quadtree.depths.w;
            vec3 place = is_inside ? face_place(origin, face_q(origin)) : vec3(-1.0);
            bool has_ended = walk_face(r, face, segment_of(origin, direction, t), place, seen, found);
            if (quadtree.faces == 1u)
                note_outside(r, t, min(t_last, NEAREST(found, r)), seen);
            if (has_ended)
                return true;
        } else if (quadtree.faces == 1u) {
            note_outside(r, t, min(t_last, NEAREST(found, r)), seen);
        }
    }
    return false;
}

view_walk begin_view_walk()
{
    return view_walk(1e30, 0u, false, 0u, ivec2(-1));
}

void count(view_walk seen, bool is_unknown)
{
    atomicAdd(counts_of_kinds[ray_kind].rays, 1u);
    if (seen.layers > 1u)
        atomicAdd(counts_of_kinds[ray_kind].behind_first, 1u);
    if (seen.layers > 2u)
        atomicAdd(counts_of_kinds[ray_kind].behind_second, 1u);
    if (is_unknown && seen.has_left)
        atomicAdd(counts_of_kinds[ray_kind].outside, 1u);
    else if (is_unknown)
        atomicAdd(counts_of_kinds[ray_kind].behind_last, 1u);
}

// ---- called by trace/wave.comp ----

#ifdef ANY_HIT

bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    view_walk seen = begin_view_walk();
    bool is_stopped = walk_view(r, seen, optical_depth);
    count(seen, !is_stopped && seen.t_unknown < r.t_max);
    return is_stopped;
}

#else

// What is unknown is filled with what the ray was last before: the background of what hides it (section 4.1).
void fill(view_walk seen, inout candidate best)
{
    uvec2 visible;
    if (seen.fill_texel.x < 0 || !visible_at(seen.fill_texel, seen.fill_slice, visible))
        return;
    best = candidate(seen.t_unknown, visible.y, visible.x - 1u, vec2(0.0));
    walk_flags |= (seen.fill_slice % quadtree.layers + 1u) << HIT_LAYER_SHIFT;
}

void trace_closest(trace_ray r, inout candidate best)
{
    view_walk seen = begin_view_walk();
    walk_flags = walk_steps = 0u;
    walk_view(r, seen, best);
    bool is_unknown = seen.t_unknown < best.distance;
    count(seen, is_unknown);
    if (is_unknown) {
        walk_flags |= HIT_UNKNOWN;
        if (best.primitive == HIT_NO_PRIMITIVE)
            fill(seen, best);
    }
#ifdef QUADTREE_COUNT_STEPS
    best = candidate(float(walk_steps), seen.layers, 0u, vec2(0.0));
#endif
}

#endif
