// SPDX-License-Identifier: MIT
// Finds where the rays of pinhole eyes meet the layers of a view (shared/eye_hit.h): the answers of traverse.glsl, for
// rays that are made on the fly, from planes alone.
//
// Defines: SPREAD of common/sample_place.glsl; QUADTREE_LAYERS the number of layers of the face.
#include "shared/eye_hit.h"
#include "common/dispatch.glsl"
#include "common/sample_place.glsl"
#include "quadtree/eye.glsl"

layout(binding = IMAGE_HITS, rgba32f) writeonly uniform imageBuffer eye_hits;
layout(binding = UNIT_QUADTREE_NODES) uniform usamplerBuffer quadtree_nodes;
layout(binding = UNIT_QUADTREE_BEAMS) uniform samplerBuffer beams;
layout(std430, binding = BIND_QUADTREE_COUNTS) buffer count_block
{
    quadtree_counts counts_of_kinds[QUADTREE_KINDS];
    uint outcomes[QUADTREE_OUTCOMES];
};

uniform uint first_slot, first_item, end_item;

const int START = QUADTREE_TOP;
const float NEVER = -1.0; // w behind everything that a ray may meet

// March of a ray through a layer, from greater to smaller w.
struct eye_march {
    vec2 far, along, inverse; // places on it are far + w * along
    float w, w_end;
    int level; // level of the first node
    bool is_before;
    float w_met; // w where it meets a plane
    float w_behind; // w where it first came behind the layer for more than a texel
    float w_fill; // w where it was last before the first layer that it came behind
    uint fill_layer;
    bool ends_behind; // the end is behind the first layer
};

void trace_layer(uint layer, inout eye_march march)
{
    vec2 far = march.far, along = march.along;
    ivec2 forward = ivec2(lessThan(along, vec2(0.0))), padded = ivec2(quadtree.padded_width, quadtree.padded_height);
    float w = march.w, w_end = march.w_end, w_since = NEVER, w_before = march.is_before ? w : NEVER;
    bool is_before = march.is_before;
    int level = march.level, first = int(layer * quadtree.slice_nodes);
    ivec2 cell = clamp(ivec2(floor(far + w * along)), ivec2(0), padded - 1) >> level;
    march.w_met = march.w_behind = NEVER;
    // Lanes in lockstep execute a loop that begins with its condition once more for the last of them. This loop has two
    // exits, which assign w_met differently: with a single one at the end, lanes that had finished earlier had wrong
    // values after the loop (Mesa's llvmpipe 22.3).
    while (true) {
        bool is_on_way = w > w_end;
        uvec2 node = texelFetch(quadtree_nodes, first + int(node_index(0u, uint(level), uvec2(cell)))).xy;
        vec2 exits = (vec2((cell + forward) << level) - far) * march.inverse;
        float w_out = clamp(max(exits.x, exits.y), w_end, w);
        bool is_plane = node_is_plane(node);
        vec2 slopes = plane_slopes(node), range = box_range(node);
        float height = plane_w(node) + dot(slopes, far - node_centre(uint(level), uvec2(cell)));
        float growth = dot(slopes, along) - 1.0;
        float gap = w_out > range.x ? -1.0 : w < range.y ? range.y - w : 0.0; // distance to a box; 0: in it
        float gap_in = is_plane ? height + growth * w : gap, gap_out = is_plane ? height + growth * w_out : gap;
        bool goes_down = !is_plane && gap == 0.0, passes = (gap_in > 0.0) != (gap_out > 0.0);
        // The ray may also pass between two planes that do not quite meet.
        bool is_met = is_on_way && is_plane && (passes || is_before && gap_in > 0.0 &&
                                            gap_in <= QUADTREE_EDGE_SHARE * plane_w(node) + quadtree.bounds.x);
        if (is_met) {
            march.w_met = passes ? mix(w, w_out, clamp(gap_in / (gap_in - gap_out), 0.0, 1.0)) : w;
            break;
        }

        if (!goes_down) {
            is_before = gap_out <= 0.0;
            w_before = is_before ? mix(w, w_out, 0.99) : w_before;
            w_since = is_before ? NEVER : max(w_since, w);
            if (is_on_way && layer == 0u)
                march.ends_behind = !is_before;
            vec2 way = abs(along) * (w_since - w_out);
            bool stays = is_on_way && !is_before &&
                         (gap_out > QUADTREE_DEEP * w_out || max(way.x, way.y) > QUADTREE_OWN_WAY);
            if (stays && w_since > march.w_behind) {
                march.w_behind = w_since;
                if (march.w_fill == NEVER && w_before != NEVER) {
                    march.w_fill = w_before;
                    march.fill_layer = layer;
                }
            }
        }

        ivec2 low = cell * 2, step_ = exits.x > exits.y ? ivec2(2 * forward.x - 1, 0) : ivec2(0, 2 * forward.y - 1);
        ivec2 next = cell + step_;
        bool is_out = any(lessThan(next, ivec2(0))) || any(greaterThanEqual(next << level, padded));
        int up = min(findMSB((cell.x ^ next.x) | (cell.y ^ next.y)), QUADTREE_TOP - level);
        ivec2 below = clamp(ivec2(floor(far + w * along)) >> max(level - 1, 0), low, low + 1);
        cell = goes_down ? below : next >> up;
        level += goes_down ? -1 : up;
        w = goes_down ? w : is_out ? w_end : w_out;
        if (!(w > w_end))
            break;
    }
}

