// SPDX-License-Identifier: MIT
// Traversal of the visible surfaces of a view (quadtree/layout.h). Widmer, Pajak, Schulz, Pulli, Kautz, Goesele, Luebke.
// An Adaptive Acceleration Structure for Screen-space Ray Tracing. 2015, section 4.
//
// A ray is traced through the first layer of a face. Where it is behind that layer, the next one holds what it may hit,
// and only there is it traced through that one. Behind the last layer, nothing is known.
//
// Defines: QUADTREE_PLANES a hit is where the ray meets a node's plane, else where it meets the primitive;
// QUADTREE_VIEW there is one face.
#define INTERSECTION_FLAGS march_flags

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

const float SAME_DISTANCE = 1e-5; // maximum difference between intersections with one surface, as a share
const float FLOAT_MAX = 3.4e38;
const float NEVER = 2.0; // beyond the end of a segment
const float BRUSHES = 6.0; // texels: maximum distance at which a surface is met from the place where it is seen
const int LEVEL_AT_SURFACES = 2; // level of the node that rays begin in beside a surface
const int STEPS_TOGETHER = 256; // steps of neighbouring rays before their findings are tested
const int MEETINGS_MAX = 1 << 20;
const int LAYERS_MAX = 32; // more than all faces have

// March of a ray through a layer of a face.
struct layer_march {
    face_segment s;
    vec3 origin;  // x, y, w of the ray's origin; w below 0: it is not in this face
    vec2 inverse; // inverse of s.along.xy
    uint face, layer;
    float u, u_end; // place of the ray, and its end as far as known
    ivec2 cell;     // place of the current node
    int level;
    bool is_before, is_behind; // neither: the march has just begun
    bool was_close;            // the ray was close to the last plane
    bool hits_alone;           // only hits count for it: not where it is behind the layer and meets nothing
    float u_before;            // last place before the layer
    float u_since;             // beginning of its way behind the layer; NEVER: it is before it
    float u_behind;            // place where it was first behind the layer for more than a texel
    float u_last;              // last place behind the layer, or where it came before it
    float u_fill;              // last place before the first layer that it came behind, and so before the background
    uint fill_layer;           // number of that layer
    float u_beside;            // last place where it met a plane at an edge, but none of the primitives there
    vec2 offered;              // distances of the last two intersections, neither of which counts twice
};

// Passage of a ray through a node.
struct node_passage {
    uvec2 node;
    bool is_plane;
    float u_out, w_out;
    float gap_in, gap_out; // distance of the surface before the ray, in w: above 0 the ray is behind it
    bool skips_gaps; // box: a ray behind all its surfaces passes it, though somewhere it is before nothing
    float reach; // plane: a ray farther from it than this meets nothing of the surface within a texel
};

uint march_flags = 0u;

uint slice_of(layer_march march)
{
    return FACE(march.face) * quadtree.layers + march.layer;
}

// ---- hits ----

bool is_met_before(layer_march march, float distance_)
{
    vec2 apart = abs(march.offered - distance_);
    return min(apart.x, apart.y) <= SAME_DISTANCE * abs(distance_);
}

// Whether the distance is in this face: what the ray meets elsewhere counts there.
bool is_in_face(layer_march march, float distance_)
{
    float slack = SAME_DISTANCE * abs(distance_);
    return distance_ >= march.s.t_from - slack && distance_ <= march.s.t_to + slack;
}

// Offers a hit. True: the ray ends there.
bool offer(trace_ray r, candidate met, inout layer_march march, inout found_type found)
{
#ifdef ANY_HIT
    if (is_met_before(march, met.distance) || !is_in_face(march, met.distance))
        return false;
    march.offered = vec2(met.distance, march.offered.x);
    return offer_any(r, met, found);
#else
    float before = found.distance;
    offer_closest(r, met, found);
    if (found.distance >= before)
        return false;
    march_flags = (march.layer + 1u) << HIT_LAYER_SHIFT;
    return false; // the march ends where the ray now does
#endif
}

