// SPDX-License-Identifier: MIT
// Collects the samples that a ray intersects in a traversal of A-buffers.
//
// Defines: those of trace/wave.comp.
#include "shared/hit.h"
#include "common/intersected.glsl"
#include "abuffer/sample_primitive.glsl"
#include "abuffer/voxel_traversal.glsl"

#if defined ANY_HIT && !defined HAS_TRANSLUCENT
#define ANYTHING_ENDS // any intersection ends the ray, wherever it is
#endif
#if !defined ANY_HIT || defined ANYTHING_ENDS && !defined ABUFFER_PARITY
#define KEEPS_SAMPLE // the intersected sample is read again after the search
#endif

#if defined ANY_HIT && defined HAS_TRANSLUCENT && !defined ABUFFER_PARITY
#define OFFERS_LATER // intersections in a part of a voxel are offered after its search
#endif

#ifdef OFFERS_LATER
// Intersections that a search collects. Software GL executes a loop's whole body in every round, and evaluating a
// surface's transmittance takes longer than finding it. A part of a voxel with more than MET_MAX intersections is
// searched again.
struct abuffer_met {
    ivec4 samples;  // complement: the ray comes from behind
    vec4 distances;
    int first, count; // number of the first one that is collected; number in the part
};
const int MET_MAX = 4;
#endif

// The nearest sample found, and the end of the remaining search.
struct abuffer_found {
    float end; // in lengths of the direction
#ifdef ANY_HIT
    vec3 optical_depth;
#ifdef HAS_TRANSLUCENT
    intersected_surfaces intersected;
#endif
#ifdef OFFERS_LATER
    abuffer_met met;
#endif
#endif
#ifdef KEEPS_SAMPLE
    int sample_index; // -1: none
    bool is_within;   // the intersection is in the sample's texel, or at most ABUFFER_SLACK beside it
#endif
};

#ifdef ANY_HIT

// Records an intersection with a sample at a distance between t_min and found.end. `side` is positive if the ray comes
// from behind; `near` is a cell, as a distance.
void offer_sample(trace_ray r, inout abuffer_found found, int sample_index, float distance_, float side, float near)
{
#ifdef HAS_TRANSLUCENT
    candidate c = candidate_of_sample(sample_index, distance_);
    c.barycentrics = nearest_barycentrics(c, r.origin, r.direction);
    add_intersected(found.intersected, found.optical_depth, material_index_of(c), distance_, side, near,
                    transmittance_of(c, r.origin, r.direction, 0.0, r.t_min == RAY_STOPS_T_MIN));
    if (min_component(found.optical_depth) >= OPTICAL_DEPTH_BLACK)
        found.end = -1.0;
#elif defined KEEPS_SAMPLE
    found.end = distance_;
    found.sample_index = sample_index;
#else
    found.optical_depth = vec3(OPTICAL_DEPTH_MAX);
    found.end = -1.0;
#endif
}

abuffer_found found_of(trace_ray r, vec3 optical_depth)
{
#ifdef OFFERS_LATER
    return abuffer_found(r.t_max, optical_depth, intersected_nothing(), abuffer_met(ivec4(0), vec4(0.0), 0, 0));
#elif defined HAS_TRANSLUCENT
    return abuffer_found(r.t_max, optical_depth, intersected_nothing());
#elif defined KEEPS_SAMPLE
    return abuffer_found(r.t_max, optical_depth, -1, false);
#else
    return abuffer_found(r.t_max, optical_depth);
#endif
}

#else

void offer_sample(trace_ray r, inout abuffer_found found, int sample_index, float distance_, float side, float near)
{
    found.end = distance_;
    found.sample_index = sample_index;
}

abuffer_found found_of(trace_ray r, candidate best)
{
    return abuffer_found(best.distance, -1, false);
}

#endif

// Records an intersection at `s` of the traversal.
void offer_at(trace_ray r, inout voxel_traversal w, inout abuffer_found found, int sample_index, float s, float side)
{
    offer_sample(r, found, sample_index, (s + w.ray.begin) / w.ray.scale, side, 1.0 / w.ray.scale);
    w.s_limit = found.end * w.ray.scale - w.ray.begin;
    w.s_end = w.s_end < w.s_limit ? w.s_end : w.s_limit;
}

#ifdef OFFERS_LATER

void meet(inout abuffer_met met, int sample_index, float s, float side)
{
    bvec4 here = equal(ivec4(met.count - met.first), ivec4(0, 1, 2, 3));
    met.samples = mix(met.samples, ivec4(side > 0.0 ? ~sample_index : sample_index), here);
    met.distances = mix(met.distances, vec4(s), here);
    met.count++;
}

// Offers the collected intersections in the order in which they were found.
void offer_met(trace_ray r, inout voxel_traversal w, inout abuffer_found found)
{
    int left = min(found.met.count - found.met.first, MET_MAX);
    while (left > 0) {
        int index = found.met.samples.x;
        offer_at(r, w, found, index < 0 ? ~index : index, found.met.distances.x, index < 0 ? 1.0 : -1.0);
        found.met.samples = found.met.samples.yzww;
        found.met.distances = found.met.distances.yzww;
        left--;
    }
}

#endif
