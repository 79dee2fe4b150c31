// SPDX-License-Identifier: MIT
// Linear search by a few steps, ABUFFER_STEPS of them, and between two steps binary search: paper, section 3.2. There
// the steps are those of a voxel; here of each subvoxel that holds something, unless voxels know none. Steps as long as
// voxels pass many thin bodies twice in one step, and miss parts of an open room's walls between two columns.
//
// A column's samples decide what is inside: the winding at a point is the sum over the samples before it. If it differs
// between a step's begin and end, a surface was passed. A surface that is passed twice in a step is missed.
//
// Open surfaces have no inside. The planes of their samples in the column at a step's end are extended over the step:
// an intersection counts if there is a sample of the surface at it.
#include "abuffer/planes.glsl"

#ifdef ABUFFER_STEPS

const int BISECTIONS_MAX = 8;
// Iterations from column to column towards the plane's intersection: on a curved surface it converges after two or
// three.
const int FOLLOWS_MAX = 4;
const float FOLLOW_REACH = 8.0; // in cells of depth: a column's samples no farther away are of the same surface
const float FOLLOW_ALONG = 4.0; // extension of an open surface beyond a step
// In cells from a ray's origin: within them the search is finer.
const float NEAR_ORIGIN = 4.0;

// A ray's state in the steps of a subvoxel.
struct step_traversal {
    found_voxel here; // `what` 0: past it
    float size;       // of its steps
    int next;         // step of the subvoxel; 0: its begin
    uint images;      // images not yet searched at this step; 0: the step is not begun
    // The winding at the last point looked up.
    int winding;
    bool is_known;
    // The last step that was searched.
    int axis;
    float lo, hi;
    float s; // estimate of the passed surface's position
    bool by_winding, only_leaning;
    int winding_lo;
};

// The image that the voxel names; of several the one along the ray's dominant axis: there it passes the fewest texels,
// and sees no surface edge-on.
int image_of(uint what, vec3 d)
{
    vec3 along = abs(d);
    along = vec3((what & 1u) != 0u ? along.x : -1.0, (what & 2u) != 0u ? along.y : -1.0,
                 (what & 4u) != 0u ? along.z : -1.0);
    return along.x >= along.y && along.x >= along.z ? 0 : along.y >= along.z ? 1 : 2;
}

vec3 place_in_image(voxel_traversal w, int axis, float s)
{
    return in_image(w.ray.o + s * w.ray.d, axis);
}

// A ray that begins on a surface is on the side that its direction points to, whichever side its origin was rounded to.
// A ray along the surface is on the side of a point a little farther on: a sample's normal is not that of the origin.
const float OWN_ALONG = 0.15;

int winding_at_origin(voxel_traversal w, uint what)
{
    float nearest = OWN_BEHIND;
    int own_winding = 0;
    bool is_own = false, goes_along = false;
    int own_axis = image_of(what, w.ray.d);
    uint images = what & ABUFFER_VOXEL_IMAGES;
    // All images: in a corner one of them shows the other wall, which may be near too.
    do {
        int axis = findLSB(images);
        vec3 p = place_in_image(w, axis, w.s_min), d = in_image(w.ray.d, axis);
        ivec2 texel = texel_of(p.xy);
        column_scan c = scan_of(column_at(axis, texel));
        bool is_behind = false;
        do {
            int i;
            uvec2 words;
            bool is_one = scan(c, p.z - SPAN, i, words);
            is_behind = is_one && depth_of(words) > p.z + SPAN;
            column_sample q = sample_of(words, axis);
            float inverse = inversesqrt(dot(q.normal, q.normal)), side = dot(q.normal, d) * inverse;
            float distance_ = abs(dot(q.normal, p - vec3(vec2(texel) + 0.5, q.depth))) * inverse;
            if (is_one && !is_behind && q.step_ != 0 && distance_ < nearest) {
                nearest = distance_;
                is_own = true;
                own_axis = axis;
                goes_along = abs(side) < OWN_ALONG;
                own_winding = (side > 0.0) == (q.normal.z > 0.0) ? q.behind : q.behind - q.step_;
            }
        } while (c.next < c.end && !is_behind);
        images &= images - 1u;
    } while (images != 0u);
    int there = winding_at(own_axis, place_in_image(w, own_axis, w.s_min + OWN_WAY));
    return is_own && !goes_along ? inside_of(own_winding) : there;
}

