// SPDX-License-Identifier: MIT
// Makes a level of the quadtrees from the level below it (section 3.3 of the paper): four planes that agree, within the
// bound, become one; otherwise they become a box. An invocation makes a node.
//
// A plane's error is measured against the planes of the leaves, in all their corners, after it is rounded to the bits of
// a node. A level adds the distance between its plane and its children's to the children's maximum error, so that errors
// of several levels cannot exceed the bound. On a smooth surface, whose error grows fourfold from level to level, this
// sum exceeds the true error by at most a third.
//
// Defines:
//   NODES_OF_LEAVES   level 1 of one slice, from `planes`; and its leaves themselves, whose flags are found here
#include "common/dispatch.glsl"
#include "quadtree/node.glsl"

#ifdef NODES_OF_LEAVES
layout(binding = UNIT_QUADTREE_PLANES) uniform usamplerBuffer planes;
uniform uint slice;
#else
layout(binding = UNIT_QUADTREE_NODES) uniform usamplerBuffer nodes;
layout(binding = UNIT_QUADTREE_ERRORS) uniform samplerBuffer errors;
#endif
layout(binding = IMAGE_QUADTREE_NODES, rg32ui) writeonly uniform uimageBuffer made_nodes;
layout(binding = IMAGE_QUADTREE_ERRORS, r32f) writeonly uniform imageBuffer made_errors;

uniform uint level;
uniform uint first_item; // first item of the dispatch

const float FLOAT_MAX = 3.4e38;
// Share of w that rounding takes where a plane is made and evaluated.
const float ROUNDING = 2.384e-7; // 2^-22
// Half a step of half floats, or one if a device truncates, as a share of a slope; and for the smallest ones.
const float SLOPE_ROUNDING = 9.766e-4, SLOPE_STEP = 6.104e-5 / QUADTREE_SLOPE_SCALE; // 2^-10, 2^-14

// Nodes (0, 0), (1, 0), (0, 1), (1, 1): their words, and the maximum errors of planes.
struct children {
    uvec4 head, tail;
    vec4 error;
};

uint error_index(uint of_slice, uint of_level, uvec2 place)
{
    uint texels = quadtree.padded_width * quadtree.padded_height;
    return node_index(of_slice, of_level, place) - (of_slice + 1u) * texels;
}

#ifdef NODES_OF_LEAVES
uvec2 plane_at(ivec2 place)
{
    ivec2 last = ivec2(quadtree.width, quadtree.height) - 1;
    place = clamp(place, ivec2(0), last);
    return texelFetch(planes, place.y * int(quadtree.padded_width) + place.x).xy;
}

// Whether the planes of two leaves differ in the middle of their border; `along` leads from one to the other. The border
// of the face is no edge.
bool is_edge(uvec2 a, uvec2 b, vec2 along)
{
    float w_a = plane_w(a), w_b = plane_w(b);
    float difference = w_b - w_a - 0.5 * dot(plane_slopes(a) + plane_slopes(b), along);
    return abs(difference) > QUADTREE_EDGE_SHARE * max(w_a, w_b) + quadtree.bounds.x;
}

// Flag of a leaf; an empty one has none.
uint flag_of(uvec2 node, bool is_at_edge)
{
    return is_at_edge && plane_w(node) > 0.0 ? 1u : 0u;
}

void write_leaf(ivec2 place, uvec2 node)
{
    imageStore(made_nodes, int(node_index(slice, 0u, uvec2(place))), uvec4(node, 0u, 0u));
}

