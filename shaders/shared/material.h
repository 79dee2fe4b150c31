/* SPDX-License-Identifier: MIT */
/* Materials and textures of a scene on the device. */
#ifndef FARLIGHT_SHARED_MATERIAL_H
#define FARLIGHT_SHARED_MATERIAL_H
#include "shared/types.h"

/* A material. Index 0 is the default one: white, rough, dielectric. */
struct material {
    vec4 base_colour;  /* linear, alpha last */
    vec4 emission_ior; /* radiance; index of refraction */
    float metallic, roughness, transmission, alpha_cutoff;
    uint flags;                                                           /* MATERIAL_* */
    uint texture_base_colour, texture_normal, texture_metallic_roughness; /* index into texture_uses, 0: none */
    uint texture_occlusion, texture_emission, texture_transmission, texture_bump;
    float anisotropy, anisotropy_rotation; /* strength for rough reflections; radians from the tangent */
    uint id;                               /* the client's id; 0: the default material */
    uint texture_specular;
    /* Reflectance of a dielectric: colour and strength. */
    float specular_red, specular_green, specular_blue, specular;
    uint texture_specular_colour;
    float body_red, body_green, body_blue; /* share of shadow rays' light that one of the two surfaces of a body
                                              absorbs */
    float absorbs_red, absorbs_green, absorbs_blue; /* absorption of a body, 1 / metre */
    uint texture_anisotropy;
    float clearcoat, clearcoat_roughness; /* strength and roughness of the varnish */
    uint texture_clearcoat, texture_clearcoat_roughness;
    uint texture_clearcoat_normal, texture_iridescence, texture_iridescence_thickness;
    float dispersion; /* 20 / Abbe number */
    /* Strength and index of the film; thickness, nm. */
    float iridescence, iridescence_ior, iridescence_minimum, iridescence_maximum;
    float sheen_red, sheen_green, sheen_blue, sheen_roughness;
    uint texture_sheen, texture_sheen_roughness, texture_diffuse_transmission, texture_diffuse_transmission_colour;
    float diffuse_red, diffuse_green, diffuse_blue, diffuse_transmission; /* light scattered to the other side */
};
SHARED_SIZE(material, 240)
#define MATERIAL_ALPHA_MASK 1u
#define MATERIAL_ALPHA_BLEND 2u
#define MATERIAL_DOUBLE_SIDED 4u
#define MATERIAL_UNLIT 8u
#define MATERIAL_EMISSION_SEEN_ONLY 16u /* emission is visible only: a light shines in its place */
#define MATERIAL_THIN_WALLED 32u        /* light goes straight through it, without a body */
#define MATERIAL_TANGENT 64u            /* needs a tangent; from texture coordinates, where vertices have none */
#define MATERIAL_TANGENT_SECOND 128u    /* tangent of the second set of texture coordinates */

/* Use of a texture as an input of a material. Entry 0 is unused. */
struct texture_slot {
    vec4 uv_matrix;           /* a b d e:  u' = a u + b v + c,  v' = d u + e v + f */
    float offset_u, offset_v; /* c, f */
    float strength;
    uint texture; /* index into textures, bit 31: texture coordinate set 1 */
};
SHARED_SIZE(texture_slot, 32)

/* A texture. Texels of all textures lie in one texel buffer, RGBA8 unorm; the levels of a texture follow one
 * another, level n+1 is half of level n (rounded down, at least 1), down to 1x1. */
struct texture_info {
    uint first_texel, width, height, flags; /* TEXTURE_* */
};
SHARED_SIZE(texture_info, 16)
#define TEXTURE_SRGB 1u
#define TEXTURE_NEAREST 2u
#define TEXTURE_WRAP_U_SHIFT 2u /* two bits: 0 repeat, 1 clamp, 2 mirror */
#define TEXTURE_WRAP_V_SHIFT 4u
#define TEXTURE_LEVELS_SHIFT 8u /* number of levels, at least 1 */

/* Surfaces at least this rough have no mirror ray; slightly smoother ones a faint one. */
#define MIRROR_ROUGHNESS_GONE 0.5f

#endif
