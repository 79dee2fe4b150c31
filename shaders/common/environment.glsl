// SPDX-License-Identifier: MIT
// Radiance and irradiance of the infinitely distant environment, from the frame's uniforms.
// Defines: HAS_ENVIRONMENT_IMAGE its kind is ENVIRONMENT_IMAGE.

#include "shared/bindings.h"
#include "shared/sky.h"
#include "common/frame.glsl"
#include "common/math.glsl"

// Default sky of a scene without any light; server/render/light/environment.c integrates the same.
vec3 environment_sky(float up)
{
    bool below = up < 0.0;
    return mix(vec3(SKY_HORIZON), below ? vec3(SKY_GROUND) : vec3(SKY_ZENITH), below ? min(-up * SKY_GROUND_SLOPE, 1.0) : up);
}

// Place of a direction on an equirectangular image, 0..1: rows from +y down, the middle column is -z; turned about +y by
// w of the colour.
vec2 environment_place(vec3 direction)
{
    float c = cos(frame.environment_colour.w), s = sin(frame.environment_colour.w);
    vec3 d = vec3(c * direction.x - s * direction.z, direction.y, s * direction.x + c * direction.z);
    return vec2(azimuth(d.x, -d.z) / TWO_PI + 0.5, acos(clamp(d.y, -1.0, 1.0)) / PI);
}

// Rotates from the image's own axes to the world's.
vec3 environment_turned_back(vec3 d)
{
    float c = cos(frame.environment_colour.w), s = sin(frame.environment_colour.w);
    return vec3(c * d.x + s * d.z, d.y, c * d.z - s * d.x);
}

#ifdef HAS_ENVIRONMENT_IMAGE
// The shader filters, whatever the texture's own state is, as columns wrap and rows do not.
layout(binding = UNIT_ENVIRONMENT) uniform sampler2D environment_image;

vec3 environment_image_radiance(vec3 direction)
{
    ivec2 size = textureSize(environment_image, 0);
    vec2 texel = environment_place(direction) * vec2(size) - 0.5;
    ivec2 lower = ivec2(floor(texel));
    vec2 f = texel - vec2(lower);
    int x0 = (lower.x + size.x) % size.x, x1 = (lower.x + 1) % size.x;
    int y0 = clamp(lower.y, 0, size.y - 1), y1 = clamp(lower.y + 1, 0, size.y - 1);
    vec3 upper_row = mix(texelFetch(environment_image, ivec2(x0, y0), 0).rgb,
                         texelFetch(environment_image, ivec2(x1, y0), 0).rgb, f.x);
    vec3 lower_row = mix(texelFetch(environment_image, ivec2(x0, y1), 0).rgb,
                         texelFetch(environment_image, ivec2(x1, y1), 0).rgb, f.x);
    return mix(upper_row, lower_row, f.y);
}

#endif

vec3 environment_radiance(vec3 direction)
{
#ifdef HAS_ENVIRONMENT_IMAGE
    return environment_image_radiance(direction) * frame.environment_colour.rgb;
#endif
    if (frame.environment_kind == ENVIRONMENT_SKY)
        return environment_sky(direction.y);
    return frame.environment_kind != ENVIRONMENT_NONE ? frame.environment_colour.rgb : vec3(0.0);
}

// Whether the picture hides the environment behind its surfaces; mirrors and glass show it all the same.
bool environment_is_hidden()
{
    return frame.far_width.z != 0.0;
}

// Irradiance / pi on a surface with the normal n: the radiance of a white Lambert surface. Ramamoorthi and Hanrahan. An
// Efficient Representation for Irradiance Environment Maps. 2001; the constants of their equation 13 are folded into
// the coefficients.
vec3 environment_irradiance(vec3 n)
{
    vec3 sum = frame.irradiance[0].rgb + frame.irradiance[1].rgb * n.y + frame.irradiance[2].rgb * n.z +
               frame.irradiance[3].rgb * n.x + frame.irradiance[4].rgb * (n.x * n.y) +
               frame.irradiance[5].rgb * (n.y * n.z) + frame.irradiance[6].rgb * (3.0 * n.z * n.z - 1.0) +
               frame.irradiance[7].rgb * (n.x * n.z) + frame.irradiance[8].rgb * (n.x * n.x - n.y * n.y);
    return max(sum, vec3(0.0)); // order 2 rings below zero opposite to a small bright sun
}
