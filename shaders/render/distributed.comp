// SPDX-License-Identifier: MIT
// Computes the radiance of each hit of a wave towards the eye, and its rays: Cook, Porter, Carpenter. Distributed Ray
// Tracing. 1984. For each kind of ray, one of those that a hit could emit is chosen, weighted by the inverse of its
// probability, so the mean of the samples is correct however few rays each has.
//
//   radiance    emission, and a constant ambient term as in whitted.comp
//   shadow ray  one, to one point of one light or emissive triangle, or to the environment
//   child       at most one: straight on (alpha blending), mirrored or refracted, in a direction of a facet of the rough
//               surface, or of several in turn
//
// Lights with an extent are found by shadow rays alone, at a point that is chosen on the light or by a facet that mirrors
// it. The choice of rays, and their random end, takes account of an environment image, which may be far brighter than
// white.
//
// Shadow rays sample emissive triangles for scattered light: no child finds that. Their reflection in a rough surface,
// and that of bright parts of an environment image, is found by both shadow rays and children (common/two_ways.glsl).
// Children see them refracted through glass, and through blended surfaces; so translucent surfaces stop the shadow rays
// for mirrors, and light met behind one counts fully. The last hits of a path, which have no child, mirror neither.
// Reflections of other environments are found by children alone.
//
// Defines: those of common/material.glsl, common/light.glsl, common/environment_choice.glsl, common/two_ways.glsl and
// render/shade.glsl. With HAS_ENVIRONMENT_TABLE shadow rays sample the environment.

#include "common/environment_choice.glsl"
#include "common/light_choice.glsl"
#include "common/lobe.glsl"
#include "common/two_ways.glsl"
#include "render/fireflies.glsl"
#include "render/light_seen.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

// Weight below which a child is traced with the probability weight / this, and then has this weight.
const float ROULETTE = 1.0 / 4.0;

#if defined(HAS_EMITTERS) || defined(HAS_ENVIRONMENT_TABLE)
#define TWO_WAYS
#endif

// Solid angle over which the environment's light is spread: the square of its sum divided by the sum of its squares.
uniform float environment_extent;

struct eye_hit {
    uint j;
    path p;
    vec3 weight, view;
    surface s;
    split parts;
    float NoV, distance_;
    vec3 origin; // origin of shadow rays
    // The surface for lights, see path_roughness().
    surface blurred;
    split blurred_parts;
};

// Light that a shadow ray samples.
struct shadow_choice {
    float environment; // probability of the environment; otherwise:
    float lights;      // probability of a light, not an emitter; in these:
    float mirrored;    // probability of its reflection, not its scattered light
    uint light_number;
    float light_chance; // probability of this light among the lights
    vec2 u;             // x: for the choice, then both: for the place
    uint ray_normal;    // normal by which emitters are chosen: packed
    float by_facets;    // light with an extent: probability of sampling it by facets that mirror it
};

// Roughness of the mirrors and windows along a path: they blur what it sees. A light's highlight on a smooth surface,
// which is as bright as it is narrow, is widened to it, less with every sample; otherwise one ray in thousands would hit
// it, as a firefly.
float path_roughness(path p)
{
    return float(p.flags >> PATH_ROUGHNESS_SHIFT) / 65535.0;
}

float emitter_chance(shadow_choice c)
{
    return (1.0 - c.environment) * (1.0 - c.lights);
}

// Probability that a ray of that weight is traced.
float survival_of(vec3 carried, vec3 direction)
{
    return max_component(carried) * brightness_beyond(direction) / ROULETTE;
}

// Value of lobe_mirrored(), with the density of the rays that are traced.
vec3 mirrored_light(eye_hit e, vec3 light, out float found)
{
    vec3 sent = lobe_mirrored(e.s, e.parts, e.NoV, e.view, light, found);
    found *= found > 0.0 ? min(survival_of(e.weight * sent / found, light), 1.0) : 0.0;
    return sent;
}

