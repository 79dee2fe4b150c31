// SPDX-License-Identifier: MIT
// Weights of light that both a shadow ray and a child may find, by multiple importance sampling: Veach, Guibas. Optimally
// Combining Sampling Techniques for Monte Carlo Rendering. 1995, with the power heuristic.
//
// A child that hits an emitter has to know how its origin would have sampled it: the normal by which it chooses among
// them, and the ratio of the probability of sampling emitters to the density of the child's direction, as a code
// (PATH_RATIO_STEPS). Shadow rays round both in the same way, so that the weights add up to 1.
//
// Defines: those of common/emitter.glsl; EMITTERS_BY_DISTANCE hits do not say which emitter they are on, so both ways are
// weighed by a density that depends on the distance alone.

#include "shared/path.h"
#include "shared/ray.h"
#include "common/emitter.glsl"

// Weight of a technique, beside another one that might have found the same light.
float heuristic(float own, float other)
{
    float ratio = other / own;
    return own > 0.0 ? 1.0 / (1.0 + ratio * ratio) : 0.0;
}

#ifdef HAS_EMITTERS
ivec2 ray_normal_of(vec3 normal)
{
    return ivec2(round(octahedral_from_unit(normal) * PATH_NORMAL_MAX));
}

uint pack_ray_normal(vec3 normal)
{
    uvec2 bits = uvec2(ray_normal_of(normal)) & (1u << PATH_NORMAL_BITS) - 1u;
    return bits.x | bits.y << PATH_NORMAL_BITS;
}

vec3 unpack_ray_normal(uint bits)
{
    int width = int(PATH_NORMAL_BITS);
    ivec2 p = ivec2(bitfieldExtract(int(bits), 0, width), bitfieldExtract(int(bits), width, width));
    return unit_from_octahedral(vec2(p) / PATH_NORMAL_MAX);
}

// Upper estimate of the emitters' light. `behind`: probability of sampling those behind the surface.
float emitters_around(vec3 position, vec3 normal, float behind)
{
    float estimate = emitter_estimate(position, unpack_ray_normal(pack_ray_normal(normal)));
#ifdef HAS_DIFFUSE_TRANSMISSION
    estimate = mix(estimate, emitter_estimate(position, unpack_ray_normal(pack_ray_normal(-normal))), behind);
#endif
    return estimate;
}

uint ratio_code(float chance, float found)
{
    float steps = log2(max(chance, 1e-30) / found) * PATH_RATIO_STEPS + PATH_RATIO_ONE;
    return found > 0.0 && chance > 0.0 ? uint(clamp(steps + 0.5, 1.0, PATH_RATIO_MAX)) : 0u;
}

float ratio_of(uint code)
{
    return exp2((float(code) - PATH_RATIO_ONE) / PATH_RATIO_STEPS);
}

// Weight of a shadow ray's light, sampled with probability `chance`, where a child has the density `found`.
float emitter_share_asked(emitter_sample sampled, float chance, float found)
{
    float probability = sampled.probability;
#ifdef EMITTERS_BY_DISTANCE
    probability = emitter_rough_probability(sampled.distance_);
#endif
    return found > 0.0 ? heuristic(ratio_of(ratio_code(chance, found)) * probability, 1.0) : 1.0;
}

// Weight of the emission that a ray meets, as its origin may have sampled that already. `normal`: packed.
float emitter_share_met(uint code, uint normal, hit h, ray r, float time, vec3 emission)
{
#ifdef EMITTERS_BY_DISTANCE
    const uint LEFT_OUT = MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND | MATERIAL_UNLIT | MATERIAL_EMISSION_SEEN_ONLY;
    bool asked = code != 0u && (h.material & HIT_SAMPLED) != 0u &&
                 (material_at(h.material & HIT_MATERIAL_MASK).flags & LEFT_OUT) == 0u;
    float probability = asked ? emitter_rough_probability(h.distance) : 0.0;
#else
    bool asked = code != 0u && max_component(emission) > 0.0 && h.instance != HIT_NO_PRIMITIVE;
    float probability = emitter_probability(r.origin_t_min.xyz, unpack_ray_normal(normal), h.instance, h.primitive,
                                            r.direction_t_max.xyz, h.distance, time, asked);
#endif
    return probability > 0.0 ? heuristic(1.0, ratio_of(code) * probability) : 1.0;
}
#endif
