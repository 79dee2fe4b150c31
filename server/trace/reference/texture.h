/* SPDX-License-Identifier: MIT */
/* Texture lookup of shaders/common/texture.glsl at the finest level, on the host's texels. */
#ifndef FARLIGHT_TRACE_REFERENCE_TEXTURE_H
#define FARLIGHT_TRACE_REFERENCE_TEXTURE_H

struct opacity_texture;

/* `uv`: both sets of texture coordinates. Leaves `texel` alone where there is no texture. */
void reference_texture_sample(const struct opacity_texture *texture, const float uv[2][2], float texel[4]);

#endif
