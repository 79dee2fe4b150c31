// SPDX-License-Identifier: MIT
// What a walk through A-buffers does with the samples that a ray crosses.
//
// Defines: those of trace.comp.
#include "shared/hit.h"
#include "abuffer/sample_primitive.glsl"
#include "abuffer/walk.glsl"

// What a ray has found, and up to where it is still looking.
struct abuffer_found {
    float end; // in lengths of the direction
#ifdef ANY_HIT
    vec3 taken;
#ifdef HAS_TRANSLUCENT
    // The last crossings of translucent surfaces, to tell one that two samples have from two: distances, greater than 0
    // where the ray came from behind, and materials.
    vec4 crossed;
    uvec4 materials;
#endif
#else
    int sample_index; // -1: none
#endif
};

#if defined ANY_HIT && !defined HAS_TRANSLUCENT
#define ANYTHING_ENDS // the first crossing is the answer, wherever it is
#endif

#ifdef ANY_HIT

// The ray crosses a sample at a distance between its t_min and found.end. `side` is positive where the ray comes from
// behind; `near` is a cell, as a distance.
void offer_sample(trace_ray r, inout abuffer_found found, int sample_index, float distance_, float side, float near)
{
#ifdef HAS_TRANSLUCENT
    candidate c = candidate_of_sample(sample_index, distance_);
    c.barycentrics = nearest_barycentrics(c, r.origin, r.direction);
    uint material_index = material_index_of(c);
    // Samples of one surface overlap by the slack, and where images meet by up to a cell.
    float signed_ = side > 0.0 ? distance_ : -distance_;
    bvec4 same = lessThan(abs(found.crossed - signed_), vec4(near));
    same = bvec4(uvec4(same) * uvec4(equal(found.materials, uvec4(material_index))));
    vec3 through = transmittance_of(c, r.origin, r.direction, 0.0);
    if (any(same) && through != vec3(0.0))
        return;
    found.crossed = vec4(signed_, found.crossed.xyz);
    found.materials = uvec4(material_index, found.materials.xyz);
    found.taken = min(found.taken + taken_by(through), vec3(TAKEN_ALL));
    if (least(found.taken) >= TAKEN_BLACK)
        found.end = -1.0;
#else
    found.taken = vec3(TAKEN_ALL);
    found.end = -1.0;
#endif
}

abuffer_found found_of(trace_ray r, vec3 taken)
{
#ifdef HAS_TRANSLUCENT
    return abuffer_found(r.t_max, taken, vec4(1e30), uvec4(HIT_NO_PRIMITIVE));
#else
    return abuffer_found(r.t_max, taken);
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
    return abuffer_found(best.distance, -1);
}

#endif

// At `s` of the walk.
void offer_at(trace_ray r, inout voxel_walk w, inout abuffer_found found, int sample_index, float s, float side)
{
    offer_sample(r, found, sample_index, (s + w.ray.begin) / w.ray.scale, side, 1.0 / w.ray.scale);
    w.s_limit = found.end * w.ray.scale - w.ray.begin;
    w.s_end = w.s_end < w.s_limit ? w.s_end : w.s_limit;
}
