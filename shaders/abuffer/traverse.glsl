// SPDX-License-Identifier: MIT
// Traversal of voxels and A-buffers (abuffer/layout.h). Hu, Huang, Zhang, Yuan, Li. Ray Tracing via GPU Rasterization.
// 2014.
//
// The host (trace/abuffer/trace.c) sets the defines of trace/wave.comp and those of the files included here.
//
// Defines: ABUFFER_PARITY the search is the paper's (abuffer/parity.glsl), else by planes (abuffer/planes.glsl), verified with
// triangles (abuffer/exact.glsl); ABUFFER_EMPTY the scene has no samples.
#include "abuffer/exact.glsl"
#include "abuffer/parity.glsl"

void traverse_ray(trace_ray r, inout abuffer_found found)
{
#ifndef ABUFFER_EMPTY
    voxel_traversal w;
    begin_traversal(r, found.end, w);
#ifdef ABUFFER_PARITY
    traverse_parity(r, w, found);
#else
    traverse_planes(r, w, found);
#endif
#endif
}

// trace/wave.comp calls this for each ray.
#ifdef ANY_HIT

bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    abuffer_found found = found_of(r, optical_depth);
    traverse_ray(r, found);
    optical_depth = found.optical_depth;
    return min_component(optical_depth) >= OPTICAL_DEPTH_BLACK;
}

#else

void trace_closest(trace_ray r, inout candidate best)
{
    abuffer_found found = found_of(r, best);
    traverse_ray(r, found);
    if (found.sample_index >= 0)
        best = candidate(found.end, uint(found.sample_index), HIT_NO_PRIMITIVE - 1u, vec2(0.0));
}

#endif
