// SPDX-License-Identifier: MIT
// Samples of lights seen from a point. Units as in the protocol: intensity, irradiance or radiance by kind.
// Defines: HAS_AREA_LIGHTS some light is a rectangle or a sphere. LIGHT_GROUPS see render/light_layers.glsl.

#include "shared/bindings.h"
#include "shared/light.h"
#include "common/math.glsl"

layout(binding = UNIT_SHADE_LIGHTS) uniform samplerBuffer lights;

light light_at(uint index)
{
    int texel = int(index) * LIGHT_TEXELS;
    return light(texelFetch(lights, texel), texelFetch(lights, texel + 1), texelFetch(lights, texel + 2),
                 texelFetch(lights, texel + 3), texelFetch(lights, texel + 4));
}

uint group_of_light(uint index)
{
#ifdef LIGHT_GROUPS
    return uint(fract(texelFetch(lights, int(index) * LIGHT_TEXELS).w) * LIGHT_GROUPS_MAX);
#else
    return 0u;
#endif
}

struct light_sample {
    vec3 direction;  // unit, towards the light
    float distance_; // distance to the chosen point
    vec3 irradiance; // irradiance of a surface that faces the light, without shadows; 0: no light arrives
};

// KHR_lights_punctual: inverse square, fading to 0 at the range.
float light_falloff(float distance_, float range)
{
    float window = 1.0;
    if (range > 0.0) {
        float ratio = distance_ / range;
        window = clamp(1.0 - ratio * ratio * ratio * ratio, 0.0, 1.0);
    }
    return window / max(distance_ * distance_, 1e-12); // bounded, but very bright, at the light itself
}

// KHR_lights_punctual's smooth cone.
float light_cone(light l, vec3 direction)
{
    float scale = 1.0 / max(0.001, l.half_u_inner.w - l.half_v_outer.w);
    float x = clamp((dot(l.direction_range.xyz, -direction) - l.half_v_outer.w) * scale, 0.0, 1.0);
    return x * x;
}

#ifdef HAS_AREA_LIGHTS
light_sample light_sample_rectangle(light l, vec3 position, vec2 u)
{
    vec3 half_u = l.half_u_inner.xyz, half_v = l.half_v_outer.xyz;
    vec3 to_light = l.position_kind.xyz + (2.0 * u.x - 1.0) * half_u + (2.0 * u.y - 1.0) * half_v - position;
    float distance_ = length(to_light);
    vec3 direction = to_light / max(distance_, 1e-12);
    float area = 4.0 * length(cross(half_u, half_v));
    float facing = max(dot(l.direction_range.xyz, -direction), 0.0); // emits from one side only
    return light_sample(direction, distance_,
                        l.colour.rgb * (facing * area / max(distance_ * distance_, 1e-12)));
}

// Samples uniformly in the cone of directions that meet the sphere (Pharr, Jakob, Humphreys. Physically Based Rendering.
// 6.2.4). Inside the sphere there is no such cone, and no light arrives.
light_sample light_sample_sphere(light l, vec3 position, vec2 u)
{
    vec3 to_centre = l.position_kind.xyz - position;
    float centre_distance = length(to_centre), radius = l.colour.w;
    if (centre_distance <= radius || radius <= 0.0)
        return light_sample(vec3(0.0, 1.0, 0.0), 0.0, vec3(0.0));
    vec3 axis = to_centre / centre_distance;
    float sin2_max = radius * radius / (centre_distance * centre_distance);
    float one_minus_cos_max = sin2_max / (1.0 + sqrt(1.0 - sin2_max)); // without cancellation for far spheres
    float one_minus_cos = u.x * one_minus_cos_max;
    float sin2 = one_minus_cos * (2.0 - one_minus_cos);
    float sin_ = sqrt(max(sin2, 0.0)), phi = TWO_PI * u.y;
    vec3 s, t;
    tangent_frame(axis, s, t);
    vec3 direction = normalize(axis * (1.0 - one_minus_cos) + (s * cos(phi) + t * sin(phi)) * sin_);
    float reach = centre_distance * (1.0 - one_minus_cos) -
                  sqrt(max(radius * radius - centre_distance * centre_distance * sin2, 0.0));
    return light_sample(direction, reach, l.colour.rgb * (TWO_PI * one_minus_cos_max));
}