void add_lobe(eye_hit e, lobe chosen, shadow_choice c, float choice)
{
    path p = e.p;
    vec3 carried = e.weight * chosen.weight;
    float survival = survival_of(carried, chosen.direction);
    if (!(choice < survival)) // true for NaN too
        return;
    uint roughness = uint(max(path_roughness(p), chosen.roughness) * 65535.0 + 0.5);
    p.flags = path_sent_on(p.flags, chosen.roughness);
    p.flags = p.flags & (1u << PATH_ROUGHNESS_SHIFT) - 1u | roughness << PATH_ROUGHNESS_SHIFT;
#ifdef TWO_WAYS
    float found = 0.0;
    if (chosen.back && chosen.solid_angle > 0.0) // no shadow ray samples smooth mirrors
        mirrored_light(e, chosen.direction, found);
#endif
#ifdef HAS_EMITTERS
    p.light_number = c.ray_normal | ratio_code(emitter_chance(c) * c.mirrored, found) << PATH_LIGHT_BITS;
#endif
#ifdef HAS_ENVIRONMENT_TABLE
    float other = c.environment * environment_probability(e.s.normal, chosen.direction);
    p.environment_share = found > 0.0 ? heuristic(found, other) : 1.0;
#endif
#ifdef LIGHT_LAYERS
    note_first(e.p, vec3(chosen.back ? 1.0 : 0.0), !chosen.back);
#endif
    add_child(e.j, p, e.s, e.distance_, chosen.direction, carried / min(survival, 1.0), false,
              sample_solid_angle(chosen.solid_angle));
}

#ifdef HAS_AREA_LIGHTS
// Probability of sampling the chosen light by directions that facets mirror, not by a point on it: by the share of its
// highlight, and by how much wider the light is than these directions.
float by_facets_chance(shadow_choice c, light_receiver r)
{
    const float CHANCE_MAX = 0.8;
    if (c.light_chance <= 0.0)
        return 0.0;
    light_outlook outlook = light_outlook_of(c.light_number, r);
    float both = outlook.scattered + outlook.mirrored, alpha = r.alpha;
#ifdef HAS_CLEARCOAT
    alpha = r.coat_mirrored > 0.0 ? min(alpha, r.coat_alpha) : alpha;
#endif
    float wide = square(square(outlook.reach)), narrow = square(4.0 * PI * square(alpha)); // squares of solid angles
    return both > 0.0 && wide > 0.0 ? CHANCE_MAX * (outlook.mirrored / both) * (wide / (wide + narrow)) : 0.0;
}
#endif

shadow_choice choose_shadow_ray(eye_hit e, vec2 u)
{
    shadow_choice c = shadow_choice(0.0, 1.0, 0.0, 0u, 0.0, u, 0u, 0.0);
    light_receiver receiver = light_receiver_of(e.blurred, e.blurred_parts, e.origin, e.view, e.NoV);
    float all_;
    c.light_number = light_choose(receiver, frame.light_count, c.u.x, c.light_chance, all_);
#ifdef HAS_AREA_LIGHTS
    c.by_facets = by_facets_chance(c, receiver);
#endif
#ifdef TWO_WAYS
    bool mirrors = lobes_are_rough(e.s) && last_wave == 0u &&
                   (e.p.flags & PATH_BOUNCES_MASK) < frame.depth;
    float mirrored = mirrors ? max_component(e.parts.mirror + e.parts.again) : 0.0;
#ifdef HAS_CLEARCOAT
    mirrored += mirrors ? e.parts.coat.mirrors : 0.0;
#endif
#endif
#ifdef HAS_EMITTERS
    c.ray_normal = pack_ray_normal(e.s.normal);
    receiver.scattered = max_component(e.parts.scattered + sheen_of(e.parts) + passed_of(e.parts)) * INVERSE_PI;
    receiver.mirrored = mirrored * INVERSE_PI;
    float estimate = emitters_around(e.origin, e.s.normal, passed_share(e.parts));
    float both = receiver.scattered + receiver.mirrored;
    c.lights = both > 0.0 ? lights_share(receiver, all_, estimate) : 1.0;
    c.mirrored = both > 0.0 ? receiver.mirrored / both : 0.0;
    all_ += estimate * both;
#endif
#ifdef HAS_ENVIRONMENT_TABLE
    // A lobe that is narrow beside the environment's bright parts samples these well enough alone.
    float angle = rough_solid_angle(e.s, e.s.geometric), own = mirrored * max_component(frame.irradiance[0].rgb);
    c.environment = own > 0.0 ? angle / (angle + environment_extent) * own / (own + all_) : 0.0;
#endif
    return c;
}

