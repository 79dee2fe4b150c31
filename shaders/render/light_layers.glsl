// SPDX-License-Identifier: MIT
// Layers of light: each contribution to a sample's radiance is noted in one of them, or in two by the first surface's
// shares of scattering and reflection, so that their sum is the beauty. They follow the first surface that bends or
// scatters a path, and whether light has come there directly. A sample has at most one path. Light groups divide the same
// sum by the lights and emitters that the light comes from.
//
//   shading passes  note what they write to radiance[], by part_met() and part_asked(), as gather.comp does for light
//                   beyond the scene
//   shadow rays     have their part in `ray_part`, which the light sample's second vec4 brings to gather.comp
//   first surfaces  note their effect on the path, by note_first()
//
// Defines: LIGHT_LAYERS there are some; otherwise nothing here costs anything. LIGHT_GROUPS with it: some are light
// groups.

#include "shared/hit.h"
#include "shared/layers.h"
#include "shared/path.h"
#include "render/finite.glsl"

struct light_part {
    vec3 mirrored; // share of it that the first surface mirrors
    float kind;    // LIGHT_*
    uint group;    // group of the source; 0: none
};

#ifdef LIGHT_LAYERS
uniform uint light_layers; // the frame's layers, without the beauty
uniform uint plane_samples;

layout(std430, binding = BIND_LAYER_SUMS) buffer light_sum_block { vec4 light_sums[]; };

light_part ray_part = light_part(vec3(0.0), LIGHT_BEHIND, 0u); // part of the shadow ray that is made next

#ifdef LIGHT_GROUPS
uniform uint environment_group;
#endif

uint group_of_environment()
{
#ifdef LIGHT_GROUPS
    return environment_group;
#else
    return 0u;
#endif
}

uint place_in_layer(uint layer_bit, uint slot)
{
    return uint(bitCount(light_layers & layer_bit - 1u)) * plane_samples + slot;
}

uint place_of_first(uint slot)
{
    return uint(bitCount(light_layers)) * plane_samples + slot;
}

void add_to_layer(uint layer_bit, uint slot, vec3 light)
{
    if ((light_layers & layer_bit) != 0u)
        light_sums[place_in_layer(layer_bit, slot)].rgb += light;
}

// Encodes kind and group of a part as one number.
float code_of(light_part part)
{
    return part.kind + LIGHT_KINDS * float(part.group);
}

// Adds a contribution. `mirrored`: the mirrored part of the light.
void add_parts(uint slot, vec3 light, vec3 mirrored, float code)
{
    float group = floor(code / LIGHT_KINDS), kind = code - LIGHT_KINDS * group;
    light = finite(vec4(light, 0.0)).rgb;
    mirrored = min(finite(vec4(mirrored, 0.0)).rgb, light);
#ifdef LIGHT_GROUPS
    add_to_layer(LAYER_BIT_LIGHT_REST << uint(group), slot, light);
#endif
    if (kind <= LIGHT_INDIRECT) {
        bool direct = kind == LIGHT_DIRECT;
        add_to_layer(direct ? LAYER_BIT_DIFFUSE_DIRECT : LAYER_BIT_DIFFUSE_INDIRECT, slot, light - mirrored);
        add_to_layer(direct ? LAYER_BIT_SPECULAR_DIRECT : LAYER_BIT_SPECULAR_INDIRECT, slot, mirrored);
    } else {
        uint which = kind == LIGHT_EMITTED ? LAYER_BIT_EMISSION : LAYER_BIT_BACKGROUND;
        add_to_layer(kind == LIGHT_TRANSMITTED ? LAYER_BIT_TRANSMISSION : which, slot, light);
    }
}

light_part part_behind(path p, float kind, uint group)
{
    vec4 first = light_sums[place_of_first(p.sample_slot)];
    return light_part(first.rgb, first.w > 0.0 ? LIGHT_TRANSMITTED : kind, group);
}

// Part for light that the path's ray meets. `seen`: its kind if the eye sees it.
light_part part_met(path p, float seen, uint group)
{
    uint bounces = p.flags & PATH_BOUNCES_MASK;
    if (bounces == 0u)
        return light_part(vec3(0.0), seen, group);
    return part_behind(p, bounces == 1u ? LIGHT_DIRECT : LIGHT_INDIRECT, group);
}

// Part for light that arrives at the end of the path's ray. `mirrored`: the share of it that is mirrored there.
light_part part_asked(path p, vec3 mirrored, uint group)
{
    bool first = (p.flags & PATH_BOUNCES_MASK) == 0u;
    return first ? light_part(mirrored, LIGHT_DIRECT, group) : part_behind(p, LIGHT_INDIRECT, group);
}

void note_part(path p, light_part part, vec3 light)
{
    add_parts(p.sample_slot, light, light * part.mirrored, code_of(part));
}

void note_first(path p, vec3 mirrored, bool transmitted)
{
    if ((p.flags & PATH_BOUNCES_MASK) == 0u)
        light_sums[place_of_first(p.sample_slot)] = vec4(mirrored, transmitted ? 1.0 : 0.0);
}

// Share of reflected light that is not scattered.
vec3 share_mirrored(vec3 sent, vec3 scattered)
{
    return clamp(1.0 - scattered / max(sent, vec3(1e-30)), 0.0, 1.0);
}

// Share of a part in a sum.
vec3 share_of(vec3 part, vec3 sum)
{
    return clamp(part / max(sum, vec3(1e-30)), 0.0, 1.0);
}
#endif
