// SPDX-License-Identifier: MIT
// Shades the ground, a shadow catcher: the background behind it, times the share of light that reaches it. The share is
// the radiance of a white Lambert surface with shadows, divided by that without: Debevec's differential rendering
// (Rendering Synthetic Objects into Real Scenes. 1998) with a quotient in place of a difference. Runs after the
// integrator's own shading, and replaces its results for these hits.
//
//   radiance    black, which covers
//   shadow rays subtract their shares of coverage, and show the background: w of their light sample is below 0
//   children    none
//
// Defines, one of them:
//   EVERY_LIGHT one shadow ray to every light; the environment's irradiance, which has no shadows there, lights it too
//   ONE_LIGHT   some, each to a source chosen by its light: a light, an emitter, a direction of the environment. All have
//               equal parts of the light: without occluders there is no noise
//   OPEN        those of ao.comp
// and those of common/light.glsl, common/emitter.glsl, common/environment_choice.glsl and render/shade.glsl.

#include "common/emitter.glsl"
#include "common/environment_choice.glsl"
#include "common/light.glsl"
#include "common/occlusion.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

uniform uint first_ray, batch_rays;
uniform uint own_rays;        // shadow rays that the integrator itself makes for each hit
uniform float reach, falloff; // OPEN: see common/occlusion.glsl

const vec4 COVERED = vec4(0.0, 0.0, 0.0, 1.0);
// Number of candidates for a direction of the environment, or a place on an emitter: chosen by their light (Talbot,
// Cline, Egbert. Importance Resampling for Global Illumination. 2005). With more of them, the share is more exact.
const uint CANDIDATES = 4u;

// Light behind the ground along a ray that continues without it: render/left_scene.glsl.
vec4 behind(vec3 direction)
{
    if (environment_is_hidden())
        return vec4(0.0);
#ifdef OPEN
    vec3 arriving = vec3(1.0);
#else
    vec3 arriving = environment_radiance(direction);
#endif
    return vec4(arriving, frame.environment_kind != ENVIRONMENT_NONE ? 1.0 : 0.0);
}

float mean_of(vec3 v)
{
    return dot(v, vec3(1.0 / 3.0));
}

// Irradiance of a direction, as a light's radiance on a white Lambert surface.
float lambert(vec3 normal, vec3 direction, vec3 irradiance)
{
    return max(dot(normal, direction), 0.0) * mean_of(irradiance) * INVERSE_PI;
}

// Adds a shadow ray. `uncovers`: its part of the radiance at the eye, if the ray is not blocked.
void add_ground_ray(uint place, path p, vec3 origin, vec3 direction, float distance_, vec4 uncovers)
{
    shadow_rays[place] = ray(vec4(origin, 0.0), vec4(direction, distance_ * (1.0 - 4.0 * PATH_OFFSET)));
    put_light_sample(place, uncovers);
#ifdef HAS_TIMES
    shadow_times[place] = p.time;
#endif
}

// Resampling with one more candidate: true if it is chosen. `number` decides, and stays uniform.
bool take(float size, inout float sum, inout float number)
{
    sum += size;
    float share = size > 0.0 ? size / sum : 0.0;
    bool taken = number < share;
    number = min(taken ? number / share : (number - share) / (1.0 - share), 0.99999994);
    return taken;
}

vec2 numbers_of_candidate(vec2 u, uint i)
{
    return min(fract(u + vec2(float(i) / float(CANDIDATES), 0.618034 * float(i))), vec2(0.99999994));
}

#ifdef ONE_LIGHT
struct light_choice {
    vec3 direction;
    float distance_;
    float all_; // estimate of the light that arrives without shadows
};

light_choice choose_light(path p, vec3 origin, vec3 normal, vec2 u, vec2 v, float number)
{
    light_choice c = light_choice(normal, FAR, 0.0);
    for (uint i = 0u; i < frame.light_count; i++) {
        light_sample sampled = light_sample_at(i, origin, u);
        if (take(lambert(normal, sampled.direction, sampled.irradiance), c.all_, number)) {
            c.direction = sampled.direction;
            c.distance_ = sampled.distance_;
        }
    }
#ifdef HAS_EMITTERS
    for (uint i = 0u; i < CANDIDATES; i++) {
        emitter_sample sampled = emitter_sample_at(origin, normal, numbers_of_candidate(v, i), p.time);
        float inverse = sampled.probability > 0.0 ? 1.0 / (sampled.probability * float(CANDIDATES)) : 0.0;
        if (take(lambert(normal, sampled.direction, sampled.radiance * inverse), c.all_, number)) {
            c.direction = sampled.direction;
            c.distance_ = sampled.distance_;
        }
    }
#endif
    if (take(mean_of(environment_irradiance(normal)), c.all_, number)) {
        float of_environment = 0.0;
        c.direction = normal;
        c.distance_ = FAR;
        for (uint i = 0u; i < CANDIDATES; i++) {
            float probability;
            vec3 direction = environment_choose(normal, numbers_of_candidate(v, i), probability);
#ifdef HAS_ENVIRONMENT_TABLE
            // Every other candidate is sampled by the cosine: with a bright sea, all directions of the table may point
            // down.
            if ((i & 1u) != 0u)
                direction = occlusion_direction(normal, normal, numbers_of_candidate(v, i));
            float by_cosine = max(dot(normal, direction), 0.0) * INVERSE_PI;
            probability = 0.5 * (environment_probability(normal, direction) + by_cosine);
#endif
            float inverse = probability > 0.0 ? 1.0 / probability : 0.0;
            if (take(lambert(normal, direction, environment_radiance(direction) * inverse), of_environment, number))
                c.direction = direction;
        }
    }
    return c;
}
#endif

