// SPDX-License-Identifier: MIT
// Where the rays of pinhole eyes meet the layers of a view (shared/eye_hit.h): what traverse.glsl finds, of rays that
// are made on the way from planes alone.
//
// Defines: SPREAD as common/sample_place.glsl has it; QUADTREE_DDA as traverse.glsl has it.
#include "shared/eye_hit.h"
#include "common/dispatch.glsl"
#include "common/sample_place.glsl"
#include "quadtree/eye.glsl"

layout(binding = IMAGE_HITS, rgba32f) writeonly uniform imageBuffer eye_hits;
layout(binding = UNIT_QUADTREE_NODES) uniform usamplerBuffer quadtree_nodes;
#ifndef QUADTREE_DDA
layout(binding = UNIT_QUADTREE_BEAMS) uniform samplerBuffer beams;
#endif
layout(std430, binding = BIND_QUADTREE_COUNTS) buffer count_block
{
    quadtree_counts counts_of_kinds[QUADTREE_KINDS];
    uint outcomes[QUADTREE_OUTCOMES];
};

uniform uint first_slot, first_item, end_item;

#ifdef QUADTREE_DDA
const int START = 0;
#else
const int START = QUADTREE_TOP;
#endif
const float NEVER = -1.0; // of a w: behind all that a ray may meet

// A ray on its way through a layer, from greater w to lesser.
struct eye_walk {
    eye_line line;
    float w, w_end;
    int level; // of the first node
    bool is_before;
    float w_met; // where it meets a plane
    float w_behind; // where it came behind the layer for more than a texel
    float w_fill; // where it was last before the first layer that it came behind
    uint fill_layer;
};

void walk_layer(uint layer, inout eye_walk walk)
{
    eye_line line = walk.line;
    vec2 along = mix(line.along, vec2(1e-9), lessThan(abs(line.along), vec2(1e-9))), inverse = 1.0 / along;
    ivec2 forward = ivec2(lessThan(along, vec2(0.0))), padded = ivec2(quadtree.padded_width, quadtree.padded_height);
    float w = walk.w, w_end = walk.w_end, w_since = NEVER, w_before = walk.is_before ? w : NEVER;
    bool is_before = walk.is_before, is_met = false;
    int level = walk.level, first = int(layer * quadtree.slice_nodes);
    ivec2 cell = clamp(ivec2(floor(line.far + w * along)), ivec2(0), padded - 1) >> level;
    walk.w_met = walk.w_behind = NEVER;
    while (w > w_end && !is_met) {
        uvec2 node = texelFetch(quadtree_nodes, first + int(node_index(0u, uint(level), uvec2(cell)))).xy;
        vec2 exits = (vec2((cell + forward) << level) - line.far) * inverse;
        float w_out = clamp(max(exits.x, exits.y), w_end, w);
        bool is_plane = node_is_plane(node);
        vec2 slopes = plane_slopes(node), range = box_range(node);
        float height = plane_w(node) + dot(slopes, line.far - node_centre(uint(level), uvec2(cell)));
        float growth = dot(slopes, along) - 1.0;
        float gap = w_out > range.x ? -1.0 : w < range.y ? range.y - w : 0.0; // of a box; 0: in it
        float gap_in = is_plane ? height + growth * w : gap, gap_out = is_plane ? height + growth * w_out : gap;
        bool goes_down = !is_plane && gap == 0.0, passes = (gap_in > 0.0) != (gap_out > 0.0);
        // Or between two planes that do not quite meet.
        is_met = is_plane && (passes || is_before && gap_in > 0.0 &&
                                            gap_in <= QUADTREE_EDGE_SHARE * plane_w(node) + quadtree.bounds.x);
        walk.w_met = is_met ? (passes ? mix(w, w_out, clamp(gap_in / (gap_in - gap_out), 0.0, 1.0)) : w) : NEVER;

        if (!goes_down) {
            is_before = gap_out <= 0.0;
            w_before = is_before ? mix(w, w_out, 0.99) : w_before;
            w_since = is_before ? NEVER : max(w_since, w);
            vec2 way = abs(along) * (w_since - w_out);
            bool stays = !is_met && !is_before &&
                         (gap_out > QUADTREE_DEEP * w_out || max(way.x, way.y) > QUADTREE_OWN_WAY);
            if (stays && w_since > walk.w_behind) {
                walk.w_behind = w_since;
                if (walk.w_fill == NEVER && w_before != NEVER) {
                    walk.w_fill = w_before;
                    walk.fill_layer = layer;
                }
            }
        }

#ifdef QUADTREE_DDA
        goes_down = false;
#endif
        ivec2 low = cell * 2, step_ = exits.x > exits.y ? ivec2(2 * forward.x - 1, 0) : ivec2(0, 2 * forward.y - 1);
        ivec2 next = cell + step_;
        bool is_out = any(lessThan(next, ivec2(0))) || any(greaterThanEqual(next << level, padded));
#ifdef QUADTREE_DDA
        int up = 0;
#else
        int up = min(findMSB((cell.x ^ next.x) | (cell.y ^ next.y)), QUADTREE_TOP - level);
#endif
        ivec2 below = clamp(ivec2(floor(line.far + w * along)) >> max(level - 1, 0), low, low + 1);
        cell = goes_down ? below : next >> up;
        level += goes_down ? -1 : up;
        w = goes_down ? w : is_out ? w_end : w_out;
    }
}

