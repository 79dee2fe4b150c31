// SPDX-License-Identifier: MIT
// The traversal of layered depth cubes (ldc/layout.h). Bürger, Hertel, Krüger, Westermann. GPU Rendering of Secondary
// Effects. 2007.
//
// The host (trace/ldc/trace.c) sets, besides the defines of trace/wave.comp, those that the files included here name.
//
// One invocation traces PACKET_RAYS rays in sequence: fewer invocations, each with more work. (Letting each
// invocation begin its next ray as soon as one is finished was slower: the code that begins a ray then ran each round.)
//
// Define: LDC_CELLS the traversal is that of ldc/cells.glsl, else that of ldc/images.glsl.
#if defined LDC_CELLS && !defined LDC_TOLERANCE && !defined ANY_HIT && !defined LDC_COUNT_STEPS
#define LDC_EXACT
#endif
#include "ldc/exact.glsl"
#include "ldc/images.glsl"

#ifdef ANY_HIT
#define answer vec3
#else
#define answer candidate
#endif

#ifdef LDC_CELLS
const int LDC_PASSES = LDC_CUBES;
#define TRAVERSAL cell_traversal
#define BEGIN begin_cells
#else
const int LDC_PASSES = 3 * LDC_CUBES;
#define TRAVERSAL image_traversal
#define BEGIN begin_image
#endif

void conclude(ldc_found found, inout answer a)
{
#ifdef ANY_HIT
    a = found.optical_depth;
#else
#ifdef LDC_COUNT_STEPS
    a = candidate(float(ldc_counts.x), ldc_counts.z, ldc_counts.y, vec2(0.0));
    ldc_counts = uvec3(0u);
    return;
#endif
    if (found.sample_index != HIT_NO_PRIMITIVE)
        a = candidate(found.end, found.sample_index, HIT_NO_PRIMITIVE - 1u, vec2(0.0));
#endif
}

// Up to the first intersection.
void traverse_cube(inout TRAVERSAL w, inout ldc_found found)
{
    while (w.s < w.s_end) {
#ifdef LDC_CELLS
        found_cell at = next_cell(w);
        if (at.entry != LDC_ENTRY_NONE) {
            LDC_COUNT(y);
            test_cell(w, at, found);
        }
#else
        uvec4 words;
        float z_min, z_max;
        if (next_texel(w, words, z_min, z_max)) {
            LDC_COUNT(y);
            test_texel(w, words, z_min, z_max, found);
        }
#endif
    }
}

void traverse_rays(trace_ray rays_[PACKET_RAYS], inout answer answers[PACKET_RAYS])
{
    for (int ray = 0; ray < PACKET_RAYS; ray++) {
        trace_ray r = rays_[ray];
        ldc_found found = ldc_found_of(r, answers[ray]);
        for (int pass = 0; pass < LDC_PASSES; pass++) {
            TRAVERSAL w;
            BEGIN(r, found.end, pass, w);
#ifdef LDC_EXACT
            ldc_found before = found;
            float s_end = w.s_end, s_limit = w.s_limit;
            found.sample_index = HIT_NO_PRIMITIVE;
            w.beside_max = LDC_BEYOND;
            bool goes_on = w.s < w.s_end;
            for (int tries = 0; goes_on; tries++) {
                traverse_cube(w, found);
                float s = w.s_limit;
                goes_on = found.sample_index != HIT_NO_PRIMITIVE && !settle(r, w, before.end, found) && tries < TRIES_MAX;
                if (goes_on) {
                    found = ldc_found(before.end, HIT_NO_PRIMITIVE);
                    w.s_limit = s_limit;
                    go_on(w, s, s_end);
                }
            }
            if (found.sample_index == HIT_NO_PRIMITIVE)
                found = before;
#else
            traverse_cube(w, found);
#endif
        }
        conclude(found, answers[ray]);
    }
}

// Called by trace/wave.comp.
#if PACKET_RAYS > 1

#ifdef ANY_HIT
void trace_any_rays(trace_ray r[PACKET_RAYS], inout vec3 optical_depth[PACKET_RAYS])
#else
void trace_closest_rays(trace_ray r[PACKET_RAYS], inout candidate best[PACKET_RAYS])
#endif
{
#ifdef ANY_HIT
    traverse_rays(r, optical_depth);
#else
    traverse_rays(r, best);
#endif
}

#elif defined ANY_HIT

bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    trace_ray rays_[1] = trace_ray[1](r);
    vec3 answers[1] = vec3[1](optical_depth);
    traverse_rays(rays_, answers);
    optical_depth = answers[0];
    return min_component(optical_depth) >= OPTICAL_DEPTH_BLACK;
}

#else

void trace_closest(trace_ray r, inout candidate best)
{
    trace_ray rays_[1] = trace_ray[1](r);
    candidate answers[1] = candidate[1](best);
    traverse_rays(rays_, answers);
    best = answers[0];
}

#endif
