/* SPDX-License-Identifier: MIT */
/* Finds the features that a scene's materials and lights use. */
#include "render/context/features.h"

#include "shared/material.h"
#include "shared/path.h"

static bool has_specular(const struct scene_material *material)
{
    const float *colour = material->specular_colour;
    return material->specular != 1.0f || colour[0] != 1.0f || colour[1] != 1.0f || colour[2] != 1.0f ||
           material->textures[MATERIAL_SPECULAR].texture != 0 ||
           material->textures[MATERIAL_SPECULAR_COLOUR].texture != 0;
}

/* Mirrors of varnish and of what is no metal are strong at grazing angles alone. */
static bool is_clear(const struct scene_material *material)
{
    const bool textured = material->textures[MATERIAL_METALLIC_ROUGHNESS].texture != 0;
    const bool is_smooth = textured || material->roughness < PATH_STEPS_ROUGHNESS / PATH_STEPS;
    return material->alpha_mode == ALPHA_BLEND ||
           (is_smooth && (material->metallic > 0.5f || material->transmission > 0.5f));
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
        features.mirrors |= material->roughness < MIRROR_ROUGHNESS_GONE || material->transmission > 0.0f ||
                            material->textures[MATERIAL_METALLIC_ROUGHNESS].texture != 0 ||
                            material->alpha_mode == ALPHA_BLEND ||
                            (material->clearcoat > 0.0f && material->clearcoat_roughness < MIRROR_ROUGHNESS_GONE);
        features.clear |= is_clear(material);
        features.anisotropy |= material->anisotropy > 0.0f;
        features.specular |= has_specular(material);
        features.glass |= material->transmission > 0.0f;
        features.blend |= material->alpha_mode == ALPHA_BLEND;
        features.volume |= material->transmission > 0.0f && material->attenuation_distance > 0.0f;
        features.clearcoat |= material->clearcoat > 0.0f;
        features.sheen |= material->sheen[0] > 0.0f || material->sheen[1] > 0.0f || material->sheen[2] > 0.0f;
        features.iridescence |= material->iridescence > 0.0f;
        features.dispersion |= material->transmission > 0.0f && material->dispersion > 0.0f;
        features.thin_walls |= material->transmission > 0.0f && material->thin_walled;
        features.diffuse_transmission |= material->diffuse_transmission > 0.0f;
        features.anisotropy_map |=
            material->anisotropy > 0.0f && material->textures[MATERIAL_ANISOTROPY].texture != 0;
        features.bump |= material->textures[MATERIAL_BUMP].texture != 0;
    }
    for (size_t cursor = 0; hashmap_next(&scene->objects[OBJECT_LIGHT], &cursor, &id, &value);) {
        const struct scene_light *light = value;
        features.area_lights |= light->kind == LIGHT_RECTANGLE || light->kind == LIGHT_SPHERE;
    }
    return features;
}