void main()
{
    uint j = item_index();
    if (j >= wave.hits.count)
        return;
    uint k = hit_list[j];
    hit h = hit_at(k);
    if ((h.material & HIT_GROUND) == 0u) {
        for (uint i = max(own_rays, first_ray) - first_ray; i < batch_rays; i++)
            no_shadow_ray(i * wave.hits.count + j);
        return;
    }
    path p = path_at(k);
    ray r = ray_at(k);
    vec3 direction = r.direction_t_max.xyz, normal = unpack_unit(h.normal_shading);
    // The ground is no surface that a shadow ray might hit, so the ray starts on it.
    vec3 origin = r.origin_t_min.xyz + h.distance * direction;
    vec4 weight = vec4(p.weight_r, p.weight_g, p.weight_b, p.weight_r);
    vec4 uncovered = weight * behind(direction), covered = weight * COVERED;
    uvec2 seed = path_seed(p);
    uint sample_ = path_sample(p), dimension = SEQUENCE_WAVE + wave_number * SEQUENCE_WAVE_SIZE;
    float unshadowed = 0.0; // share of light that casts no shadows
    uint alive = 0u;
#ifdef LIGHT_LAYERS
    ray_part.group = group_of_environment(); // the light that the ground blocks
#endif
#if defined(EVERY_LIGHT)
    float sum = mean_of(environment_irradiance(normal)), ambient = sum;
    for (uint i = 0u; i < frame.light_count; i++) {
        vec2 u = sequence_pair(seed, SEQUENCE_EVERY_LIGHT + (wave_number << 16 ^ i), sample_);
        light_sample sampled = light_sample_at(i, origin, u);
        float size = lambert(normal, sampled.direction, sampled.irradiance);
        sum += size;
        alive += size > 0.0 && i < first_ray + batch_rays ? 1u : 0u;
    }
    unshadowed = sum > 0.0 ? ambient / sum : 1.0;
    for (uint i = 0u; i < batch_rays; i++) {
        uint place = i * wave.hits.count + j, index = first_ray + i;
        float size = 0.0;
        light_sample sampled = light_sample(vec3(0.0), 0.0, vec3(0.0));
        if (index < frame.light_count) {
            vec2 u = sequence_pair(seed, SEQUENCE_EVERY_LIGHT + (wave_number << 16 ^ index), sample_);
            sampled = light_sample_at(index, origin, u);
            size = lambert(normal, sampled.direction, sampled.irradiance);
        }
        if (size > 0.0)
            add_ground_ray(place, p, origin, sampled.direction, sampled.distance_, (uncovered - covered) * (size / sum));
        else
            no_shadow_ray(place);
    }
#elif defined(ONE_LIGHT)
    for (uint i = 0u; i < batch_rays; i++) {
        uint place = i * wave.hits.count + j, index = sample_ * shadow_rays_a_hit + first_ray + i;
        vec2 u = sequence_pair(seed, dimension + SEQUENCE_LIGHT, index);
        vec2 v = sequence_pair(seed, dimension + SEQUENCE_LOBE_DIRECTION, index);
        light_choice chosen = choose_light(p, origin, normal, u, v, sequence_number(seed, dimension + SEQUENCE_LOBE, index));
        unshadowed = chosen.all_ > 0.0 ? 0.0 : 1.0;
        if (chosen.all_ > 0.0)
            add_ground_ray(place, p, origin, chosen.direction, chosen.distance_,
                           (uncovered - covered) / float(shadow_rays_a_hit));
        else
            no_shadow_ray(place);
    }
    alive = unshadowed > 0.0 ? 0u : first_ray + batch_rays;
#else
    for (uint i = 0u; i < batch_rays; i++) {
        uint index = sample_ * own_rays + first_ray + i;
        vec3 towards = occlusion_direction(normal, normal, sequence_pair(seed, dimension + SEQUENCE_LOBE_DIRECTION, index));
        float far = occlusion_reach(reach, falloff, sequence_number(seed, dimension + SEQUENCE_LOBE, index));
        add_ground_ray(i * wave.hits.count + j, p, origin, towards, far, (uncovered - covered) / float(own_rays));
    }
    alive = first_ray + batch_rays;
#endif
    if (first_ray == 0u) {
        vec4 shown = mix(covered, uncovered, unshadowed);
        radiance[k] = shown;
#ifdef LIGHT_LAYERS
        note_part(p, ray_part, shown.rgb);
#endif
    }
    child_counts[j] = alive << SHADOW_RAYS_SHIFT;
}