// Intersects the ray with a surface near s: with the plane of a sample there, then with that of a sample at this
// intersection, and so on until the intersection is in the sample's own texel.
bool follow(trace_ray r, inout voxel_traversal w, inout abuffer_found found, step_traversal t)
{
    int axis = t.axis;
    float beyond = t.by_winding ? 1.0 : FOLLOW_ALONG, lo = t.lo - beyond, hi = t.hi + beyond, s = t.s;
    vec3 o = in_image(w.ray.o, axis), d = in_image(w.ray.d, axis);
    bool is_there, goes_on;
    int k = 0, nearest_sample;
    float nearest_side;
    do {
        vec3 p = o + s * d;
        ivec2 texel = texel_of(p.xy);
        column_scan c = scan_of(column_at(axis, texel));
        float nearest = 1e30;
        nearest_side = 0.0;
        nearest_sample = 0;
        bool is_behind = false;
        do {
            int i;
            uvec2 words;
            bool is_one = scan(c, p.z - FOLLOW_REACH, i, words);
            is_behind = is_one && depth_of(words) > p.z + FOLLOW_REACH;
            float s_plane, side;
            column_sample q = sample_of(words, axis);
            bool intersects = intersect_plane(o, d, w.s_min, texel, q, s_plane, side) && (!t.only_leaning || leans(q));
            intersects = intersects && (t.by_winding || (s_plane > lo && s_plane < hi));
            if (is_one && !is_behind && intersects && abs(s_plane - s) < abs(nearest - s)) {
                nearest = s_plane;
                nearest_side = side;
                nearest_sample = i;
            }
        } while (c.next < c.end && !is_behind);
        vec2 from_middle = abs(o.xy + nearest * d.xy - vec2(texel) - 0.5);
        is_there = from_middle.x <= 0.5 + ABUFFER_SLACK && from_middle.y <= 0.5 + ABUFFER_SLACK;
        goes_on = !is_there && nearest > lo && nearest < hi;
        s = nearest;
    } while (goes_on && ++k < FOLLOWS_MAX);
    is_there = is_there && s < w.s_limit;
    if (is_there)
        offer_at(r, w, found, nearest_sample, s, nearest_side);
    return is_there;
}

#ifndef ANYTHING_ENDS

int nearest_sample(int axis, vec3 p)
{
    column c = column_at(axis, texel_of(p.xy));
    int nearest = -1;
    float away_min = 1e30;
    for (int i = c.first; i < c.end; i++) {
        float away = abs(depth_of(words_at(i)) - p.z);
        nearest = away < away_min ? i : nearest;
        away_min = away < away_min ? away : away_min;
    }
    return nearest;
}

// The winding differs between lo and hi, but no plane is intersected near hi.
void search_passage(trace_ray r, inout voxel_traversal w, inout abuffer_found found, int axis, float lo, float hi,
                    int winding_lo)
{
    int i = 0;
    do {
        float middle = 0.5 * (lo + hi);
        bool is_before = winding_at(axis, place_in_image(w, axis, middle)) == winding_lo;
        bool is_far = hi - lo > 1.0;
        lo = is_far && is_before ? middle : lo;
        hi = !is_far || is_before ? hi : middle;
    } while (++i < BISECTIONS_MAX && hi - lo > 1.0);
    // If it was passed at a texel's border and no plane was intersected, it is steep here and another image shows it.
    bool intersected = false;
    int other = 0;
    do {
        int image = axis + other < 3 ? axis + other : axis + other - 3;
        intersected = search_image(r, w, found, image, other > 0, max(lo - 0.5, w.s_min), hi + 0.5);
    } while (++other < 3 && !intersected);
    if (!intersected && hi > w.s_min + OWN_WAY + 1.0 && hi < w.s_limit) {
        i = nearest_sample(axis, place_in_image(w, axis, hi));
        i = i < 0 ? nearest_sample(axis, place_in_image(w, axis, lo)) : i;
        if (i >= 0)
            offer_at(r, w, found, i, hi, dot(sample_of(words_at(i), axis).normal, in_image(w.ray.d, axis)));
    }
}

#endif

