// SPDX-License-Identifier: MIT
// Linear search by a few steps a voxel, ABUFFER_STEPS of them, and between two steps binary search: paper, section 3.2.
//
// Inside or outside is decided by a column's samples: how many bodies a point is in is what the samples before it say
// together. Where that is something else at a step's end than at its begin, a surface was passed. What is passed twice in
// a step is not seen.
//
// Open surfaces have no inside. Of them the planes of the samples in the column at a step's end are taken to go on over
// the step: one that is crossed there counts if there is a sample of it at the crossing.
#include "abuffer/planes.glsl"

#ifdef ABUFFER_STEPS

// Cells from a ray's origin within which it is looked for more closely what it meets.
const float NEAR_ORIGIN = 4.0;

const int BISECTIONS_MAX = 8;
// From column to column towards where a plane is crossed: a curved surface is met after two or three.
const int FOLLOWS_MAX = 4;
const float FOLLOW_REACH = 4.0; // cells of depth in which a column's samples are of the surface that is followed

// Of how many bodies the ray is inside, where it was last looked.
struct ray_state {
    int winding;
    bool is_known;
};

// In the image that the voxel names; of several in that which the ray runs along most: there it crosses fewest texels, and
// what it meets is not seen from beside.
int image_of(uint what, vec3 d)
{
    vec3 along = abs(d);
    along = vec3((what & 1u) != 0u ? along.x : -1.0, (what & 2u) != 0u ? along.y : -1.0,
                 (what & 4u) != 0u ? along.z : -1.0);
    return along.x >= along.y && along.x >= along.z ? 0 : along.y >= along.z ? 1 : 2;
}

vec3 place_in_image(voxel_walk w, int axis, float s)
{
    return in_image(w.ray.o + s * w.ray.d, axis);
}

// A ray that begins on a surface is on the side of it to which it goes, whatever of the two its origin was rounded to. One
// that goes along the surface is on the side where it is a little farther on: a sample's normal is not that of the place.
const float OWN_ALONG = 0.15;

int winding_at_origin(voxel_walk w, uint what)
{
    for (uint images = what & ABUFFER_VOXEL_IMAGES; images != 0u; images &= images - 1u) {
        int axis = findLSB(images);
        vec3 p = place_in_image(w, axis, w.s_least), d = in_image(w.ray.d, axis);
        ivec2 texel = texel_of(p.xy);
        column c = column_at(axis, texel);
        float nearest = OWN_BEHIND;
        int own_winding = 0;
        bool is_own = false, goes_along = false;
        for (int i = sample_from(c, p.z - SPAN); i < c.end; i++) {
            uvec2 words = words_at(i);
            if (depth_of(words) > p.z + SPAN)
                break;
            if (depth_of(words) < p.z - SPAN)
                continue;
            column_sample q = sample_of(words, axis);
            float inverse = inversesqrt(dot(q.normal, q.normal)), side = dot(q.normal, d) * inverse;
            float distance_ = abs(dot(q.normal, p - vec3(vec2(texel) + 0.5, q.depth))) * inverse;
            if (q.step_ != 0 && distance_ < nearest) {
                nearest = distance_;
                is_own = true;
                goes_along = abs(side) < OWN_ALONG;
                own_winding = (side > 0.0) == (q.normal.z > 0.0) ? q.behind : q.behind - q.step_;
            }
        }
        if (is_own)
            return goes_along ? winding_at(axis, p + OWN_WAY * d) : own_winding;
    }
    int axis = image_of(what, w.ray.d);
    return winding_at(axis, place_in_image(w, axis, w.s_least + OWN_WAY));
}

#ifndef ANYTHING_ENDS

