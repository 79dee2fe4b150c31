// SPDX-License-Identifier: MIT
// Chooses one of all lights by an estimate of its contribution.
// Defines: those of common/light.glsl and common/scattering.glsl.

#include "common/light.glsl"
#include "common/scattering.glsl"

// Properties of a surface that weigh its lights.
struct light_receiver {
    vec3 position, normal, view;
    float scattered, mirrored; // reflectances
    float alpha;               // roughness of the facets
    float passed;              // reflectance of light scattered from the other side
#ifdef HAS_CLEARCOAT
    vec3 coat_normal;
    float coat_mirrored, coat_alpha;
#endif
};

light_receiver light_receiver_of(surface s, split parts, vec3 position, vec3 view, float NoV)
{
    // A slanted mirror is dim at its own angle, but not at that of every facet: the estimate stays above 0.
    return light_receiver(position, s.normal, view, max_component(parts.scattered + parts.again + sheen_of(parts)) * INVERSE_PI,
                          (max_component(parts.mirror) + 1e-3) * 0.25 / max(NoV, 0.1),
                          square(max(blurring_roughness(s), ROUGHNESS_MIN_LIGHT)), max_component(passed_of(parts)) * INVERSE_PI
#ifdef HAS_CLEARCOAT
                          , s.coat_normal, parts.coat.mirrors * 0.25 / max(coat_cosine(s, view), 0.1),
                          square(max(s.coat_roughness, ROUGHNESS_MIN_LIGHT))
#endif
    );
}

// Highlight of GGX, widened by the light's extent (Karis. Real Shading in Unreal Engine 4. 2013).
float highlight_estimate(vec3 normal, vec3 half_way, float alpha)
{
    float NoH = max(dot(normal, half_way), 0.0), wide = alpha * alpha, spread = 1.0 + NoH * NoH * (wide - 1.0) + 1e-6;
    return wide / (PI * spread * spread);
}

// Estimates for a light before a point of it is chosen.
struct light_outlook {
    float scattered, mirrored; // unshadowed radiance at the eye, estimated: one is positive wherever the true one is
    float reach;               // radius of its extent, as a share of the distance to its centre
};

light_outlook light_outlook_of(uint index, light_receiver r)
{
    light l = light_at(index);
    int kind = int(l.position_kind.w);
    bool directional = kind == LIGHT_KIND_DIRECTIONAL;
    vec3 to_light = directional ? -l.direction_range.xyz : l.position_kind.xyz - r.position;
    float squared = max(dot(to_light, to_light), 1e-12), inverse = inversesqrt(squared);
    vec3 direction = to_light * inverse;
    float power = l.colour.r + l.colour.g + l.colour.b, cosine = dot(r.normal, direction), reach = 0.0;
    if (!directional && kind != LIGHT_KIND_STEADY)
        power *= light_falloff(squared * inverse, l.direction_range.w);
    if (kind == LIGHT_KIND_SPOT)
        power *= light_cone(l, direction);
#ifdef HAS_AREA_LIGHTS
    if (kind == LIGHT_KIND_RECTANGLE) {
        float radius = length(l.half_u_inner.xyz) + length(l.half_v_outer.xyz);
        power *= max(-dot(l.direction_range.xyz, direction), 0.0) * radius * radius;
        reach = radius * inverse;
    } else if (kind == LIGHT_KIND_SPHERE) {
        power *= PI * l.colour.w * l.colour.w;
        reach = l.colour.w * inverse;
    }
#endif
    vec3 half_way = normalize(direction + r.view);
    float highlight = r.mirrored * highlight_estimate(r.normal, half_way, r.alpha + 0.5 * reach);
#ifdef HAS_CLEARCOAT
    highlight += r.coat_mirrored * highlight_estimate(r.coat_normal, half_way, r.coat_alpha + 0.5 * reach);
    cosine = max(cosine, dot(r.coat_normal, direction));
#endif
    light_outlook outlook = light_outlook(0.0, 0.0, reach);
    if (cosine + reach > 0.0) {
        outlook.scattered = power * r.scattered * min(cosine + reach, 1.0);
        outlook.mirrored = power * highlight;
    }
#ifdef HAS_DIFFUSE_TRANSMISSION
    outlook.scattered += power * r.passed * clamp(reach - dot(r.normal, direction), 0.0, 1.0);
#endif
    return outlook;
}

float light_estimate(uint index, light_receiver r)
{
    light_outlook outlook = light_outlook_of(index, r);
    return outlook.scattered + outlook.mirrored;
}

// Probability of choosing a light rather than an emitter, where there are both (common/emitter.glsl). The estimates of
// both are rough, so neither is chosen in less than a tenth of all cases.
float lights_share(light_receiver r, float all_lights, float emitters)
{
    const float SHARE_MIN = 0.1;
    float other = emitters * (r.scattered + r.mirrored), share = all_lights / max(all_lights + other, 1e-30);
    return all_lights > 0.0 ? (other > 0.0 ? clamp(share, SHARE_MIN, 1.0 - SHARE_MIN) : 1.0) : 0.0;
}

// Chooses a light with a probability in proportion to its estimate. `number` in [0, 1) chooses it and is stretched to [0,
// 1) again. Probability 0: no light arrives here.
uint light_choose(light_receiver r, uint light_count, inout float number, out float probability, out float sum)
{
    uint chosen = 0u;
    float own = 0.0;
    sum = 0.0;
    // Each light gets the lower end of the interval left by the ones before it.
    for (uint i = 0u; i < light_count; i++) {
        float estimate = light_estimate(i, r);
        sum += estimate;
        float share = estimate > 0.0 ? estimate / sum : 0.0;
        bool taken = number < share;
        number = min(taken ? number / share : (number - share) / (1.0 - share), 0.99999994);
        chosen = taken ? i : chosen;
        own = taken ? estimate : own;
    }
    probability = own > 0.0 ? own / sum : 0.0;
    return chosen;
}