// The next step of the subvoxel. True: a surface may be passed there:
//
// that of a body if the winding changes, an open one if the plane of a sample at the step's end is intersected within
// the step or not far from it.
bool look(inout voxel_traversal w, inout step_traversal t)
{
    bool is_body = (t.here.what & ABUFFER_VOXEL_BODY) != 0u;
    t.lo = t.here.s_in + float(t.next - 1) * t.size;
    t.hi = t.here.s_in + float(t.next) * t.size;
    // All images that a voxel names only near the ray's origin: else light would leak along bodies that stand on a
    // surface. Farther on the one along the ray's dominant axis, which shows most of what it hits.
    t.only_leaning = !is_body && t.lo <= w.s_min + NEAR_ORIGIN;
    if (t.images == 0u)
        t.images = t.only_leaning ? t.here.what & ABUFFER_VOXEL_IMAGES : 1u << image_of(t.here.what, w.ray.d);
    t.axis = findLSB(t.images);
    vec3 o = in_image(w.ray.o, t.axis), d = in_image(w.ray.d, t.axis), p = o + t.hi * d;
    ivec2 texel = texel_of(p.xy);
    vec2 from_middle = p.xy - vec2(texel) - 0.5;
    float reach = is_body ? SPAN : 2.0 * (t.hi - t.lo) + SPAN;
    int winding = 0; // behind all samples
    float nearest = w.s_limit;
    bool is_first = true, is_behind = false;
    column_scan c = scan_of(column_at(t.axis, texel));
    do {
        int i;
        uvec2 words;
        if (scan(c, p.z - reach, i, words)) {
            is_behind = depth_of(words) > p.z + reach;
            column_sample q = sample_of(words, t.axis);
            winding = is_first ? q.behind - q.step_ : winding;
            winding += !is_behind && plane_depth(q, from_middle) < p.z ? q.step_ : 0;
            is_first = false;
            float s, side;
            bool intersects = intersect_plane(o, d, w.s_min, texel, q, s, side) && (!t.only_leaning || leans(q));
            bool is_here = s > t.lo - FOLLOW_ALONG && s < t.hi + FOLLOW_ALONG && s < nearest;
            nearest = !is_behind && intersects && is_here ? s : nearest;
        }
    } while (c.next < c.end && !is_behind);
    winding = inside_of(winding);
    bool is_past_own = t.hi > w.s_min + OWN_WAY;
    bool differs = t.next > 0 && is_past_own && winding != t.winding;
    t.by_winding = is_body;
    t.winding_lo = t.winding;
    t.winding = is_body && (t.next == 0 || is_past_own) ? winding : t.winding;
    t.is_known = is_body;
    t.s = is_body ? t.hi : nearest;

    t.images &= t.images - 1u;
    t.next += t.images == 0u ? 1 : 0;
    t.here.what = t.next <= ABUFFER_STEPS ? t.here.what : 0u;
    return is_body ? differs : nearest < w.s_limit;
}

// Settles a surface that a step may have passed.
void pass(trace_ray r, inout voxel_traversal w, inout abuffer_found found, inout step_traversal t)
{
#ifdef ANYTHING_ENDS
    if (t.by_winding)
        offer_at(r, w, found, 0, t.hi, 1.0);
    else
        follow(r, w, found, t);
#else
    if (!follow(r, w, found, t) && t.by_winding)
        search_passage(r, w, found, t.axis, t.lo, t.hi, t.winding_lo);
#endif
    // Another image may have a nearer intersection.
    t.here.what = w.s_limit < t.lo || (t.by_winding && w.s_limit < t.hi) ? 0u : t.here.what;
}

// On to the next occupied voxel, at most one step.
void step_to_voxel(inout voxel_traversal w, inout step_traversal t)
{
    voxel_step step_;
    bool is_found = step_on(w, step_);
    found_voxel found = found_in(step_);
    if (is_found)
        t.here = found;
    float end = t.here.s_out < w.s_limit ? t.here.s_out : w.s_limit;
    t.size = (end - t.here.s_in) * (1.0 / float(ABUFFER_STEPS));
    bool is_body = (t.here.what & ABUFFER_VOXEL_BODY) != 0u;
    t.next = is_body && !t.is_known ? 0 : 1;
    t.images = 0u;
}

void traverse_steps(trace_ray r, inout voxel_traversal w, inout abuffer_found found)
{
    step_traversal t;
    t.here = found_voxel(0u, 0.0, 0.0);
    t.next = 0;
    t.size = 0.0;
    t.images = 0u;
    // Everything beyond the voxels is outside.
    t.winding = 0;
    t.is_known = w.s > w.s_min;
    if (!t.is_known && w.s < w.s_end) {
        do {
            step_to_voxel(w, t);
        } while (t.here.what == 0u && w.s <= w.s_min && w.s < w.s_end);
        if ((t.here.what & ABUFFER_VOXEL_BODY) != 0u && t.here.s_in <= w.s_min) {
            t.winding = winding_at_origin(w, t.here.what);
            t.is_known = true;
            t.next = 1;
        }
    }
    // Software GL runs a loop's whole body in every round. So the rare case, a passed surface, is settled outside the
    // loop over steps.
    do {
        bool passes = false;
        do {
            if (t.here.what == 0u && w.s < w.s_end)
                step_to_voxel(w, t);
            if (t.here.what != 0u)
                passes = look(w, t);
        } while (!passes && (t.here.what != 0u || w.s < w.s_end));
        if (passes)
            pass(r, w, found, t);
    } while (t.here.what != 0u || w.s < w.s_end);
}

#endif