// Distance at which a ray (unit direction) hits an area light on its emitting side; -1: it misses. `probability`: the
// density per steradian with which light_sample_at() samples that direction from the ray's origin.
float light_meet(light l, vec3 origin, vec3 direction, out float probability)
{
    vec3 to_middle = l.position_kind.xyz - origin;
    probability = 0.0;
    if (int(l.position_kind.w) == LIGHT_KIND_RECTANGLE) {
        vec3 half_u = l.half_u_inner.xyz, half_v = l.half_v_outer.xyz, normal = l.direction_range.xyz;
        float facing = -dot(normal, direction), distance_ = -dot(normal, to_middle) / facing;
        vec3 from_middle = distance_ * direction - to_middle, across = cross(half_u, half_v);
        float area = dot(across, across); // squared area of a quarter of the light
        vec2 place = vec2(dot(cross(from_middle, half_v), across), dot(cross(half_u, from_middle), across)) / area;
        if (!(facing > 0.0 && distance_ > 0.0 && abs(place.x) <= 1.0 && abs(place.y) <= 1.0))
            return -1.0;
        probability = square(distance_) / (facing * 4.0 * sqrt(area));
        return distance_;
    }
    float middle2 = dot(to_middle, to_middle), radius2 = square(l.colour.w), along = dot(to_middle, direction);
    vec3 off = to_middle - along * direction;
    float inside = radius2 - dot(off, off);
    if (int(l.position_kind.w) != LIGHT_KIND_SPHERE || middle2 <= radius2 || along <= 0.0 || inside < 0.0)
        return -1.0;
    float sin2_max = radius2 / middle2;
    probability = 1.0 / (TWO_PI * (sin2_max / (1.0 + sqrt(1.0 - sin2_max))));
    return along - sqrt(inside);
}

// Density of a sample's direction; 0: the light has no extent, and only light_sample_at() finds it.
float light_probability(light l, light_sample sampled)
{
    int kind = int(l.position_kind.w);
    if (kind != LIGHT_KIND_RECTANGLE && kind != LIGHT_KIND_SPHERE)
        return 0.0;
    float shining = max_component(l.colour.rgb), arriving = max_component(sampled.irradiance);
    return arriving > 0.0 ? shining / arriving : 0.0; // radiance times this is irradiance
}
#endif

// Samples a light. `u`: two numbers in [0, 1) that choose the point of an area light.
light_sample light_sample_at(uint index, vec3 position, vec2 u)
{
    light l = light_at(index);
    int kind = int(l.position_kind.w);
    if (kind == LIGHT_KIND_DIRECTIONAL)
        return light_sample(-l.direction_range.xyz, 1e30, l.colour.rgb);
#ifdef HAS_AREA_LIGHTS
    if (kind == LIGHT_KIND_RECTANGLE)
        return light_sample_rectangle(l, position, u);
    if (kind == LIGHT_KIND_SPHERE)
        return light_sample_sphere(l, position, u);
#endif
    vec3 to_light = l.position_kind.xyz - position;
    float distance_ = length(to_light);
    vec3 direction = to_light / max(distance_, 1e-12);
    vec3 irradiance = l.colour.rgb;
    if (kind != LIGHT_KIND_STEADY)
        irradiance *= light_falloff(distance_, l.direction_range.w);
    if (kind == LIGHT_KIND_SPOT)
        irradiance *= light_cone(l, direction);
    return light_sample(direction, distance_, irradiance);
}