// Where the ray crosses a surface near s, by the plane of a sample there, then by that of a sample where it crosses this
// one, and so on until the crossing is in the sample's own texel.
bool follow(trace_ray r, inout voxel_walk w, inout abuffer_found found, int axis, bool only_leaning, float s, float lo,
            float hi)
{
    vec3 o = in_image(w.ray.o, axis), d = in_image(w.ray.d, axis);
    for (int k = 0; k < FOLLOWS_MAX; k++) {
        vec3 p = o + s * d;
        ivec2 texel = texel_of(p.xy);
        column c = column_at(axis, texel);
        float nearest = 1e30, nearest_side = 0.0;
        int nearest_sample = 0;
        for (int i = sample_from(c, p.z - FOLLOW_REACH); i < c.end; i++) {
            uvec2 words = words_at(i);
            if (depth_of(words) > p.z + FOLLOW_REACH)
                break;
            column_sample q = sample_of(words, axis);
            float s_plane, side;
            if (cross_plane(o, d, w.s_least, texel, q, s_plane, side) && abs(s_plane - s) < abs(nearest - s) &&
                (!only_leaning || leans(q))) {
                nearest = s_plane;
                nearest_side = side;
                nearest_sample = i;
            }
        }
        vec2 from_middle = abs(o.xy + nearest * d.xy - vec2(texel) - 0.5);
        if (from_middle.x <= 0.5 + SLACK && from_middle.y <= 0.5 + SLACK) {
            if (!(nearest < w.s_limit))
                return false;
            offer_at(r, w, found, nearest_sample, nearest, nearest_side);
            return true;
        }
        if (!(nearest > lo - 1.0 && nearest < hi + 1.0))
            return false;
        s = nearest;
    }
    return false;
}

int nearest_sample(int axis, vec3 p)
{
    column c = column_at(axis, texel_of(p.xy));
    int nearest = -1;
    float least_ = 1e30;
    for (int i = c.first; i < c.end; i++) {
        float away = abs(depth_of(words_at(i)) - p.z);
        nearest = away < least_ ? i : nearest;
        least_ = away < least_ ? away : least_;
    }
    return nearest;
}

// A surface is passed between lo and hi.
void refine(trace_ray r, inout voxel_walk w, inout abuffer_found found, int axis, float lo, float hi, int winding_lo)
{
    if (follow(r, w, found, axis, false, hi, lo, hi))
        return;
    for (int i = 0; i < BISECTIONS_MAX && hi - lo > 1.0; i++) {
        float middle = 0.5 * (lo + hi);
        bool is_before = winding_at(axis, place_in_image(w, axis, middle)) == winding_lo;
        lo = is_before ? middle : lo;
        hi = is_before ? hi : middle;
    }
    // Where it was passed at a texel's border and no plane was crossed, it is steep here and another image shows it.
    bool crossed = false;
    for (int other = 0; other < 3 && !crossed; other++) {
        int image = axis + other < 3 ? axis + other : axis + other - 3;
        crossed = search_image(r, w, found, image, other > 0, max(lo - 0.5, w.s_least), hi + 0.5);
    }
    if (!crossed && hi > w.s_least + OWN_WAY + 1.0 && hi < w.s_limit) {
        int i = nearest_sample(axis, place_in_image(w, axis, hi));
        i = i < 0 ? nearest_sample(axis, place_in_image(w, axis, lo)) : i;
        if (i >= 0)
            offer_at(r, w, found, i, hi, dot(sample_of(words_at(i), axis).normal, in_image(w.ray.d, axis)));
    }
}

#endif

void search_body(trace_ray r, inout voxel_walk w, inout abuffer_found found, found_voxel here, inout ray_state state)
{
    int axis = image_of(here.what, w.ray.d);
    float end = here.s_out < w.s_limit ? here.s_out : w.s_limit;
    float lo = here.s_in, hi = lo, step_ = (end - lo) * (1.0 / float(ABUFFER_STEPS));
    if (!state.is_known) {
        state.is_known = true;
        state.winding = here.s_in <= w.s_least ? winding_at_origin(w, here.what)
                                               : winding_at(axis, place_in_image(w, axis, here.s_in));
    }
    int k = 1;
    while (k <= ABUFFER_STEPS && lo < w.s_limit) {
        int winding = state.winding;
        // Rays of a SIMD group step together, and then those of them together refine that have to.
        for (; k <= ABUFFER_STEPS && winding == state.winding; k++) {
            lo = hi;
            hi = here.s_in + float(k) * step_;
            if (hi > w.s_least + OWN_WAY)
                winding = winding_at(axis, place_in_image(w, axis, hi));
        }
        if (winding == state.winding)
            return;
#ifdef ANYTHING_ENDS
        offer_at(r, w, found, 0, hi, 1.0);
        return;
#else
        refine(r, w, found, axis, lo, hi, state.winding);
        state.winding = winding;
        lo = hi;
#endif
    }
}