// Gets the primitive that a texel shows. False: none that is a hit of its own.
bool visible_at(ivec2 texel, uint slice, out uvec2 visible)
{
    ivec2 last = ivec2(quadtree.width, quadtree.height) - 1;
    visible = texelFetch(quadtree_visible, ivec3(clamp(texel, ivec2(0), last), int(slice)), 0).xy;
    return visible.x != VISIBLE_NOTHING && visible.x != VISIBLE_DISC;
}

// Intersects the visible primitive; for a sphere at the root that is nearer to `near`.
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

// Offers the primitives of the texel and of those beside it on the side of the place; the first one that is met is enough
// where surfaces continue from texel to texel. True: the ray ends.
bool offer_primitives(trace_ray r, vec2 place, float near, bool all_four, inout layer_march march, inout found_type found,
                      out bool has_met)
{
    ivec2 texel = ivec2(floor(place)), towards = ivec2(greaterThan(fract(place), vec2(0.5))) * 2 - 1;
    uint slice = slice_of(march), left = 0u;
    uvec2 a, b, c, d;
    left |= visible_at(texel, slice, a) ? 1u : 0u;
    left |= visible_at(texel + ivec2(towards.x, 0), slice, b) && b != a ? 2u : 0u;
    left |= visible_at(texel + ivec2(0, towards.y), slice, c) && c != a && c != b ? 4u : 0u;
    left |= visible_at(texel + towards, slice, d) && d != a && d != b && d != c ? 8u : 0u;
    has_met = false;
    bool ends = false;
    // The loop runs for as many turns as the neighbouring ray with the most attempts needs.
    for (int i = 0; i < 4; i++) {
        uint first = left & -left;
        uvec2 visible = first == 1u ? a : first == 2u ? b : first == 4u ? c : d;
        candidate met;
        if (left != 0u && intersect_visible(r, visible, near, met) && met.distance > r.t_min) {
            has_met = true;
            ends = offer(r, met, march, found) || ends;
        }
        left ^= first;
        if (left == 0u || has_met && !all_four)
            break;
    }
    return ends;
}

// Whether a plane through a neighbour of the surface that the ray begins on passes beside its origin, which is no hit.
bool is_own_surface(layer_march march, vec3 place, vec2 slopes)
{
    vec3 away = abs(place - march.origin);
    return march.origin.z >= 0.0 && max(away.x, away.y) < QUADTREE_OWN_WAY &&
           away.z <= QUADTREE_OWN_WAY * (abs(slopes.x) + abs(slopes.y)) + QUADTREE_EDGE_SHARE * place.z;
}

// True where the ray's w passes from before the node to behind it, or back.
bool is_met(node_passage p)
{
    return p.is_plane && (p.gap_in > 0.0) != (p.gap_out > 0.0);
}

// Meets the surface in a node: its plane, or primitives beside the edge that it passes. True: the ray ends. There is a
// single call of offer_primitives(), as neighbouring rays execute every call.
bool meet_in(trace_ray r, node_passage p, inout layer_march march, inout found_type found)
{
    bool passes = is_met(p);
    // The ray may also pass between two planes that do not quite meet.
    bool meets = passes || march.is_before && p.gap_in <= QUADTREE_EDGE_SHARE * plane_w(p.node) + quadtree.bounds.x;
    float u = passes ? mix(march.u, p.u_out, clamp(p.gap_in / (p.gap_in - p.gap_out), 0.0, 1.0)) : march.u;
    vec3 place = march.s.from + u * march.s.along;
    float near = distance_at(march.s, u);
#ifndef QUADTREE_PLANES
    // Within a texel of an edge the texel's middle sees the other side.
    bool is_at_edge = plane_is_at_edge(p.node), has_met;
    if (offer_primitives(r, place.xy, near, is_at_edge || !meets, march, found, has_met))
        return true;
    if (has_met)
        return false;
#endif
    uvec2 visible;
    if (!meets || is_own_surface(march, place, plane_slopes(p.node)) ||
        !visible_at(ivec2(floor(place.xy)), slice_of(march), visible))
        return false;
#ifndef QUADTREE_PLANES
    // The ray passed the edge of the surface, or primitives finer than texels.
    if (is_at_edge) {
        march.u_beside = u;
        return false;
    }
#endif
    return offer(r, candidate(near, visible.y, visible.x - 1u, vec2(0.0)), march, found);
}

