/* SPDX-License-Identifier: MIT */
/* Surface sample in four words: a sampled tracer stores it, and a hit with HIT_SAMPLED carries it (shared/hit.h).
 * Shares come from textures and vertex colours, filtered to the size of a sample; shading multiplies them by the
 * material's own values, so an edit of a material needs no new samples.
 *
 *   x  bits 0..23 base colour, r g b, sRGB, 8 bits each; 24..31 alpha
 *   y  shading normal, normal and bump maps applied; octahedral, 2 x 16 bit snorm, world space, to the outside
 *   z  bits 0..23 index into the materials; 24..27 share of metallic, 28..31 of transmission (of 15)
 *   w  bits 0..7 share of roughness, 8..15 of occlusion (strength applied); 16..20, 21..26, 27..31 r g b of the
 *      share of emission, square roots */
#ifndef FARLIGHT_SHARED_SURFACE_SAMPLE_H
#define FARLIGHT_SHARED_SURFACE_SAMPLE_H

#define SAMPLE_MATERIAL_MASK 0x00ffffffu
#define SAMPLE_METALLIC_SHIFT 24u
#define SAMPLE_TRANSMISSION_SHIFT 28u

#endif