// All images that a voxel names only near where the ray begins: along what stands on a surface light would leak. Farther on
// the one that the ray runs along most, which shows most of what it meets.
uint images_from(voxel_walk w, uint what, float s)
{
    return s <= w.s_least + NEAR_ORIGIN ? what & ABUFFER_VOXEL_IMAGES : 1u << image_of(what, w.ray.d);
}

// Of an image's column at each step's end, what is crossed first of its samples' planes; it is followed from column to
// column until the crossing is in the sample's own texel. In one loop, a column a round: rays of a SIMD group that step
// and others that follow do so together.
void search_open(trace_ray r, inout voxel_walk w, inout abuffer_found found, found_voxel here)
{
    float end = here.s_out < w.s_limit ? here.s_out : w.s_limit;
    float step_ = (end - here.s_in) * (1.0 / float(ABUFFER_STEPS)), lo = here.s_in, hi = lo + step_, s = hi;
    uint images = images_from(w, here.what, lo);
    int k = 1, follows = 0;
    while (k <= ABUFFER_STEPS && lo < w.s_limit) {
        int axis = findLSB(images);
        vec3 o = in_image(w.ray.o, axis), d = in_image(w.ray.d, axis), p = o + s * d;
        ivec2 texel = texel_of(p.xy);
        float reach = follows > 0 ? FOLLOW_REACH : 2.0 * (hi - lo) + SPAN;
        float crossing = 1e30, crossing_side = 0.0, least_ = 1e30;
        bool is_near = lo <= w.s_least + NEAR_ORIGIN;
        int crossed = 0;
        column c = column_at(axis, texel);
        for (int i = sample_from(c, p.z - reach); i < c.end; i++) {
            uvec2 words = words_at(i);
            if (depth_of(words) > p.z + reach)
                break;
            float s_plane, side;
            column_sample q = sample_of(words, axis);
            bool crosses = cross_plane(o, d, w.s_least, texel, q, s_plane, side) && (!is_near || leans(q));
            float away = follows > 0 ? abs(s_plane - s) : s_plane;
            if (crosses && away < least_ && s_plane > lo - FOLLOW_REACH && s_plane < hi + FOLLOW_REACH) {
                least_ = away;
                crossing = s_plane;
                crossing_side = side;
                crossed = i;
            }
        }
        vec2 from_middle = abs(o.xy + crossing * d.xy - vec2(texel) - 0.5);
        bool is_there = from_middle.x <= 0.5 + SLACK && from_middle.y <= 0.5 + SLACK && crossing < w.s_limit;
        if (is_there)
            offer_at(r, w, found, crossed, crossing, crossing_side);
        if (!is_there && crossing < w.s_limit && follows < FOLLOWS_MAX) {
            s = crossing;
            follows++;
        } else {
            follows = 0;
            images &= images - 1u;
            if (images == 0u) {
                k++;
                lo = hi;
                hi = here.s_in + float(k) * step_;
                images = images_from(w, here.what, lo);
            }
            s = hi;
        }
    }
}

void search_steps(trace_ray r, inout voxel_walk w, inout abuffer_found found, found_voxel here, inout ray_state state)
{
    if ((here.what & ABUFFER_VOXEL_BODY) != 0u) {
        search_body(r, w, found, here, state);
    } else {
        search_open(r, w, found, here);
        state.is_known = false;
    }
}

#endif