// ---- march through a layer ----

// Begins a layer at `level` and below: rays that begin at a surface must descend to it.
void begin_layer(uint layer, float u, int level, inout layer_march march)
{
    ivec2 last = ivec2(quadtree.padded_width, quadtree.padded_height) - 1;
    march.level = level;
    march.layer = layer;
    march.u = u;
    march.cell = clamp(ivec2(floor(march.s.from.xy + march.s.along.xy * u)), ivec2(0), last) >> march.level;
    march.is_before = march.is_behind = march.was_close = false;
    march.u_last = 0.0;
    march.u_before = march.u_since = march.u_behind = march.u_beside = NEVER;
}

vec2 exits_of(layer_march march)
{
    ivec2 forward = ivec2(greaterThan(march.inverse, vec2(0.0)));
    return (vec2((march.cell + forward) << march.level) - march.s.from.xy) * march.inverse;
}

node_passage passage_of(layer_march march)
{
    node_passage p;
    p.node = texelFetch(quadtree_nodes, int(node_index(slice_of(march), uint(march.level), uvec2(march.cell)))).xy;
    p.is_plane = node_is_plane(p.node);
    vec2 exits = exits_of(march);
    p.u_out = clamp(min(exits.x, exits.y), march.u, march.u_end);
    float w_in = march.s.from.z + march.s.along.z * march.u;
    p.w_out = march.s.from.z + march.s.along.z * p.u_out;
    vec2 slopes = plane_slopes(p.node), centre = node_centre(uint(march.level), uvec2(march.cell));
    float w = plane_w(p.node) + dot(slopes, march.s.from.xy - centre), growth = dot(slopes, march.s.along.xy);
    // Just behind a surface the question is open: the next texels say whether the ray stays there or has passed its edge.
    bool is_undecided = march.was_close || march.u_since < march.u_behind;
    p.skips_gaps = march.hits_alone && !is_undecided && !p.is_plane && box_has_gaps(p.node);
    vec2 range = p.skips_gaps ? box_range_of_surfaces(p.node) : box_range(p.node);
    vec2 of_ray = vec2(min(w_in, p.w_out), max(w_in, p.w_out));
    // Distance to a box; 0: in it.
    float gap = of_ray.x > range.x ? -1.0 : of_ray.y < range.y ? range.y - of_ray.y : 0.0;
    p.gap_in = p.is_plane ? w + growth * march.u - w_in : gap;
    p.gap_out = p.is_plane ? w + growth * p.u_out - p.w_out : gap;
    float steepness = abs(slopes.x) + abs(slopes.y);
    p.reach = BRUSHES * steepness + QUADTREE_EDGE_SHARE * plane_w(p.node) + quadtree.bounds.x;
    if (steepness == 0.0 && plane_w(p.node) > 0.0) // seen on edge: its slopes are unknown
        p.reach = FLOAT_MAX;
    if (!p.is_plane)
        p.reach = 0.0;
    return p;
}

void go_down(inout layer_march march)
{
    march.level--;
    ivec2 low = march.cell * 2;
    march.cell = clamp(ivec2(floor(march.s.from.xy + march.s.along.xy * march.u)) >> march.level, low, low + 1);
}

