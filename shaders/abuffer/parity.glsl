// SPDX-License-Identifier: MIT
// Search by parity, the paper's own (section 3.2): a 2D DDA visits the texels of the image that a voxel names. A place
// behind an odd number of surfaces is inside of a body; where the parity changes, the ray has passed a surface. A body
// that a ray enters and leaves within a texel is missed, and so are bodies in bodies.
//
// Surfaces without an inside are searched by planes.
#include "abuffer/planes.glsl"

#ifdef ABUFFER_PARITY

struct parity_march {
    bool is_known, is_inside;
    float s_least; // intersections before it do not count, as the ray may begin on a surface
};

// The image that the voxel names; among several, the one along the ray's dominant axis, where the ray passes the fewest
// texels and meets no surface edge-on.
int image_of(uint what, vec3 d)
{
    vec3 along = abs(d);
    along = vec3((what & 1u) != 0u ? along.x : -1.0, (what & 2u) != 0u ? along.y : -1.0,
                 (what & 4u) != 0u ? along.z : -1.0);
    return along.x >= along.y && along.x >= along.z ? 0 : along.y >= along.z ? 1 : 2;
}

bool is_inside(int axis, ivec2 texel, vec3 p)
{
    return (winding_at(axis, texel, p) & 1) != 0;
}

// Records the surface of the texel that is nearest to the ray's way (o, d in the image) from s_in to s_out.
void pass_surface(trace_ray r, inout voxel_traversal w, inout abuffer_found found, int axis, ivec2 texel, vec3 o, vec3 d,
                  float s_in, float s_out)
{
    column c = column_at(axis, texel);
    int nearest = -1;
    float s = s_out, side = 0.0, away_min = 1e30;
    for (int i = c.first; i < c.end; i++) {
        column_sample q = sample_of(words_at(i), axis);
        float own_side = dot(q.normal, d), own_s = dot(q.normal, vec3(vec2(texel) + 0.5, q.depth) - o) / own_side;
        float within = clamp(own_s, s_in, s_out), away = abs(own_s - within);
        if (away < away_min) {
            nearest = i;
            s = within;
            side = own_side;
            away_min = away;
        }
    }
    if (nearest >= 0 && s < w.s_limit)
        offer_at(r, w, found, nearest, s, side);
}

void search_parity(trace_ray r, inout voxel_traversal w, inout abuffer_found found, found_voxel here,
                   inout parity_march march)
{
    int axis = image_of(here.what, w.ray.d);
    vec3 o = in_image(w.ray.o, axis), d = in_image(w.ray.d, axis);
    float s = max(here.s_in, march.s_least), s_end = min(here.s_out, w.s_limit);
    ivec2 texel = texel_of(o.xy + s * d.xy), forward = ivec2(greaterThan(d.xy, vec2(0.0)));
    vec2 inverse = 1.0 / d.xy, border = (vec2(texel + forward) - o.xy) * inverse;
    bool continues = s < s_end;
    if (continues && !march.is_known)
        march = parity_march(true, is_inside(axis, texel, o + s * d), march.s_least);
    while (continues) {
        bool along_u = border.x < border.y;
        float s_next = along_u ? border.x : border.y, s_out = min(s_next, s_end);
        bool now = is_inside(axis, texel, o + s_out * d);
        if (now != march.is_inside)
            pass_surface(r, w, found, axis, texel, o, d, s, s_out);
        march.is_inside = now;
        s = s_next;
        texel += along_u ? ivec2(2 * forward.x - 1, 0) : ivec2(0, 2 * forward.y - 1);
        continues = s < s_end && s < w.s_limit && all(lessThan(uvec2(texel), uvec2(abuffer_resolution)));
        border = (vec2(texel + forward) - o.xy) * inverse;
    }
}

void traverse_parity(trace_ray r, inout voxel_traversal w, inout abuffer_found found)
{
    // Places beyond the voxels are outside of all bodies.
    parity_march march = parity_march(w.s > w.s_min, false, w.s_min + OWN_WAY);
    while (w.s < w.s_end) {
        found_voxel here = next_voxel(w);
        if ((here.what & ABUFFER_VOXEL_BODY) != 0u)
            search_parity(r, w, found, here, march);
        else if (here.what != 0u)
            search_planes(r, w, found, here);
    }
}

#endif
