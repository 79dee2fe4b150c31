// SPDX-License-Identifier: MIT
// Finds the surface behind an intersected plane: the sample's triangle, or one beside it.
//
// A sample's plane covers its whole texel, its triangle may not. The surface beyond the edge is usually sampled by the
// texels around the intersection; if it is not, as triangles are smaller than texels, the plane stands for it.
#include "abuffer/planes.glsl"
#include "raster/line_triangle.glsl"

#if defined KEEPS_SAMPLE && !defined ABUFFER_PARITY

// Distance beyond its texel up to which a sample's plane is tested, in cells. Where surfaces bend by more than
// ABUFFER_SLACK, rays would pass between planes; triangles verify the intersections, so the search may reach farther.
const float BEYOND = 0.25;
// Maximum distance, in cells, of intersections that count as the same.
const float AGAIN = 1e-3;
// Maximum distance in depth, in cells, of samples in adjacent texels that are of one surface, in the image that it leans
// to.
const float BESIDE = 3.0;
// Maximum distance, in cells, of an adjacent triangle's intersection behind the plane's.
const float BESIDE_BEHIND = 4.0;

// On a body as thin as a cell or two, planes extend beyond the surface and would darken the side that a shadow ray
// leaves. Shadow rays therefore verify intersections within VERIFIED_WAY cells of their origin; farther on, any triangle
// will do. A plane does not stand for a triangle without samples if it is hit from behind, as by rays that leave a body,
// or within TRUSTED_WAY; farther on, planes hit from the front are all that a mesh of triangles smaller than texels has.
const float VERIFIED_WAY = 4.0, TRUSTED_WAY = 2.0;

// The samples round a point of an image: the columns of the four nearest texels, one after the other.
struct samples_beside {
    int axis;
    vec3 p;
    int columns; // columns begun so far
    column_scan column;
    uint first_id, end_id; // ids of the instance
    uvec3 seen;            // ids of the intersected sample, of the last one and of the one before
};

// Texel k of four: the point's own, its nearer neighbour, the other neighbour, the diagonal one.
ivec2 texel_beside(vec2 p, int k)
{
    vec2 from_middle = fract(p) - 0.5;
    bool u_first = abs(from_middle.x) > abs(from_middle.y);
    bool along_u = k == 3 || k == (u_first ? 1 : 2), along_v = k == 3 || k == (u_first ? 2 : 1);
    return texel_of(p + vec2(along_u ? sign(from_middle.x) : 0.0, along_v ? sign(from_middle.y) : 0.0));
}

// Advances to the next sample that may be of the same surface but of an untested triangle. False: there is none.
bool next_beside(inout samples_beside b, out int index, out uint id)
{
    bool is_new = false;
    index = 0;
    id = 0u;
    // The loop ends after the fourth column: a fifth would be the first again.
    while (!is_new && (b.columns < 4 || b.column.next < b.column.end)) {
        if (b.column.next >= b.column.end) {
            b.column = scan_of(column_at(b.axis, texel_beside(b.p.xy, b.columns)));
            b.columns++;
        }
        uvec2 words;
        bool is_one = scan(b.column, b.p.z - BESIDE, index, words);
        bool is_behind = is_one && depth_of(words) > b.p.z + BESIDE;
        b.column.next = is_behind ? b.column.end : b.column.next;
        id = texelFetch(abuffer_ids, index).x;
        is_new = is_one && !is_behind && id >= b.first_id && id < b.end_id && all(notEqual(uvec3(id), b.seen));
    }
    b.seen.yz = is_new ? uvec2(id, b.seen.y) : b.seen.yz;
    return is_new;
}

