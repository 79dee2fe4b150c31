// SPDX-License-Identifier: MIT
// Material of the surface at a hit, with its textures.
//
// A back face of an opaque material is shaded as if it were two-sided, double_sided or not: a hole in a model would
// surprise more than a visible inside. Only glass distinguishes its sides.
//
// Software GL runs both sides of every branch, so defines leave out features that the scene lacks, and all textures of a
// material are sampled in one place, in a loop.
//
// Defines: NO_GLASS no material lets light through; NO_BLEND none is blended;
// HAS_TEXTURES some material has a texture; HAS_BUMP one of them is a bump map; HAS_SPECULAR some dielectric's
// reflectance differs from Fresnel's equations; HAS_VOLUME some body of glass absorbs light; HAS_CLEARCOAT some surface
// is varnished; HAS_IRIDESCENCE some has a thin film; HAS_SHEEN some is cloth; HAS_DIFFUSE_TRANSMISSION some scatters
// light to its other side; HAS_DISPERSION some glass splits colours; HAS_THIN_WALLS some glass has no body;
// HAS_ANISOTROPY some material has a grain, HAS_ANISOTROPY_MAP some grain is a texture; HAS_SPHERES; HAS_SAMPLED the hits
// of the wave are stored samples, except those of discs.

#include "shared/hit.h"
#include "common/cone.glsl"
#include "common/hit_colour.glsl"
#include "common/sampled.glsl"
#include "common/detail.glsl"
#include "common/relief.glsl"

struct surface {
    vec3 position;
    vec3 geometric; // unit normals, world space, on the viewer's side
    vec3 normal;    // shading normal; may lean away from the viewer
    vec3 base;
    float alpha;    // opacity; 1 unless it is blended
    vec3 emission;
    float metallic, roughness, transmission, ior, occlusion;
#ifdef HAS_VOLUME
    vec3 absorption; // absorption of the body behind the surface, 1 / metre
#endif
#ifdef HAS_SPECULAR
    vec3 specular_colour; // colour of a dielectric's mirror, seen from above
    float specular;       // its strength
#endif
#ifdef HAS_CLEARCOAT
    vec3 coat_normal;     // shading normal of the varnish
    float coat, coat_roughness;
#endif
#ifdef HAS_IRIDESCENCE
    float film, film_ior, film_nm; // share and thickness of a thin film
#endif
#ifdef HAS_SHEEN
    vec3 sheen;
    float sheen_roughness;
#endif
#ifdef HAS_DIFFUSE_TRANSMISSION
    vec3 diffuse_colour;  // colour of light scattered to the other side
    float diffuse_transmission;
#endif
#ifdef HAS_DISPERSION
    float dispersion;     // 20 / Abbe number
    vec3 carried;         // weight of the path that reaches the surface
#endif
#ifdef HAS_THIN_WALLS
    bool thin;            // light passes straight through it
#endif
#ifdef HAS_ANISOTROPY
    vec3 grain;           // direction relative to the tangent, and strength
    vec3 along;           // grain direction: unit, world space, across `normal`
#endif
    float curvature; // 1 / metre, above 0: it bulges towards the viewer; 0 if there are no textures to be filtered
    bool unlit;
    bool emission_seen_only;
    bool inside;    // seen from behind
};

bool is_thin(surface s)
{
#ifdef HAS_THIN_WALLS
    return s.thin;
#endif
    return false;
}

// Whether the surface is glass, seen from inside of its body.
bool in_glass(surface s)
{
#ifdef NO_GLASS
    return false;
#endif
    return s.inside && s.transmission > 0.0 && !is_thin(s);
}

// Index behind / index before, for refracted light.
float index_ratio(surface s)
{
    return is_thin(s) ? 1.0 : s.inside ? 1.0 / s.ior : s.ior;
}

// Factor by which mirrored or refracted light turns with the facet. The window of a thin wall spreads light as its mirror
// does.
float turn_of(surface s, bool mirrored)
{
    return facet_turn(index_ratio(s), mirrored || is_thin(s));
}

#ifdef HAS_DISPERSION
// KHR_materials_dispersion: the indices of red, green and blue.
vec3 channel_iors(surface s)
{
    return max(s.ior + (s.ior - 1.0) * 0.025 * s.dispersion * vec3(-1.0, 0.0, 1.0), 1.0);
}
#endif

