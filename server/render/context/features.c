/* SPDX-License-Identifier: MIT */
/* Finds the features that a scene's materials and lights use. */
#include "render/context/features.h"

#include "shared/material.h"
#include "shared/path.h"

static bool has_specular(const struct scene_material *material)
{
    const float *colour = material->value.specular_colour;
    return material->value.specular != 1.0f || colour[0] != 1.0f || colour[1] != 1.0f || colour[2] != 1.0f ||
           material->textures[MATERIAL_SPECULAR].texture != 0 ||
           material->textures[MATERIAL_SPECULAR_COLOUR].texture != 0;
}

/* Mirrors of varnish and of dielectrics are strong at grazing angles only. */
static bool is_clear(const struct scene_material *material)
{
    const bool textured = material->textures[MATERIAL_METALLIC_ROUGHNESS].texture != 0;
    const bool is_smooth = textured || material->value.roughness < PATH_STEPS_ROUGHNESS / PATH_STEPS;
    return material->value.alpha_mode == ALPHA_BLEND ||
           (is_smooth && (material->value.metallic > 0.5f || material->value.transmission > 0.5f));
}

struct scene_features scene_features_of(const struct scene *scene)
{
    struct scene_features features = {0};
    uint64_t id;
    void *value;
    for (size_t cursor = 0; hashmap_next(&scene->objects[OBJECT_MATERIAL], &cursor, &id, &value);) {
        const struct scene_material *material = value;
        for (int i = 0; i < MATERIAL_TEXTURE_COUNT; i++)
            features.textures |= material->textures[i].texture != 0;
        features.mirrors |=
            material->value.roughness < MIRROR_ROUGHNESS_GONE || material->value.transmission > 0.0f ||
            material->textures[MATERIAL_METALLIC_ROUGHNESS].texture != 0 ||
            material->value.alpha_mode == ALPHA_BLEND ||
            (material->value.clearcoat > 0.0f && material->value.clearcoat_roughness < MIRROR_ROUGHNESS_GONE);
        features.clear |= is_clear(material);
        features.anisotropy |= material->value.anisotropy > 0.0f;
        features.specular |= has_specular(material);
        features.glass |= material->value.transmission > 0.0f;
        features.blend |= material->value.alpha_mode == ALPHA_BLEND;
        features.volume |= material->value.transmission > 0.0f && material->value.attenuation_distance > 0.0f;
        features.clearcoat |= material->value.clearcoat > 0.0f;
        features.sheen |=
            material->value.sheen[0] > 0.0f || material->value.sheen[1] > 0.0f || material->value.sheen[2] > 0.0f;
        features.iridescence |= material->value.iridescence > 0.0f;
        features.dispersion |= material->value.transmission > 0.0f && material->value.dispersion > 0.0f;
        features.thin_walls |= material->value.transmission > 0.0f && material->value.thin_walled;
        features.diffuse_transmission |= material->value.diffuse_transmission > 0.0f;
        features.anisotropy_map |=
            material->value.anisotropy > 0.0f && material->textures[MATERIAL_ANISOTROPY].texture != 0;
        features.bump |= material->textures[MATERIAL_BUMP].texture != 0;
    }
    for (size_t cursor = 0; hashmap_next(&scene->objects[OBJECT_LIGHT], &cursor, &id, &value);) {
        const struct scene_light *light = value;
        features.area_lights |= light->value.kind == LIGHT_RECTANGLE || light->value.kind == LIGHT_SPHERE;
    }
    return features;
}