// Notes on which side the ray is. A ray behind a plane's extension beyond the surface comes before its neighbour's within
// a texel: it counts as behind the layer where it stays so.
void note_side(node_passage p, inout layer_march march)
{
    march.is_before = p.gap_out <= 0.0;
    march.is_behind = !march.is_before && !p.skips_gaps;
    march.was_close = abs(p.gap_out) <= p.reach;
    march.u_last = max(p.gap_in, p.gap_out) > 0.0 ? p.u_out : march.u_last;
    if (march.is_before) {
        march.u_before = mix(march.u, p.u_out, 0.99);
        march.u_since = NEVER;
        return;
    }
    float u_in = p.gap_in > 0.0 ? march.u : mix(march.u, p.u_out, clamp(p.gap_in / (p.gap_in - p.gap_out), 0.0, 1.0));
    march.u_since = min(march.u_since, u_in);
    vec2 way = abs(march.s.along.xy) * (p.u_out - march.u_since);
    bool stays = p.gap_out > QUADTREE_DEEP * p.w_out || max(way.x, way.y) > QUADTREE_OWN_WAY;
    if (stays && march.u_since < march.u_behind) {
        march.u_behind = march.u_since;
        if (march.u_before != NEVER && march.u_fill == NEVER) {
            march.u_fill = march.u_before;
            march.fill_layer = march.layer;
        }
    }
}

// Moves to the successor across the side at which the ray leaves the node, one level below the last node that contains
// both.
void leave(node_passage p, inout layer_march march)
{
    ivec2 size = ivec2(quadtree.padded_width, quadtree.padded_height), next = march.cell;
    vec2 exits = exits_of(march);
    if (exits.x < exits.y)
        next.x += march.inverse.x > 0.0 ? 1 : -1;
    else
        next.y += march.inverse.y > 0.0 ? 1 : -1;
    march.u = p.u_out;
    if (any(lessThan(next, ivec2(0))) || any(greaterThanEqual(next << march.level, size)))
        march.u = march.u_end;
    int up = min(findMSB((march.cell.x ^ next.x) | (march.cell.y ^ next.y)), QUADTREE_TOP - march.level);
    march.level += up;
    march.cell = next >> up;
}

// Passes nodes until the ray may meet something in one of them: true. The loop ends with two exits: with one, software GL
// gave rays that had finished earlier the values of their neighbours.
bool pass_nodes(inout layer_march march, out node_passage p)
{
    bool meets = false;
    for (int i = 0; i < STEPS_TOGETHER; i++) {
        p = passage_of(march);
        bool goes_down = !p.is_plane && p.gap_in == 0.0;
        bool is_other_side = p.gap_in > 0.0 ? !march.is_behind : !march.is_before;
        // Most rays that pass an edge are far behind or before both of its sides: fewer than one in ten of them meets
        // either.
        bool is_close = march.was_close || abs(p.gap_in) <= p.reach;
        // A ray that begins before a continuous surface, and moves away from it, meets none of it.
        bool moves_away = !(march.is_before || march.is_behind) && p.gap_out <= p.gap_in && p.gap_in <= 0.0 &&
                          !plane_is_at_edge(p.node);
        meets = p.is_plane && (is_met(p) || is_other_side && is_close && !moves_away);
        if (meets)
            break;
        if (goes_down) {
            go_down(march);
        } else {
            note_side(p, march);
            leave(p, march);
        }
        if (!(march.u < march.u_end))
            break;
    }
    return meets;
}

// ---- faces ----

// State of a ray in all faces.
struct view_march {
    float t_last;    // maximum distance along the ray of anything visible
    float t_leaves;  // distance where it leaves the last face that it passes, or ends in it; -1: it passes none
    uint last_face;
    vec4 begins;     // distances where it enters those of the faces 0 to 3 that it has not been in yet; FLOAT_MAX: never
    vec2 begins_4_5; // and faces 4 and 5
    vec2 t_face;     // range of distances in the face, if there is one
    float t_unknown; // distance from which on nothing is known; 1e30: everything is
    uint layers;     // number of layers that it had to read
    bool has_left;   // unknown because the ray is outside the view
    bool ends_behind; // the ray ends behind the first layer
    bool is_filled;   // the values below fill the unknown part
    float t_fill;    // distance where it is assumed to meet a texel's surface
    uint fill_slice;
    ivec2 fill_texel; // the texel; x -1: the one where it leaves the face, or ends
};