#ifdef HAS_EMITTERS
bool ask_for_emitter(eye_hit e, shadow_choice c)
{
    bool mirrored = is_in(c.mirrored, c.u.x);
    float chance = emitter_chance(c) * (mirrored ? c.mirrored : 1.0 - c.mirrored), found = 0.0;
    float side = 1.0, of_side = 1.0;
    uint normal = c.ray_normal;
#ifdef HAS_DIFFUSE_TRANSMISSION
    if (!mirrored)
        side = side_choose(e.parts, c.u.x, of_side);
    chance *= of_side;
    normal = pack_ray_normal(side * e.s.normal);
#endif
    vec3 from = origin_towards(e.s, e.origin, e.distance_, side * e.s.geometric);
    emitter_sample sampled = emitter_sample_at(from, unpack_ray_normal(normal), c.u, e.p.time);
    float NoL = dot(e.s.normal, sampled.direction);
    vec3 sent = vec3(0.0);
    if (mirrored)
        sent = mirrored_light(e, sampled.direction, found);
    else if (side * NoL > 0.0) // the probability is for that side
        sent = brdf_scattered(e.s, e.parts, e.view, e.NoV, sampled.direction) * abs(NoL);
#ifdef LIGHT_LAYERS
    ray_part = part_asked(e.p, vec3(mirrored ? 1.0 : 0.0), group_of_instance(sampled.instance));
#endif
    vec3 arriving = vec3(0.0);
    if (sampled.probability > 0.0)
        arriving = e.weight * sent * sampled.radiance * (emitter_share_asked(sampled, chance, found) /
                                                         (sampled.probability * chance));
    return add_shadow_ray_from(e.j, e.p, from, sampled.direction, mirrored ? RAY_STOPS_T_MIN : 0.0,
                               sampled.distance_, limited(e.p, 0u, arriving));
}
#endif

#ifdef HAS_ENVIRONMENT_TABLE
bool ask_for_environment(eye_hit e, shadow_choice c)
{
    float probability, found;
    vec3 direction = environment_choose(e.s.normal, c.u, probability);
    probability *= c.environment;
    vec3 arriving = vec3(0.0), sent = mirrored_light(e, direction, found);
#ifdef LIGHT_LAYERS
    ray_part = part_asked(e.p, vec3(1.0), group_of_environment());
#endif
    if (probability > 0.0 && found > 0.0)
        arriving = e.weight * sent * environment_radiance(direction) * (heuristic(probability, found) / probability);
    return add_shadow_ray_from(e.j, e.p, e.origin, direction, RAY_STOPS_T_MIN, FAR, limited(e.p, 0u, arriving));
}
#endif

#ifdef HAS_AREA_LIGHTS
// Samples a point of the light, or the one that a facet mirrors: one sample of both techniques, with the balance
// heuristic (Veach, Guibas 1995, section 5.2). A point alone would lie in a narrow highlight once in many samples.
light_sample light_of_two_ways(eye_hit e, shadow_choice c, inout vec3 origin)
{
    if (c.by_facets <= 0.0)
        return light_seen(e.s, e.distance_, c.light_number, c.u, origin);
    light l = light_at(c.light_number);
    surface s = surface_of_highlights(e.blurred);
    light_sample sampled;
    float probability;
    if (is_in(c.by_facets, c.u.x)) {
        sampled.direction = highlight_choose(s, e.blurred_parts, e.NoV, e.view, c.u);
        sampled.distance_ = light_meet(l, origin, sampled.direction, probability);
        bool above = dot(sampled.direction, e.s.geometric) > 0.0;
        sampled.irradiance = above && sampled.distance_ > 0.0 ? l.colour.rgb / probability : vec3(0.0);
    } else {
        sampled = light_seen(e.s, e.distance_, c.light_number, c.u, origin);
        probability = light_probability(l, sampled);
    }
    float found = 0.0;
    if (dot(sampled.direction, e.s.geometric) > 0.0)
        found = c.by_facets * highlight_density(s, e.blurred_parts, e.NoV, e.view, sampled.direction);
    sampled.irradiance *= probability / max((1.0 - c.by_facets) * probability + found, 1e-30);
    return sampled;
}
#endif

bool ask_for_light(eye_hit e, shadow_choice c)
{
    float probability = c.light_chance;
#ifdef HAS_ENVIRONMENT_TABLE
    if (is_in(c.environment, c.u.x))
        return ask_for_environment(e, c);
    probability *= 1.0 - c.environment;
#endif
#ifdef HAS_EMITTERS
    if (!is_in(c.lights, c.u.x))
        return ask_for_emitter(e, c);
    probability *= c.lights;
#endif
    if (probability <= 0.0) {
        no_shadow_ray(e.j);
        return false;
    }
    vec3 from = e.origin;
#ifdef HAS_AREA_LIGHTS
    light_sample sampled = light_of_two_ways(e, c, from);
#else
    light_sample sampled = light_seen(e.s, e.distance_, c.light_number, c.u, from);
#endif
    float shine = light_shine(c.light_number, e.s.roughness);
    vec3 sent = reflected(e.blurred, e.blurred_parts, e.view, e.NoV, sampled.direction, shine);
#ifdef LIGHT_LAYERS
    vec3 scattered = brdf_scattered(e.blurred, e.blurred_parts, e.view, e.NoV, sampled.direction);
    vec3 mirrored = share_mirrored(sent, scattered * abs(dot(e.s.normal, sampled.direction)));
    ray_part = part_asked(e.p, mirrored, group_of_light(c.light_number));
#endif
    vec3 arriving = e.weight * (sent * sampled.irradiance / probability);
    return add_shadow_ray(e.j, e.p, from, sampled.direction, sampled.distance_, limited(e.p, 0u, arriving));
}

