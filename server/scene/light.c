/* SPDX-License-Identifier: MIT */
/* Checks lights, cameras, textures and environments for conditions on more than one field. The decoder has
 * checked every field alone. */
#include "scene/edit.h"

bool light_check(const struct scene_light *light, const struct edit_place *place)
{
    if (light->value.kind == LIGHT_SPOT &&
        !(light->value.outer_cone >= light->value.inner_cone && light->value.outer_cone > 0.0f))
        return edit_error(place, ERROR_INVALID, ".outer_cone",
                          "%g must be above 0 and not less than the inner cone, which is %g",
                          (double)light->value.outer_cone, (double)light->value.inner_cone);
    if (light->value.kind == LIGHT_RECTANGLE && !(light->value.size[0] > 0.0f && light->value.size[1] > 0.0f))
        return edit_error(place, ERROR_INVALID, ".size", "a rectangle of %g x %g has no area",
                          (double)light->value.size[0], (double)light->value.size[1]);
    if (light->value.kind == LIGHT_SPHERE && !(light->value.size[0] > 0.0f))
        return edit_error(place, ERROR_INVALID, ".size", "the radius %g is not above 0",
                          (double)light->value.size[0]);
    return true;
}

bool camera_check(const struct scene_camera *camera, const struct edit_place *place)
{
    if (camera->value.fov_y > 0.0f || camera->value.height > 0.0f)
        return true;
    edit_error(place, ERROR_INVALID, ".height", "an orthographic camera shows a height above 0");
    return error_remedy(place->error, "set fov_y for a perspective camera or height for an orthographic one");
}

bool texture_check(const struct scene_texture *texture, const struct edit_place *place)
{
    const char *path = ".arrays[0] (texels)";
    if (!texture->value.width || !texture->value.height)
        return edit_error(place, ERROR_INVALID, texture->value.width ? ".height" : ".width",
                          "a texture has at least one texel");
    if (!texture->texels)
        return edit_error(place, ERROR_INVALID, path, "a texture needs this array");
    return array_size_check(texture->texels, (uint64_t)texture->value.width * texture->value.height, 4, path,
                            place);
}

static const char texels_path[] = ".arrays[0] (texels)";

bool environment_check_shape(const struct scene_environment *environment, const struct edit_place *place)
{
    const char *path = texels_path;
    if (!environment->texels) {
        if (environment->value.width || environment->value.height)
            return edit_error(place, ERROR_INVALID, path, "an image of %ux%u texels needs this array",
                              environment->value.width, environment->value.height);
        return true;
    }
    if (environment->value.backdrop)
        return edit_error(place, ERROR_INVALID, ".backdrop", "an image is a light; a backdrop is a colour alone");
    if (!environment->value.width || !environment->value.height)
        return edit_error(place, ERROR_INVALID, environment->value.width ? ".height" : ".width",
                          "an image has at least one texel");
    return array_size_check(environment->texels, (uint64_t)environment->value.width * environment->value.height, 8,
                            path, place);
}

bool environment_check_content(const struct scene_environment *environment, const struct edit_place *place)
{
    if (!environment->texels)
        return true;
    uint64_t texels = (uint64_t)environment->value.width * environment->value.height;
    const uint16_t *halves = (const uint16_t *)(const void *)environment->texels->data;
    const uint16_t exponent = 0x7c00; /* exponent with every bit set: infinity or NaN */
    for (uint64_t i = 0; i < texels * 4; i++) {
        /* The fourth half of a texel is unused. */
        if ((halves[i] & exponent) == exponent && i % 4 != 3)
            return edit_error(place, ERROR_INVALID, texels_path, "texel %llu of row %llu is not finite",
                              (unsigned long long)(i / 4 % environment->value.width),
                              (unsigned long long)(i / 4 / environment->value.width));
    }
    return true;
}