// Footprint of a ray's cone on a surface: on a slanted one it is longer in the plane of incidence. Akenine-Moeller et al.
// 2021 (common/cone.glsl), section 5.
mat2x3 footprint_edges(vec3 geometric, vec3 direction, float width)
{
    float slant = max(abs(dot(geometric, direction)), 0.01);
    vec3 across = cross(geometric, direction), unused;
    float squared = dot(across, across);
    if (squared > 1e-8)
        across *= inversesqrt(squared);
    else
        tangent_frame(geometric, across, unused);
    return mat2x3(cross(across, geometric) * (width / slant), across * width);
}

#ifdef HAS_TEXTURES
// Number of inputs of each feature.
#ifdef HAS_SPECULAR
#define INPUTS_SPECULAR 2
#else
#define INPUTS_SPECULAR 0
#endif
#ifdef HAS_CLEARCOAT
#define INPUTS_CLEARCOAT 3
#else
#define INPUTS_CLEARCOAT 0
#endif
#ifdef HAS_IRIDESCENCE
#define INPUTS_IRIDESCENCE 2
#else
#define INPUTS_IRIDESCENCE 0
#endif
#ifdef HAS_SHEEN
#define INPUTS_SHEEN 2
#else
#define INPUTS_SHEEN 0
#endif
#ifdef HAS_DIFFUSE_TRANSMISSION
#define INPUTS_DIFFUSE 2
#else
#define INPUTS_DIFFUSE 0
#endif

#ifdef HAS_ANISOTROPY_MAP
// KHR_materials_anisotropy: turns the grain by the texture's direction, and weakens it by the texture's strength.
// Directions are complex numbers.
vec3 turned_grain(vec3 grain, vec3 texel, hit h, texture_slot slot)
{
    vec2 turn = turned_by_slot(h, slot, texel.rg * 2.0 - 1.0);
    turn = dot(turn, turn) > 1e-6 ? normalize(turn) : vec2(1.0, 0.0);
    return vec3(grain.x * turn.x - grain.y * turn.y, grain.x * turn.y + grain.y * turn.x, grain.z * texel.b);
}
#endif