// Whether a ray that enters the view at t has passed only visible, or empty, space. For a ray from an eye within the
// radius that is assumed, up to QUADTREE_FREE_RADII from the view's own eye, and before the near plane.
bool is_free_before(trace_ray r, float t)
{
    vec3 from_eye = r.origin - quadtree.eye_world.xyz, entry = from_eye + t * r.direction;
    float radius = quadtree.eye_world.w, z = dot(quadtree.face_from_world[2].xyz, entry);
    return length(from_eye) <= radius &&
           (length(entry) <= QUADTREE_FREE_RADII * radius || z <= quadtree.depths.w * (1.0 + SAME_DISTANCE));
}

// Notes that the ray leaves a view with one face, which sees nothing beside it.
void note_outside(trace_ray r, float t_end, inout view_march seen)
{
    if (!IS_VIEW)
        return;
    vec2 t = seen.t_face;
    float t_outside = !(t.x < t.y) || (t.x > r.t_min && !is_free_before(r, t.x)) ? r.t_min
                      : t.y < min(seen.t_last, t_end)            ? t.y
                                                                 : 1e30;
    if (t_outside < seen.t_unknown) {
        seen.t_unknown = t_outside;
        seen.has_left = true;
    }
}

// Maximum distance along a ray of anything visible: planes may lie beyond the surfaces by the bound.
float last_distance(trace_ray r)
{
    float far = quadtree.depths.y;
    if (is_orthographic())
        far += quadtree.bounds.x * (far - quadtree.depths.x);
    else
        far = 1.0 / max(1.0 / far - QUADTREE_PLANES_APART * quadtree.bounds.x / quadtree.depths.x,
                        1.0 / (QUADTREE_FARTHER_MAX * far));
    return (length(r.origin - quadtree.eye_world.xyz) + far) / length(r.direction);
}

#ifdef ANY_HIT
#define NEAREST(found, r) r.t_max
#define SHORTEN(march, found)
#else
#define NEAREST(found, r) found.distance
#define SHORTEN(march, found) march.u_end = min(march.u_end, place_at(march.s, found.distance))
#endif

// Whether neighbours of a primitive may lie between the middles of texels, unseen, as it is so narrow itself.
bool is_finer_than_texels(uint face, uvec2 visible)
{
#ifdef HAS_SPHERES
    if (geometry_at(instance_at(visible.x - 1u).geometry).kind == GEOMETRY_SPHERES)
        return false;
#endif
    vec4 rows[3] = instance_at(visible.x - 1u).world_from_object;
    uvec3 corners = texelFetch(triangles, int(visible.y)).xyz;
    vec2 places[3];
    for (int i = 0; i < 3; i++) {
        vec3 world = affine_point(rows, texelFetch(positions, int(corners[i])).xyz);
        vec3 p = face_vector(face, world - quadtree.eye_world.xyz);
        if (p.z < quadtree.depths.w)
            return false;
        places[i] = face_place(p, face_q(p)).xy;
    }
    vec2 a = places[1] - places[0], b = places[2] - places[0], c = b - a;
    float longest = sqrt(max(dot(a, a), max(dot(b, b), dot(c, c))));
    return abs(a.x * b.y - a.y * b.x) < QUADTREE_FINE * longest;
}

