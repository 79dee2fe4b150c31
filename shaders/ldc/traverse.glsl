// SPDX-License-Identifier: MIT
// Traversal of layered depth cubes (ldc/layout.h). Bürger, Hertel, Krüger, Westermann. GPU Rendering of Secondary
// Effects. 2007.
//
// The host (trace/ldc/trace.c) sets the defines of trace/wave.comp and those of the files included here.
//
// Define: LDC_CELLS the traversal is that of ldc/cells.glsl, else that of ldc/images.glsl.
#if defined LDC_CELLS && !defined ANY_HIT
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
    if (found.sample_index != HIT_NO_PRIMITIVE)
        a = candidate(found.end, found.sample_index, HIT_NO_PRIMITIVE - 1u, vec2(0.0));
#endif
}

// Traverses a cube up to the first intersection.
void traverse_cube(inout TRAVERSAL w, inout ldc_found found)
{
    while (w.s < w.s_end) {
#ifdef LDC_CELLS
        found_cell at = next_cell(w);
        if (at.entry != LDC_ENTRY_NONE) {
            test_cell(w, at, found);
        }
#else
        uvec4 words;
        float z_min, z_max;
        if (next_texel(w, words, z_min, z_max)) {
            test_texel(w, words, z_min, z_max, found);
        }
#endif
    }
}

void traverse(trace_ray r, inout answer a)
{
    ldc_found found = ldc_found_of(r, a);
    for (int pass = 0; pass < LDC_PASSES; pass++) {
        TRAVERSAL w;
        BEGIN(r, found.end, pass, w);
#ifdef LDC_EXACT
        ldc_found before = found;
        float s_end = w.s_end, s_limit = w.s_limit;
        found.sample_index = HIT_NO_PRIMITIVE;
        w.beside_max = LDC_BEYOND;
        bool continues = w.s < w.s_end;
        for (int tries = 0; continues; tries++) {
            traverse_cube(w, found);
            float s = w.s_limit;
            continues = found.sample_index != HIT_NO_PRIMITIVE && !settle(r, w, before.end, found) && tries < TRIES_MAX;
            if (continues) {
                found = ldc_found(before.end, HIT_NO_PRIMITIVE);
                w.s_limit = s_limit;
                advance(w, s, s_end);
            }
        }
        if (found.sample_index == HIT_NO_PRIMITIVE)
            found = before;
#else
        traverse_cube(w, found);
#endif
    }
    conclude(found, a);
}

// trace/wave.comp calls this for each ray.
#ifdef ANY_HIT

bool trace_any(trace_ray r, inout vec3 optical_depth)
{
    traverse(r, optical_depth);
    return min_component(optical_depth) >= OPTICAL_DEPTH_BLACK;
}

#else

void trace_closest(trace_ray r, inout candidate best)
{
    traverse(r, best);
}

#endif