// Replaces the inputs that have textures, normal and bump maps included.
void apply_textures(inout surface s, inout vec4 colour, hit h, material m, vec4 uv01,
                    texture_footprint footprint)
{
    const int BASE_COLOUR = 0, NORMAL = 1, METALLIC_ROUGHNESS = 2, OCCLUSION = 3, EMISSION = 4, TRANSMISSION = 5,
              SPECULAR = 6, SPECULAR_COLOUR = 7, COAT = SPECULAR + INPUTS_SPECULAR, COAT_ROUGHNESS = COAT + 1,
              COAT_NORMAL = COAT + 2, FILM = COAT + INPUTS_CLEARCOAT, FILM_THICKNESS = FILM + 1,
              SHEEN = FILM + INPUTS_IRIDESCENCE, SHEEN_ROUGHNESS = SHEEN + 1, DIFFUSE = SHEEN + INPUTS_SHEEN,
              DIFFUSE_COLOUR = DIFFUSE + 1, GRAIN = DIFFUSE + INPUTS_DIFFUSE;
    uint uses[] = uint[](m.texture_base_colour, m.texture_normal, m.texture_metallic_roughness, m.texture_occlusion,
                         m.texture_emission, m.texture_transmission
#ifdef HAS_SPECULAR
                         , m.texture_specular, m.texture_specular_colour
#endif
#ifdef HAS_CLEARCOAT
                         , m.texture_clearcoat, m.texture_clearcoat_roughness, m.texture_clearcoat_normal
#endif
#ifdef HAS_IRIDESCENCE
                         , m.texture_iridescence, m.texture_iridescence_thickness
#endif
#ifdef HAS_SHEEN
                         , m.texture_sheen, m.texture_sheen_roughness
#endif
#ifdef HAS_DIFFUSE_TRANSMISSION
                         , m.texture_diffuse_transmission, m.texture_diffuse_transmission_colour
#endif
#ifdef HAS_ANISOTROPY_MAP
                         , m.texture_anisotropy
#endif
    );
    uint used = 0u;
#ifdef HAS_CLEARCOAT
    vec3 unmapped = s.normal;
#endif
    for (int i = 0; i < uses.length(); i++)
        used |= uses[i] != 0u ? 1u << i : 0u;
    while (used != 0u) { // visits used inputs only: in a loop over all, software GL would sample for the unused ones too
        int i = findLSB(used);
        used &= used - 1u;
        texture_slot slot = texture_slot_at(uses[i]);
        vec4 texel = sample_slot_filtered(slot, uv01, footprint);
        if (i == BASE_COLOUR) {
            colour *= texel;
        } else if (i == NORMAL) {
            if ((h.material & HIT_HAS_TANGENT) != 0u)
                s.normal = mapped_normal(h, s.normal, texel.xyz, slot);
        } else if (i == METALLIC_ROUGHNESS) {
            s.metallic *= texel.b;
            s.roughness *= texel.g;
        } else if (i == OCCLUSION) {
            s.occlusion = mix(1.0, texel.r, slot.strength);
        } else if (i == EMISSION) {
            s.emission *= texel.rgb;
#ifdef HAS_SPECULAR
        } else if (i == SPECULAR) {
            s.specular *= texel.a;
        } else if (i == SPECULAR_COLOUR) {
            s.specular_colour *= texel.rgb;
#endif
#ifdef HAS_CLEARCOAT
        } else if (i == COAT) {
            s.coat *= texel.r;
        } else if (i == COAT_ROUGHNESS) {
            s.coat_roughness *= texel.g;
        } else if (i == COAT_NORMAL) {
            if ((h.material & HIT_HAS_TANGENT) != 0u)
                s.coat_normal = mapped_normal(h, unmapped, texel.xyz, slot);
#endif
#ifdef HAS_IRIDESCENCE
        } else if (i == FILM) {
            s.film *= texel.r;
        } else if (i == FILM_THICKNESS) {
            s.film_nm = mix(m.iridescence_minimum, m.iridescence_maximum, texel.g);
#endif
#ifdef HAS_SHEEN
        } else if (i == SHEEN) {
            s.sheen *= texel.rgb;
        } else if (i == SHEEN_ROUGHNESS) {
            s.sheen_roughness *= texel.a;
#endif
#ifdef HAS_DIFFUSE_TRANSMISSION
        } else if (i == DIFFUSE) {
            s.diffuse_transmission *= texel.a;
        } else if (i == DIFFUSE_COLOUR) {
            s.diffuse_colour *= texel.rgb;
#endif
#ifdef HAS_ANISOTROPY_MAP
        } else if (i == GRAIN) {
            s.grain = turned_grain(s.grain, texel.rgb, h, slot);
#endif
        } else {
            s.transmission *= texel.r;
        }
    }
#ifdef HAS_BUMP
    if (m.texture_bump != 0u)
        s.normal = bump_normal(h, m.texture_bump, s.normal, uv01, footprint);
#endif
}
#endif

#ifdef HAS_SAMPLED
// Applies the sample's stored values in place of textures and vertex colours.
void apply_sample(inout surface s, inout vec4 colour, material m, uvec4 words)
{
    surface_sample stored = unpack_sample(words);
    colour *= stored.base_colour;
    s.metallic *= stored.metallic;
    s.roughness *= stored.roughness;
    s.transmission *= stored.transmission;
    s.occlusion = stored.occlusion;
    s.emission *= stored.emission;
#ifdef HAS_SPECULAR
    if (m.texture_specular_colour != 0u) // samples do not store it, and its factor alone is meaningless
        s.specular_colour = vec3(1.0);
#endif
}
#endif

#ifdef HAS_ANISOTROPY
// Direction of the grain; an arbitrary one at a point without a tangent.
vec3 along_grain(hit h, surface s)
{
    vec3 x, y;
    tangent_frame(s.normal, x, y);
    if ((h.material & HIT_HAS_TANGENT) != 0u) {
        vec4 tangent = unpack_tangent(h.tangent);
        vec3 along = tangent.xyz - dot(tangent.xyz, s.normal) * s.normal;
        float squared = dot(along, along);
        if (squared > 1e-8) {
            x = along * inversesqrt(squared);
            y = cross(s.normal, x) * (s.inside ? -tangent.w : tangent.w);
        }
    }
    return s.grain.x * x + s.grain.y * y;
}
#endif