// Meets the layer that a ray stays behind, even where it passed between primitives finer than texels. True: the ray ends.
bool meet_beside(trace_ray r, inout layer_march march, inout found_type found)
{
    if (!(march.u_behind < march.u_end) || march.u_behind != march.u_beside)
        return false;
    uvec2 visible;
    vec2 place = march.s.from.xy + march.u_beside * march.s.along.xy;
    if (!visible_at(ivec2(floor(place)), slice_of(march), visible) || !is_finer_than_texels(march.face, visible))
        return false;
    march.u_behind = NEVER;
    return offer(r, candidate(distance_at(march.s, march.u_beside), visible.y, visible.x - 1u, vec2(0.0)), march, found);
}

// Maximum w of a face; 0: it sees nothing.
float nearest_w(uint face)
{
    return uintBitsToFloat(texelFetch(quadtree_nodes, int(face_index(FACE(face)))).x);
}

// Clips a range to where surfaces of the face may be: before the nearest one there is nothing.
void clip_to_surfaces(float w, vec3 origin, vec3 direction, inout vec2 t)
{
    float far = quadtree.depths.y, z = is_orthographic() ? far - w * (far - quadtree.depths.x) : quadtree.depths.x / w;
    clip_range(origin.z - z, direction.z, t);
}

// Finds where the ray enters each of the faces.
void begin_faces(trace_ray r, float t_end, inout view_march seen)
{
    vec3 from_eye = r.origin - quadtree.eye_world.xyz;
    vec2 t_ray = vec2(r.t_min, min(seen.t_last, t_end));
    for (uint face = 0u; face < FACES; face++) {
        float w = nearest_w(face);
        vec3 origin = face_vector(face, from_eye), direction = face_vector(face, r.direction);
        vec2 t = clip_to_face(origin, direction, t_ray);
        seen.t_face = t;
        clip_to_surfaces(w, origin, direction, t);
        bool passes = t.x < t.y && w > 0.0;
        seen.last_face = passes && t.y > seen.t_leaves ? face : seen.last_face;
        seen.t_leaves = passes ? max(seen.t_leaves, t.y) : seen.t_leaves;
        float begin = passes ? t.x : FLOAT_MAX;
        seen.begins = mix(seen.begins, vec4(begin), equal(uvec4(0u, 1u, 2u, 3u), uvec4(face)));
        seen.begins_4_5 = mix(seen.begins_4_5, vec2(begin), equal(uvec2(4u, 5u), uvec2(face)));
    }
}

// Next face of the ray, and where it enters; FLOAT_MAX: none.
float next_face(inout view_march seen, out uint face)
{
    float begin = seen.begins.x;
    face = 0u;
    for (uint i = 1u; i < FACES; i++) {
        float other = i < 4u ? seen.begins[i] : seen.begins_4_5[i - 4u];
        face = other < begin ? i : face;
        begin = min(begin, other);
    }
    seen.begins = mix(seen.begins, vec4(FLOAT_MAX), equal(uvec4(0u, 1u, 2u, 3u), uvec4(face)));
    seen.begins_4_5 = mix(seen.begins_4_5, vec2(FLOAT_MAX), equal(uvec2(4u, 5u), uvec2(face)));
    return begin;
}

// Begins the first layer of the next face that the ray passes. False: there is none before its end.
bool begin_face(trace_ray r, found_type found, inout layer_march march, inout view_march seen)
{
    float t_end = min(seen.t_last, NEAREST(found, r)), begin = FLOAT_MAX;
    vec3 from_eye = r.origin - quadtree.eye_world.xyz, origin, direction;
    vec2 t = vec2(1.0, 0.0);
    // A GPU may round a short way through a face to none: the next face follows.
    for (uint i = 0u; i < FACES; i++) {
        begin = next_face(seen, march.face);
        origin = face_vector(march.face, from_eye);
        direction = face_vector(march.face, r.direction);
        t = clip_to_face(origin, direction, vec2(r.t_min, t_end));
        clip_to_surfaces(nearest_w(march.face), origin, direction, t);
        if (t.x < t.y || !(begin < t_end))
            break;
    }
    march.s = segment_of(origin, direction, t);
    march.origin = origin.z >= quadtree.depths.w ? face_place(origin, face_q(origin)) : vec3(-1.0);
    vec2 along = march.s.along.xy;
    march.inverse = 1.0 / mix(along, vec2(1e-9), lessThan(abs(along), vec2(1e-9)));
    march.u_end = 1.0;
    march.u_fill = NEVER;
    march.fill_layer = 0u;
    begin_layer(0u, 0.0, march.s.t_from <= r.t_min ? LEVEL_AT_SURFACES : QUADTREE_TOP, march);
    return begin < t_end && t.x < t.y;
}