void main()
{
    uint j = item_index();
    if (j >= wave.hits.count)
        return;
    uint k = hit_list[j];
    eye_hit e;
    e.j = j;
    e.p = path_at(k);
    ray r = ray_at(k);
    hit h = hit_at(k);
    vec3 direction = r.direction_t_max.xyz;
    e.view = -direction;
    e.distance_ = h.distance;
    e.s = surface_of_path(e.p, h, r);
    e.weight = weight_at(e.p, e.s, h.distance);
    uvec2 seed = path_seed(e.p);
    uint index = path_sample(e.p), dimension = SEQUENCE_WAVE + wave_number * SEQUENCE_WAVE_SIZE;
    e.s.roughness = regularised_roughness(e.p, e.s.roughness, index);
#ifdef HAS_CLEARCOAT
    e.s.coat_roughness = regularised_roughness(e.p, e.s.coat_roughness, index);
#endif
    e.NoV = clamp(dot(e.s.normal, e.view), 1e-4, 1.0); // a shading normal may lean away
    float choice = sequence_number(seed, dimension + SEQUENCE_LOBE, index);
    vec3 sent = vec3(0.0), ambient = vec3(0.0);
    bool straight = choice >= e.s.alpha, asked = false;
#ifdef HAS_EMITTERS
    e.s.emission *= emitter_share_met(e.p.light_number >> PATH_LIGHT_BITS, e.p.light_number & PATH_LIGHT_MASK, h, r, e.p.time,
                                      e.s.emission);
#endif
    // Children count in full by default.
    e.p.light_number = 0u;
    e.p.environment_share = 1.0;
    if (straight) {
        add_child(j, e.p, e.s, h.distance, direction, e.weight, true, 0.0);
        no_shadow_ray(j);
    } else if (e.s.unlit) {
        sent = e.s.base;
        no_shadow_ray(j);
    } else {
        choice = min(choice / e.s.alpha, 0.99999994);
        e.parts = split_light(e.s, e.view, e.NoV);
        e.origin = off_surface(e.s, h.distance, e.s.geometric);
        e.blurred = e.s;
        float least = shrunk_roughness(path_roughness(e.p), index);
        e.blurred.roughness = max(e.s.roughness, least);
#ifdef HAS_CLEARCOAT
        e.blurred.coat_roughness = max(e.s.coat_roughness, least);
#endif
        e.blurred_parts = split_light(e.blurred, e.view, e.NoV);
        bool asks = !in_glass(e.s);
        shadow_choice c = shadow_choice(0.0, 1.0, 0.0, 0u, 0.0, vec2(0.0), 0u, 0.0);
        if (asks)
            c = choose_shadow_ray(e, sequence_pair_sorted(seed, dimension + SEQUENCE_LIGHT, index, frame.group_shift));
        lobe chosen = lobe_choose(e.s, e.parts, e.NoV, direction, choice,
                                  sequence_pair(seed, dimension + SEQUENCE_LOBE_DIRECTION, index));
        ambient = (chosen.scattered + sheen_of(e.parts)) * environment_irradiance(e.s.normal);
        ambient += passed_of(e.parts) * environment_irradiance(-e.s.normal);
        ambient *= e.s.occlusion;
        sent = e.s.emission + ambient;
        add_lobe(e, chosen, c, choice);
        if (asks)
            asked = ask_for_light(e, c);
        else
            no_shadow_ray(j);
    }
    bool seen = !straight && (e.p.flags & PATH_STRAIGHT) != 0u;
    vec3 brought = limited(e.p, 1u, e.weight * sent);
    radiance[k] = vec4(brought, seen ? e.p.weight_r : 0.0);
#ifdef LIGHT_LAYERS
    ambient = brought * share_of(ambient, sent);
    note_sent(e.p, h, part_asked(e.p, vec3(0.0), group_of_environment()), ambient);
    note_sent(e.p, h, part_met(e.p, LIGHT_EMITTED, group_of_instance(h.instance)), brought - ambient);
#endif
    note_children(j, true, asked ? 1u : 0u);
}