// Reads the children of a node, and writes them if they are leaves.
children children_of(uvec2 place)
{
    ivec2 first = 2 * ivec2(place);
    int at = first.y * int(quadtree.padded_width) + first.x;
    uvec2 a = texelFetch(planes, at).xy, b = texelFetch(planes, at + 1).xy;
    uvec2 c = texelFetch(planes, at + int(quadtree.padded_width)).xy;
    uvec2 d = texelFetch(planes, at + int(quadtree.padded_width) + 1).xy;
    const vec2 right = vec2(1.0, 0.0), down = vec2(0.0, 1.0);
    children four;
    // Nothing lies beyond the face, and its leaves have no flags, so any neighbour will do.
    bool inside_x = first.x + 1 < int(quadtree.width), inside_y = first.y + 1 < int(quadtree.height);
    bool ab = inside_x && is_edge(a, b, right), cd = inside_x && is_edge(c, d, right);
    bool ac = inside_y && is_edge(a, c, down), bd = inside_y && is_edge(b, d, down);
    bool left_a = first.x > 0 && is_edge(a, plane_at(first + ivec2(-1, 0)), -right);
    bool left_c = first.x > 0 && is_edge(c, plane_at(first + ivec2(-1, 1)), -right);
    bool right_b = first.x + 2 < int(quadtree.width) && is_edge(b, plane_at(first + ivec2(2, 0)), right);
    bool right_d = first.x + 2 < int(quadtree.width) && is_edge(d, plane_at(first + ivec2(2, 1)), right);
    bool above_a = first.y > 0 && is_edge(a, plane_at(first + ivec2(0, -1)), -down);
    bool above_b = first.y > 0 && is_edge(b, plane_at(first + ivec2(1, -1)), -down);
    bool below_c = first.y + 2 < int(quadtree.height) && is_edge(c, plane_at(first + ivec2(0, 2)), down);
    bool below_d = first.y + 2 < int(quadtree.height) && is_edge(d, plane_at(first + ivec2(1, 2)), down);
    a.x |= flag_of(a, ab || ac || left_a || above_a);
    b.x |= flag_of(b, ab || bd || right_b || above_b);
    c.x |= flag_of(c, ac || cd || left_c || below_c);
    d.x |= flag_of(d, bd || cd || right_d || below_d);
    write_leaf(first, a);
    write_leaf(first + ivec2(1, 0), b);
    write_leaf(first + ivec2(0, 1), c);
    write_leaf(first + ivec2(1, 1), d);
    four.head = uvec4(a.x, b.x, c.x, d.x);
    four.tail = uvec4(a.y, b.y, c.y, d.y);
    four.error = vec4(0.0);
    return four;
}
#else
children children_of(uint slice, uvec2 place)
{
    int at = int(node_index(slice, level - 1u, 2u * place)), row = int(node_row(level - 1u));
    int error_at = int(error_index(slice, level - 1u, 2u * place));
    uvec2 a = texelFetch(nodes, at).xy, b = texelFetch(nodes, at + 1).xy;
    uvec2 c = texelFetch(nodes, at + row).xy, d = texelFetch(nodes, at + row + 1).xy;
    return children(uvec4(a.x, b.x, c.x, d.x), uvec4(a.y, b.y, c.y, d.y),
                    vec4(texelFetch(errors, error_at).x, texelFetch(errors, error_at + 1).x,
                         texelFetch(errors, error_at + row).x, texelFetch(errors, error_at + row + 1).x));
}
#endif

float max_of(vec4 v)
{
    return max(max(v.x, v.y), max(v.z, v.w));
}

float min_of(vec4 v)
{
    return min(min(v.x, v.y), min(v.z, v.w));
}

// Factor of the bound for planes at w on average: it grows linearly with distance (section 6).
float growth_of(float w_mean)
{
    float doubled_at = quadtree.bounds.z;
    return doubled_at == 0.0 ? 1.0 : 1.0 + doubled_at / max(w_mean, doubled_at / (QUADTREE_GROWTH_MAX - 1.0));
}

// Tolerance of w. An eye that is nearer to the surface, by up to the radius, sees a difference of w as more pixels.
float tolerance_of(float w_mean, float w_max)
{
    float nearness = max(1.0 - quadtree.bounds.w * w_max, 0.0);
    return quadtree.bounds.x * nearness * nearness * growth_of(w_mean);
}

// Normal, of any length, of a plane that has these slopes and w at the axis of the view.
vec3 normal_of(vec2 slopes, float w_axis)
{
    vec2 across = slopes * quadtree.scale_centre.xy;
    return quadtree.depths.z != 0.0 ? vec3(across * (quadtree.depths.y - quadtree.depths.x), 1.0) : vec3(across, w_axis);
}

// Section 3.3, condition 2: whether the plane `slopes`, w in `centre`, is turned against one of the four children.
bool is_turned(vec2 centre, float h, float w, vec2 slopes, vec4 w4, vec4 sx, vec4 sy, float growth)
{
    if (quadtree.bounds.y <= 0.0)
        return false;
    vec2 axis = quadtree.scale_centre.zw - centre;
    vec3 normal = normalize(normal_of(slopes, w + dot(slopes, axis)));
    vec4 w_axis = w4 + sx * (axis.x - h * vec4(-1.0, 1.0, -1.0, 1.0)) + sy * (axis.y - h * vec4(-1.0, -1.0, 1.0, 1.0));
    float cosine = 1.0;
    for (int i = 0; i < 4; i++)
        cosine = min(cosine, dot(normal, normalize(normal_of(vec2(sx[i], sy[i]), w_axis[i]))));
    return cosine < 1.0 - (1.0 - quadtree.bounds.y) * growth * growth;
}

