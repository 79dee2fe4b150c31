// SPDX-License-Identifier: MIT
// Linear search by 2D DDA: visits the texels of one image along a part of a ray, in order, and in each of them the
// samples whose planes the ray intersects there.
#include "abuffer/found.glsl"

// A ray that begins on a surface may begin a little beyond a neighbour's plane, and would at once hit the surface that
// it leaves. So within OWN_WAY of its origin a ray ignores planes that pass the origin within these distances. The one
// for planes hit from behind, as a ray that leaves a body would hit its own surface, is generous. The one for planes hit
// from the front, as a ray in a corner hits the other wall, and a refracted ray its own surface, suffices for a concave
// surface with a curvature radius of two to three cells, as the inner side of a handle: from a neighbour's centre, at
// most 0.78 cells away, to the origin it falls by 0.78^2 / (2 * 2.5). A plane that is hit steeply may be nearer than one
// at a grazing angle: in a corner rays hit the wall beside their origin, except within the last tenth of a cell.
const float OWN_WAY = 1.5;
const float OWN_BEHIND = 0.5, OWN_BEFORE = 0.12, OWN_RISE = 0.05; // the rise is per cell of the ray's length

// Intersects a ray (o, d in the image) with a sample's plane. False: the ray begins on this plane. `side` is positive if
// it comes from behind.
bool intersect_plane(vec3 o, vec3 d, float s_min, ivec2 texel, column_sample p, out float s, out float side)
{
    float height = dot(p.normal, vec3(vec2(texel) + 0.5, p.depth) - o);
    side = dot(p.normal, d);
    s = height / side;
    float way = s - s_min, own = side > 0.0 ? OWN_BEHIND : OWN_BEFORE + OWN_RISE * way;
    return way > 0.0 && !(way < OWN_WAY && height * height < own * own * dot(p.normal, p.normal));
}

// Whether the sample's surface leans to this axis: a surface in several images is searched in those that it leans to.
bool leans(column_sample p)
{
    vec3 size = abs(p.normal);
    return size.z >= AXES_OVERLAP * max_component(size);
}

// Searches the part [s_in, s_out] of the ray. `only_leaning`: skip surfaces that do not lean to this axis, as another
// image has them. True: an intersection was found.
bool search_image(trace_ray r, inout voxel_traversal w, inout abuffer_found found, int axis, bool only_leaning, float s_in,
                  float s_out)
{
    vec3 o = in_image(w.ray.o, axis), d = in_image(w.ray.d, axis);
    ivec2 texel = texel_of(o.xy + s_in * d.xy);
    ivec2 forward = ivec2(greaterThan(d.xy, vec2(0.0)));
    vec2 inverse = 1.0 / d.xy;
    vec2 border = (vec2(texel + forward) - o.xy) * inverse;
    float s = s_in;
    bool any_intersected = false, continues;
    do {
        bool along_u = border.x < border.y;
        float s_next = along_u ? border.x : border.y;
        float s_here = s_next < s_out ? s_next : s_out;
        float z_in = o.z + s * d.z, z_out = o.z + s_here * d.z;
        float depth_min = (z_in < z_out ? z_in : z_out) - SPAN, depth_max = (z_in < z_out ? z_out : z_in) + SPAN;
        column_scan c = scan_of(column_at(axis, texel));
        bool is_behind = false;
        do {
            int i;
            uvec2 words;
            bool is_one = scan(c, depth_min, i, words);
            is_behind = is_one && depth_of(words) > depth_max;
            column_sample p = sample_of(words, axis);
            float s_plane, side;
            bool intersects = intersect_plane(o, d, w.s_min, texel, p, s_plane, side);
            vec2 from_middle = abs(o.xy + s_plane * d.xy - vec2(texel) - 0.5);
            bool is_met = intersects && from_middle.x <= 0.5 + w.beyond && from_middle.y <= 0.5 + w.beyond;
            if (is_one && !is_behind && is_met && s_plane > w.s_behind && s_plane < w.s_limit &&
                (!only_leaning || leans(p))) {
#ifdef OFFERS_LATER
                meet(found.met, i, s_plane, side);
#else
                offer_at(r, w, found, i, s_plane, side);
#endif
#ifdef KEEPS_SAMPLE
                found.is_within = from_middle.x <= 0.5 + ABUFFER_SLACK && from_middle.y <= 0.5 + ABUFFER_SLACK;
#endif
                any_intersected = true;
            }
        } while (c.next < c.end && !is_behind);
        continues = s_next < s_out && s_next < w.s_limit;
        s = s_next;
        texel += along_u ? ivec2(2 * forward.x - 1, 0) : ivec2(0, 2 * forward.y - 1);
        continues = continues && all(lessThan(uvec2(texel), uvec2(abuffer_resolution)));
        border = (vec2(texel + forward) - o.xy) * inverse;
    } while (continues);
    return any_intersected;
}

// Searches all images that a voxel names, in order; an intersection in one shortens the search in the next.
void search_planes(trace_ray r, inout voxel_traversal w, inout abuffer_found found, found_voxel here)
{
    uint images = here.what & ABUFFER_VOXEL_IMAGES;
    bool only_leaning = bitCount(images) > 1;
    do {
        search_image(r, w, found, findLSB(images), only_leaning, here.s_in,
                     here.s_out < w.s_limit ? here.s_out : w.s_limit);
        images &= images - 1u;
    } while (images != 0u);
}