// The texel of a sample; `code`: what is counted of it.
vec4 look(eye_line line, vec2 start, out uint code)
{
    vec2 size = vec2(quadtree.width, quadtree.height);
    vec2 along = mix(line.along, vec2(1e-9), lessThan(abs(line.along), vec2(1e-9)));
    vec2 a = -line.far / along, b = (size - line.far) / along, near_sides = max(a, b), far_sides = min(a, b);
    float w_enters = min(line.w_near, min(near_sides.x, near_sides.y));
    float w_side = max(far_sides.x, far_sides.y), w_leaves = max(line.w_last, w_side);
    bool is_seen = w_enters > w_leaves;
    eye_walk walk;
    walk.line = line;
    walk.w = min(w_enters, start.x);
    walk.w_end = is_seen ? w_leaves : 1e30;
    int bits = int(start.y);
    walk.level = bits & QUADTREE_BEAM_LEVEL;
    walk.is_before = (bits & QUADTREE_BEAM_INSIDE) != 0;
    walk.w_fill = NEVER;
    walk.fill_layer = 0u;
    float w_hit = NEVER, w_unknown = NEVER, w_first = walk.w;
    uint hit_layer = 0u, layers = 1u;
    bool has_left = false, goes_on = true;
    for (uint layer = 0u; layer < quadtree.layers && goes_on; layer++) {
        layers = layer + 1u;
        walk_layer(layer, walk);
        // A ray that comes into the view behind what is seen has passed that beside the view.
        has_left = has_left || layer == 0u && walk.w_behind == w_first && w_first < line.w_near;
        if (walk.w_met > walk.w_end) {
            walk.w_end = w_hit = walk.w_met;
            hit_layer = layer;
        }
        goes_on = walk.w_behind > walk.w_end;
        w_unknown = goes_on ? walk.w_behind : NEVER;
        walk.w = walk.w_behind;
        walk.level = START;
        walk.is_before = false;
    }
    bool is_outside = !is_seen || w_hit == NEVER && w_side > line.w_last;
    has_left = has_left || is_outside && w_unknown == NEVER;
    bool is_unknown = has_left || w_unknown > w_hit;
    bool is_filled = w_hit == NEVER && !has_left && walk.w_fill != NEVER;
    float w = is_filled ? walk.w_fill : w_hit;
    uint layer = is_filled ? walk.fill_layer : hit_layer;
    code = layers - 1u + (is_unknown ? has_left ? QUADTREE_OUTSIDE : QUADTREE_BEHIND : 0u);
    return vec4(line.far + w * along, w / quadtree.depths.x,
                float((w == NEVER ? 0u : (layer + 1u) * EYE_LAYER) + (is_unknown ? EYE_UNKNOWN : 0u)));
}

void main()
{
    uint k = first_item + item_index();
    if (k >= end_item)
        return;
    uint slot = first_slot + (k >> frame.sample_shift);
    uvec2 pixel = pixel_of_slot(slot);
    uint code = QUADTREE_DEAD;
    vec4 found = vec4(0.0, 0.0, 0.0, float(EYE_DEAD));
#ifdef QUADTREE_DDA
    vec2 start = vec2(uintBitsToFloat(texelFetch(quadtree_nodes, int(face_index(0u))).x), 0.0);
#else
    vec2 start = texelFetch(beams, int((slot >> 6) - (first_slot >> 6))).xy;
#endif
    if (pixel.x < frame.width && pixel.y < frame.height)
        found = look(line_through(eye_of(view_of_pixel(pixel)),
                                  place_of_sample(pixel_in_view(pixel), k & (1u << frame.sample_shift) - 1u)),
                     start, code);
    imageStore(eye_hits, int(k), found);
    if (code != 0u)
        atomicAdd(outcomes[code], 1u);
}