void main()
{
    uint item = first_item + item_index();
#ifdef NODES_OF_LEAVES
    uint columns = node_row(1u);
    if (item >= columns * (quadtree.padded_height / 2u))
        return;
    uvec2 place = uvec2(item % columns, item / columns);
    children four = children_of(place);
#else
    uint width = node_row(level), height = quadtree.padded_height >> level;
    uvec2 place = uvec2(item % width, item / width);
    uint slice = place.y / height;
    place.y -= slice * height;
    if (slice >= quadtree.faces * quadtree.layers)
        return;
    children four = children_of(slice, place);
#endif
    // Half a side of a child; also the distance from the centre of the node to those of the children along an axis.
    float h = 0.25 * float(1u << level);
    const vec4 side_x = vec4(-1.0, 1.0, -1.0, 1.0), side_y = vec4(-1.0, -1.0, 1.0, 1.0);
    bvec4 is_plane = lessThan(ivec4(four.head), ivec4(0));
    vec2 s0 = plane_slopes(uvec2(four.head.x, four.tail.x)), s1 = plane_slopes(uvec2(four.head.y, four.tail.y));
    vec2 s2 = plane_slopes(uvec2(four.head.z, four.tail.z)), s3 = plane_slopes(uvec2(four.head.w, four.tail.w));
    vec4 sx = vec4(s0.x, s1.x, s2.x, s3.x), sy = vec4(s0.y, s1.y, s2.y, s3.y);
    vec4 w4 = uintBitsToFloat(four.head & 0x7ffffffeu);
    vec4 reach = (abs(sx) + abs(sy)) * h;
    bvec4 is_something = greaterThan(w4, vec4(0.0));
#ifdef NODES_OF_LEAVES
    // Rounding of the leaves themselves, whose exact planes are no longer known.
    four.error = mix(vec4(0.0), w4 * ROUNDING + (reach * SLOPE_ROUNDING + 2.0 * h * SLOPE_STEP), is_something);
#endif
    // Least squares of w at the four centres, summed in the order of client/warp.
    float w = ((w4.x + w4.y) + (w4.z + w4.w)) * 0.25;
    vec2 slopes = vec2((w4.y - w4.x) + (w4.w - w4.z), (w4.z - w4.x) + (w4.w - w4.y)) * (0.25 / h);
    uvec2 node = plane_node(w, slopes, any(notEqual(four.head & 1u, uvec4(0u))));
    w = plane_w(node);
    slopes = plane_slopes(node);
    vec4 off = abs(w + h * (slopes.x * side_x + slopes.y * side_y) - w4);
    off += h * (abs(slopes.x - sx) + abs(slopes.y - sy)) + four.error;
    float w_max = w + 2.0 * h * (abs(slopes.x) + abs(slopes.y)) + quadtree.bounds.x;
    float error = max_of(off) + ROUNDING * w_max;
    bool merges = all(is_plane) && error <= tolerance_of(w, w_max) && all(is_something) &&
                  !is_turned(node_centre(level, place), h, w, slopes, w4, sx, sy, growth_of(w));
    if (all(is_plane) && !any(is_something)) { // empty
        merges = true;
        error = 0.0;
    }
    if (!merges) {
        // The range includes the planes below, which rays are tested against.
        vec4 upper = mix(uintBitsToFloat(four.head), w4 + reach + four.error, is_plane);
        bvec4 is_gap = mix(bvec4(false), not(is_something), is_plane);
        bool has_gaps = any(mix(lessThan(ivec4(four.tail), ivec4(0)), is_gap, is_plane));
        // A surface extends by up to a texel into a gap beside it. Seen on edge, its slopes are unknown.
        vec4 steepness = abs(sx) + abs(sy);
        vec4 beside = has_gaps ? mix(steepness, vec4(FLOAT_MAX), equal(steepness, vec4(0.0))) : vec4(0.0);
        vec4 lower = mix(uintBitsToFloat(four.tail & 0x7fffffffu), w4 - reach - four.error - beside, is_plane);
        lower = mix(lower, vec4(FLOAT_MAX), is_gap);
        node = box_node(max(max_of(upper), 0.0), max(min_of(lower), 0.0), has_gaps);
        error = 0.0;
    }
    imageStore(made_nodes, int(node_index(slice, level, place)), uvec4(node, 0u, 0u));
    imageStore(made_errors, int(error_index(slice, level, place)), vec4(error));
}
