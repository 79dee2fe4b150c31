/* SPDX-License-Identifier: MIT */
/* The features that a scene uses. Software GL runs both sides of every branch of a shader, so unused features are
 * left out by defines when the shader is compiled. */
#ifndef FARLIGHT_RENDER_CONTEXT_FEATURES_H
#define FARLIGHT_RENDER_CONTEXT_FEATURES_H

#include "scene/scene.h"

#include <stdbool.h>

struct scene_features {
    bool textures;             /* some material has a texture */
    bool bump;                 /* a texture is a bump map */
    bool area_lights;          /* some light is a rectangle or a sphere */
    bool anisotropy;           /* some material has a grain */
    bool specular;             /* some material's mirror differs from Fresnel's equations */
    bool glass;                /* some material lets light through */
    bool blend;                /* some is blended by its alpha */
    bool volume;               /* some body of glass absorbs light */
    bool clearcoat;            /* some material is varnished */
    bool sheen;                /* some is cloth */
    bool iridescence;          /* some has a thin film */
    bool dispersion;           /* some glass splits colours */
    bool thin_walls;           /* some glass has no body */
    bool diffuse_transmission; /* some material scatters light to its other side */
    bool anisotropy_map;       /* some grain differs from place to place */
    bool clear;                /* some material is mostly seen in a smooth mirror, or through it */
    bool mirrors;              /* some material sends a ray on: a smooth one, glass, a blended one */
};

struct scene_features scene_features_of(const struct scene *scene);

#endif