// Fills an unknown part with the surface that the ray was last before: the background of what hides it (section 4.1); if
// it was before none, with the hiding surface at its end.
void end_face(trace_ray r, layer_march march, inout found_type found, inout view_march seen)
{
    float t = distance_at(march.s, min(march.u_behind, 1.0));
    if (march.u_behind >= march.u_end || t >= seen.t_unknown)
        return;
    bool was_before = march.u_fill != NEVER;
    seen.t_unknown = t;
    seen.t_fill = was_before ? distance_at(march.s, march.u_fill) : t;
    seen.fill_slice = FACE(march.face) * quadtree.layers + march.fill_layer;
    seen.is_filled = true;
    seen.fill_texel = was_before ? ivec2(floor(march.s.from.xy + march.s.along.xy * march.u_fill)) : ivec2(-1);
}

// Begins the next layer where the ray is behind this one. False: the face is finished.
bool begin_next(trace_ray r, inout layer_march march, inout found_type found, inout view_march seen)
{
    // A ray that enters the view behind the first surface has passed that beside the view.
    if (IS_VIEW && march.layer == 0u && march.u_behind == 0.0 && march.s.t_from > r.t_min &&
        march.s.t_from < seen.t_unknown) {
        seen.t_unknown = march.s.t_from;
        seen.has_left = true;
    }
    if (march.u_behind < march.u_end && march.layer + 1u < quadtree.layers) {
        // A ray before this layer is also before all layers behind it. Their edges may be off by its own way.
        float own_way = QUADTREE_OWN_WAY * min(abs(march.inverse.x), abs(march.inverse.y));
        march.u_end = min(march.u_end, march.u_last + own_way);
        begin_layer(march.layer + 1u, march.u_behind, LEVEL_AT_SURFACES, march);
        seen.layers = max(seen.layers, march.layer + 1u);
        return true;
    }
    end_face(r, march, found, seen);
    return false;
}

// Whether the ray has a direction; otherwise it meets nothing.
bool is_ray(trace_ray r)
{
    return all(lessThan(abs(r.origin), vec3(FLOAT_MAX))) && all(lessThan(abs(r.direction), vec3(FLOAT_MAX))) &&
           r.direction != vec3(0.0);
}

// Traces through a layer. True: the ray ends in it.
bool trace_layer(trace_ray r, inout layer_march march, inout found_type found)
{
    node_passage p;
    bool ends = false;
    for (int i = 0; i < MEETINGS_MAX; i++) {
        if (pass_nodes(march, p)) {
            ends = meet_in(r, p, march, found);
            SHORTEN(march, found);
            if (march.u_end < p.u_out) {
                // The ray counts as behind also after a plane that it meets from the back: a node may be as large as
                // everything that it hides.
                march.u_last = p.gap_in > 0.0 ? march.u_end : march.u_last;
                march.u = march.u_end;
            } else {
                note_side(p, march);
                leave(p, march);
            }
        }
        if (ends || !(march.u < march.u_end))
            break;
    }
    return ends;
}

