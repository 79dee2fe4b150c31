// SPDX-License-Identifier: MIT
// Finds where the rays of a tile of an eye's pixels may first meet something: rays that skip everything before it visit a
// third of the nodes. Writes an RGBA32F texel per tile: the maximum w at which there may be something; the level of the
// node that rays begin in, and QUADTREE_BEAM_INSIDE; the distance along the rays before which there is nothing, metres;
// unused.
//
// The rays of a tile pass through a rectangle at each w. Between two of these rectangles lies what they may meet; the
// nodes there bring the two closer, and so on.
#include "common/dispatch.glsl"
#include "common/camera.glsl"
#include "quadtree/eye.glsl"

layout(binding = IMAGE_QUADTREE_BEAMS, rgba32f) writeonly uniform imageBuffer beams;
layout(binding = UNIT_QUADTREE_NODES) uniform usamplerBuffer quadtree_nodes;

uniform uint first_tile, tile_count;
uniform float eye_reach; // maximum distance of samples from the middles of their pixels, pixels
uniform float eye_near; // distance along the eye's view at which rays begin, metres
uniform float eye_far;  // distance from the face's eye beyond everything that it sees, metres

const int ROUNDS = 6;
const float ROUNDING = 1e-3; // a share of w, and a texel

struct beam {
    vec4 far;  // minimum and maximum of its rays
    vec3 eye;  // in units
    float w_near; // w at which rays begin, or come before the eye of the face
};

beam beam_through(uvec2 first, uvec2 last)
{
    uvec2 view = view_of_pixel(first);
    vec3 eye = eye_of(view);
    vec2 low = vec2(pixel_in_view(first)) + 0.5 - eye_reach, high = low + vec2(last - first) + 2.0 * eye_reach;
    float unit = quadtree.depths.x, near = quadtree.depths.w;
    beam b = beam(vec4(1e30, 1e30, -1e30, -1e30), eye / unit, 0.0);
    for (int i = 0; i < 4; i++) {
        vec3 direction = direction_through(vec2((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y));
        vec2 far = line_of(eye, direction).far;
        b.far = vec4(min(b.far.xy, far), max(b.far.zw, far));
        b.w_near = max(b.w_near, unit / max(eye.z + eye_near * direction.z, near));
    }
    return b;
}

// Minimum and maximum place of a beam's rays at w.
vec4 places_at(beam b, float w)
{
    vec4 middle = quadtree.scale_centre.zwzw;
    float shrinks = max(1.0 - w * b.eye.z, 0.0);
    return middle + (b.far - middle) * shrinks + w * b.eye.xyxy + ROUNDING * vec4(-1.0, -1.0, 1.0, 1.0);
}

// Maximum and minimum w of a node.
vec2 node_range(uint level, ivec2 place)
{
    uvec2 node = texelFetch(quadtree_nodes, int(node_index(0u, level, uvec2(place)))).xy;
    vec2 slopes = abs(plane_slopes(node));
    float side = 0.5 * float(1u << level) * (slopes.x + slopes.y) + QUADTREE_GROWTH_MAX * quadtree.bounds.x;
    return node_is_plane(node) ? plane_w(node) + vec2(-side, side) : box_range(node).yx;
}

void main()
{
    uint item = item_index(), tile = first_tile + item;
    if (item >= tile_count)
        return;
    uvec2 first = pixel_of_slot(tile << 6), last = first + 7u;
    ivec2 size = ivec2(quadtree.width, quadtree.height);
    beam b = beam_through(first, last);
    float w_greatest = min(b.w_near, uintBitsToFloat(texelFetch(quadtree_nodes, int(face_index(0u))).x)), w_least = 0.0;
    int level = QUADTREE_TOP;
    bool is_one_view = view_of_pixel(first) == view_of_pixel(last);
    for (int i = 0; i < ROUNDS && is_one_view; i++) {
        vec4 at_greatest = places_at(b, w_greatest), at_least = places_at(b, w_least);
        vec4 all_ = vec4(min(at_greatest.xy, at_least.xy), max(at_greatest.zw, at_least.zw));
        ivec4 texels = ivec4(clamp(floor(all_), vec4(0.0), vec4(size - 1, size - 1)));
        ivec2 apart = texels.zw - texels.xy;
        level = findMSB(max(max(apart.x, apart.y), 1)) + 1;
        if (level > QUADTREE_TOP) {
            level = QUADTREE_TOP + 1;
            break;
        }
        ivec4 corners = texels >> level;
        vec2 a = node_range(uint(level), corners.xy), c = node_range(uint(level), corners.zy);
        vec2 d = node_range(uint(level), corners.xw), e = node_range(uint(level), corners.zw);
        w_greatest = min(w_greatest, max(max(a.y, c.y), max(d.y, e.y)) * (1.0 + ROUNDING));
        // Rays that have left the view have met nothing.
        if (all(greaterThanEqual(all_.xy, vec2(0.0))) && all(lessThan(all_.zw, vec2(size))))
            w_least = max(w_least, min(min(a.x, c.x), min(d.x, e.x)) * (1.0 - ROUNDING));
        w_least = min(w_least, w_greatest);
    }
    vec4 start = places_at(b, w_greatest);
    bool is_inside = is_one_view && all(greaterThanEqual(start.xy, vec2(0.0))) && all(lessThan(start.zw, vec2(size)));
    // Slightly smaller nodes than the tile's extent are nearer to the surface than large ones, and read as fast.
    int begins = (is_one_view ? max(level - 2, 0) : QUADTREE_TOP) + (is_inside ? QUADTREE_BEAM_INSIDE : 0);
    vec3 eye = eye_of(view_of_pixel(first));
    float reach = length(vec3(eye.xy / quadtree.scale_centre.xy, eye.z)) + eye_far;
    imageStore(beams, int(item), vec4(w_greatest, float(begins), reach, 0.0));
}