// Surface at a hit. `width`: of the ray's cone there.
surface surface_at(hit h, vec3 origin, vec3 direction, float width)
{
    material m = material_at(h.material & HIT_MATERIAL_MASK);
    vec4 uv01 = uintBitsToFloat(h.uv01_or_sample);
    surface s;
    s.position = origin + h.distance * direction;
    s.geometric = unpack_unit(h.normal_geometric);
    s.normal = unpack_unit(h.normal_shading);
    s.inside = (h.material & HIT_BACK_FACE) != 0u;
    s.unlit = (m.flags & MATERIAL_UNLIT) != 0u;
    s.emission_seen_only = (m.flags & MATERIAL_EMISSION_SEEN_ONLY) != 0u;
    s.emission = m.emission_ior.rgb;
    s.ior = m.emission_ior.w;
    s.metallic = m.metallic;
    s.roughness = m.roughness;
    s.transmission = m.transmission;
    s.occlusion = 1.0;
#ifdef HAS_VOLUME
    s.absorption = vec3(m.absorbs_red, m.absorbs_green, m.absorbs_blue);
#endif
#ifdef HAS_SPECULAR
    s.specular_colour = vec3(m.specular_red, m.specular_green, m.specular_blue);
    s.specular = m.specular;
#endif
#ifdef HAS_CLEARCOAT
    s.coat_normal = s.normal;
    s.coat = m.clearcoat;
    s.coat_roughness = m.clearcoat_roughness;
#endif
#ifdef HAS_IRIDESCENCE
    s.film = m.iridescence;
    s.film_ior = m.iridescence_ior;
    s.film_nm = m.iridescence_maximum;
#endif
#ifdef HAS_SHEEN
    s.sheen = vec3(m.sheen_red, m.sheen_green, m.sheen_blue);
    s.sheen_roughness = m.sheen_roughness;
#endif
#ifdef HAS_DIFFUSE_TRANSMISSION
    s.diffuse_colour = vec3(m.diffuse_red, m.diffuse_green, m.diffuse_blue);
    s.diffuse_transmission = m.diffuse_transmission;
#endif
#ifdef HAS_DISPERSION
    s.dispersion = m.dispersion;
    s.carried = vec3(1.0);
#endif
#ifdef HAS_THIN_WALLS
    s.thin = (m.flags & MATERIAL_THIN_WALLED) != 0u;
#endif
#ifdef HAS_ANISOTROPY
    s.grain = vec3(cos(m.anisotropy_rotation), sin(m.anisotropy_rotation), m.anisotropy);
#endif
    vec4 colour = m.base_colour * unpack_hit_colour(h.colour);
    bool is_stored = false;
    s.curvature = 0.0;
#ifdef HAS_SAMPLED
    is_stored = (h.material & HIT_SAMPLED) != 0u;
    if (is_stored)
        apply_sample(s, colour, m, h.uv01_or_sample);
#endif
#ifdef HAS_TEXTURES
    surface_detail detail = detail_at(h, footprint_edges(s.geometric, direction, width));
    s.curvature = s.inside ? -detail.curvature : detail.curvature;
    if (!is_stored)
        apply_textures(s, colour, h, m, uv01, detail.footprint);
#endif
#ifdef NO_GLASS
    s.transmission = 0.0; // already 0: lets the compiler know
#endif
    s.base = clamp(colour.rgb, vec3(0.0), vec3(1.0));
    s.alpha = 1.0;
#ifndef NO_BLEND
    if ((m.flags & MATERIAL_ALPHA_BLEND) != 0u)
        s.alpha = clamp(colour.a, 0.0, 1.0);
#endif
    if (s.inside) {
        s.geometric = -s.geometric;
        s.normal = -s.normal;
#ifdef HAS_CLEARCOAT
        s.coat_normal = -s.coat_normal;
#endif
    }
#ifdef HAS_ANISOTROPY
    s.along = along_grain(h, s);
#endif
    if (in_glass(s)) { // the inside of glass has neither
#ifdef HAS_SHEEN
        s.sheen = vec3(0.0);
#endif
#ifdef HAS_DIFFUSE_TRANSMISSION
        s.diffuse_transmission = 0.0;
#endif
    }
    return s;
}