// Whether the end of the ray is behind the first layer.
bool ends_behind_first(trace_ray r, view_march seen)
{
    vec3 from_eye = r.origin - quadtree.eye_world.xyz;
    vec3 end = face_vector(seen.last_face, from_eye + seen.t_leaves * r.direction);
    vec3 place = face_place(end, face_q(end));
    uvec2 texel = uvec2(clamp(place.xy, vec2(0.0), vec2(quadtree.width, quadtree.height) - 1.0));
    uvec2 node = texelFetch(quadtree_nodes, int(node_index(FACE(seen.last_face) * quadtree.layers, 0u, texel))).xy;
    return seen.t_leaves >= 0.0 && plane_w(node) + dot(plane_slopes(node), place.xy - node_centre(0u, texel)) > place.z;
}

// Traces through a view. True: the ray ends early. Three loops are nested: software GL executes both sides of a branch
// for all neighbouring rays, so in a single loop each step would pay for work done once per layer.
bool trace_view(trace_ray r, inout view_march seen, inout found_type found)
{
    layer_march march;
    march.offered = vec2(-1.0);
    begin_faces(r, NEAREST(found, r), seen);
    seen.ends_behind = ends_behind_first(r, seen);
#ifdef ANY_HIT
    march.hits_alone = !seen.ends_behind;
#else
    march.hits_alone = false;
#endif
    bool ends = false, has_layer = false;
    for (int i = 0; i < LAYERS_MAX; i++) {
        if (!has_layer && !begin_face(r, found, march, seen))
            break;
        ends = trace_layer(r, march, found) || meet_beside(r, march, found);
        if (ends)
            break;
        has_layer = begin_next(r, march, found, seen);
    }
    return ends;
}

view_march begin_view_march(trace_ray r)
{
    return view_march(last_distance(r), -1.0, 0u, vec4(FLOAT_MAX), vec2(FLOAT_MAX), vec2(1.0, 0.0), 1e30, 1u, false,
                     false, false, 0.0, 0u, ivec2(-1));
}

void count(view_march seen, bool is_unknown)
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

// ---- interface to trace/wave.comp ----

#ifdef ANY_HIT

// Shadow rays through unknown space: those that come out again count as unobstructed, those that end behind the first
// layer as blocked.
bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    if (!is_ray(r))
        return false;
    view_march seen = begin_view_march(r);
    bool is_stopped = trace_view(r, seen, optical_depth);
    note_outside(r, r.t_max, seen);
    bool is_unknown = !is_stopped && seen.t_unknown < r.t_max;
    count(seen, is_unknown);
    return is_stopped || (is_unknown && seen.ends_behind);
}

#else

// Handles a ray that met nothing. If it came out again from behind the visible surfaces, it has left the scene, as far as
// is known.
void fill(trace_ray r, view_march seen, inout candidate best)
{
    uint face = seen.fill_slice / quadtree.layers;
    vec3 origin = face_vector(face, r.origin - quadtree.eye_world.xyz), direction = face_vector(face, r.direction);
    vec2 t = clip_to_face(origin, direction, vec2(r.t_min, min(seen.t_last, r.t_max)));
    face_segment s = segment_of(origin, direction, t);
    ivec2 last = ivec2(floor(s.from.xy + s.along.xy * QUADTREE_ALMOST_END));
    uvec2 visible;
    if (!seen.is_filled || !seen.ends_behind ||
        !visible_at(seen.fill_texel.x < 0 ? last : seen.fill_texel, seen.fill_slice, visible))
        return;
    best = candidate(seen.t_fill, visible.y, visible.x - 1u, vec2(0.0));
    march_flags |= (seen.fill_slice % quadtree.layers + 1u) << HIT_LAYER_SHIFT;
}

void trace_closest(trace_ray r, inout candidate best)
{
    if (!is_ray(r))
        return;
    view_march seen = begin_view_march(r);
    march_flags = 0u;
    trace_view(r, seen, best);
    note_outside(r, best.distance, seen);
    bool is_unknown = seen.t_unknown < best.distance;
    count(seen, is_unknown);
    if (is_unknown) {
        march_flags |= HIT_UNKNOWN;
        if (best.primitive == HIT_NO_PRIMITIVE)
            fill(r, seen, best);
    }
}

#endif