// Whether everything before the view counts as empty, by the rule of traverse.glsl: where the ray enters near the view's
// eye, or through the near plane.
bool is_free_before(eye_march march, float w_enters, float w_begins)
{
    if (w_enters >= w_begins)
        return true;
    vec2 place = (march.far + w_enters * march.along - quadtree.scale_centre.zw) / quadtree.scale_centre.xy;
    return length(vec3(place, 1.0)) <= QUADTREE_FREE_RADII * quadtree.bounds.w * w_enters;
}

// Texel of a sample. `beam`: that of its tile; `code`: the count that it adds to.
vec4 trace_sample(vec3 eye, vec2 place, vec4 beam, out uint code)
{
    eye_line line = line_of(eye, direction_through(place));
    float w_last = quadtree.depths.x / max(eye.z + beam.z * line.cosine, quadtree.depths.w);
    eye_march march;
    march.far = line.far;
    march.along = mix(line.along, vec2(1e-9), lessThan(abs(line.along), vec2(1e-9)));
    march.inverse = 1.0 / march.along;
    vec2 a = -line.far * march.inverse, b = (vec2(quadtree.width, quadtree.height) - line.far) * march.inverse;
    vec2 near_sides = max(a, b), far_sides = min(a, b);
    float w_enters = min(near_sides.x, near_sides.y), w_leaves = max(far_sides.x, far_sides.y);
    march.w = min(w_enters, beam.x);
    march.w_end = max(w_leaves, w_last);
    int bits = int(beam.y);
    march.level = bits & QUADTREE_BEAM_LEVEL;
    march.is_before = (bits & QUADTREE_BEAM_INSIDE) != 0;
    march.w_fill = NEVER;
    march.fill_layer = 0u;
    march.ends_behind = false;
    float w_leaves_or_ends = march.w_end;
    float w_hit = NEVER, w_unknown = NEVER, w_first = march.w;
    uint hit_layer = 0u, layers = 1u;
    bool has_left = false, continues = true;
    for (uint layer = 0u; layer < QUADTREE_LAYERS && continues; layer++) {
        layers = layer + 1u;
        trace_layer(layer, march);
        // A ray that enters the view behind the first surface has passed that beside the view.
        has_left = has_left || layer == 0u && march.w_behind == w_first && w_enters < beam.x;
        if (march.w_met > march.w_end) {
            march.w_end = w_hit = march.w_met;
            hit_layer = layer;
        }
        continues = march.w_behind > march.w_end;
        w_unknown = continues ? march.w_behind : NEVER;
        march.w = march.w_behind;
        march.level = START;
        march.is_before = false;
    }
    bool is_outside = w_hit == NEVER && (w_leaves > w_last || w_enters <= w_last);
    bool is_filled = w_hit == NEVER && w_unknown != NEVER && !has_left && march.ends_behind;
    bool is_free = is_free_before(march, w_enters, quadtree.depths.x / max(eye.z, quadtree.depths.w));
    has_left = has_left || !is_free || is_outside && w_unknown == NEVER;
    bool is_unknown = has_left || w_unknown > w_hit;
    float w_fill = march.w_fill != NEVER ? march.w_fill : mix(w_first, w_leaves_or_ends, QUADTREE_ALMOST_END);
    float w = is_filled ? w_fill : w_hit;
    uint layer = is_filled ? march.fill_layer : hit_layer;
    code = layers - 1u + (is_unknown ? has_left ? QUADTREE_OUTSIDE : QUADTREE_BEHIND : 0u);
    return vec4(march.far + w * march.along, w * (1.0 / quadtree.depths.x),
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
    if (pixel.x < frame.width && pixel.y < frame.height) {
        vec2 place = place_of_sample(pixel_in_view(pixel), k & (1u << frame.sample_shift) - 1u);
        vec4 beam = texelFetch(beams, int((slot >> 6) - (first_slot >> 6)));
        found = trace_sample(eye_of(view_of_pixel(pixel)), place, beam, code);
    }
    imageStore(eye_hits, int(k), found);
    if (code != 0u)
        atomicAdd(outcomes[code], 1u);
}