// Replaces the intersected sample by the sample of the triangle that the ray hits there, before `limit`. False: no
// triangle is hit.
//
// A ray passes beyond an edge behind which the surface turns back, and where it would hit the next triangle before its
// beginning. Without such evidence from neighbours, a sample's plane stands for its texel.
bool settle(trace_ray r, voxel_traversal w, float limit, inout abuffer_found found)
{
    int index = found.sample_index;
    uint id = texelFetch(abuffer_ids, index).x;
    int k = drawn_of(id);
    uvec4 drawn = texelFetch(abuffer_drawn, k);
    // A sphere has no edges.
    if ((drawn.w & DRAWN_SPHERES) != 0u)
        return found.is_within;
    samples_beside b;
    b.first_id = drawn.x;
    b.end_id = k + 1 < abuffer_drawn_count ? texelFetch(abuffer_drawn, k + 1).x : 0xffffffffu;
    b.seen = uvec3(id);
    vec3 lean = abs(sample_of(words_at(index), 2).normal);
    b.axis = lean.x >= lean.y && lean.x >= lean.z ? 0 : lean.y >= lean.z ? 1 : 2;
    b.p = in_image(w.ray.o + (found.end * w.ray.scale - w.ray.begin) * w.ray.d, b.axis);
    b.columns = 0;
    b.column = column_scan(0, 0, 0);
    vec4 rows[3] = instance_at(drawn.z).object_from_world;
    vec3 o = affine_point(rows, r.origin), d = affine_vector(rows, r.direction);
    float end = found.end + BESIDE_BEHIND / w.ray.scale;
    end = end < limit ? end : limit;
    line_intersection own;
    bool is_own = true, passes = false, is_hit = false, continues = true;
    // The loop breaks inside and not by its condition at the end: with that, llvmpipe let rays that had left the loop run
    // on with their neighbours.
    while (continues) {
        line_intersection c = intersect_line_triangle(o, d, id - drawn.y);
        if (is_own)
            own = c;
        bool is_inside = min_component(c.weights) >= 0.0, is_ahead = c.distance > r.t_min;
        bool same_way = c.from_behind == own.from_behind;
        is_hit = is_inside && is_ahead && c.distance < end;
        passes = passes || (same_way ? is_inside && !is_ahead : is_beyond_edge_of(own, c));
        if (is_hit) {
            found.end = c.distance;
            found.sample_index = index;
        }
        continues = !is_hit && !(is_own && is_inside) && next_beside(b, index, id);
        is_own = false;
    }
#ifdef ANY_HIT
    passes = passes || own.from_behind || w.s_limit - w.s_min < TRUSTED_WAY;
#endif
    return is_hit || !passes && found.is_within;
}

#endif

#ifndef ABUFFER_PARITY

const int PASSES_MAX = 8; // after these passes the sample's plane is the answer

// Searches the voxels along the rest of the ray.
void search_voxels(trace_ray r, inout voxel_traversal w, inout abuffer_found found)
{
    while (w.s < w.s_end) {
        found_voxel here = next_voxel(w);
#ifdef OFFERS_LATER
        found.met.first = 0;
        bool continues = here.what != 0u;
        while (continues) {
            found.met.count = 0;
            search_planes(r, w, found, here);
            offer_met(r, w, found);
            found.met.first += MET_MAX;
            continues = found.met.count > found.met.first;
        }
#else
        if (here.what != 0u)
            search_planes(r, w, found, here);
#endif
    }
}

#ifndef KEEPS_SAMPLE

void traverse_planes(trace_ray r, inout voxel_traversal w, inout abuffer_found found)
{
    search_voxels(r, w, found);
}

#else

// Distance beyond its texel at which a plane is tested at first.
#ifdef ANY_HIT
const float BEYOND_FIRST = ABUFFER_SLACK;
#else
const float BEYOND_FIRST = BEYOND;
#endif

bool is_verified(trace_ray r, voxel_traversal w, float limit, inout abuffer_found found)
{
#ifdef ANY_HIT
    bool is_near = w.s_limit - w.s_min < VERIFIED_WAY;
    return !is_near || settle(r, w, limit, found);
#else
    return settle(r, w, limit, found);
#endif
}

void traverse_planes(trace_ray r, inout voxel_traversal w, inout abuffer_found found)
{
    float s_end = w.s_end, s_limit = w.s_limit;
    abuffer_found nothing = found;
    bool continues;
    int passes = 0;
    w.beyond = BEYOND_FIRST;
    do {
        search_voxels(r, w, found);
        float s = w.s_limit;
        continues = found.sample_index >= 0 && !is_verified(r, w, nothing.end, found) && ++passes < PASSES_MAX;
        if (continues) {
            // A plane extended beyond its texel may have hidden the plane of the next texel at the same point.
            w.s_behind = found.is_within ? s + AGAIN : w.s_behind;
            w.beyond = found.is_within ? BEYOND_FIRST : ABUFFER_SLACK;
            w.s = s > w.s_min ? s : w.s_min;
            w.s_end = s_end;
            w.s_limit = s_limit;
            enter(w);
            found = nothing;
        }
    } while (continues);
#ifdef ANY_HIT
    found.optical_depth = found.sample_index >= 0 ? vec3(OPTICAL_DEPTH_MAX) : found.optical_depth;
#endif
}

#endif

#endif
