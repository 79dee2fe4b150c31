// SPDX-License-Identifier: MIT
// Computes the radiance of each hit of a wave towards the eye, and its rays: Kajiya. The Rendering Equation. 1986, by
// paths from the eye. There is no ambient term: all light arrives over bounces.
//
//   radiance    emission; the area light that the ray hit on its way
//   shadow rays one to one point of one light or emissive triangle, and one to the environment. Two, as only tracing
//   shows which of them is in the shadow: a choice of one would often be wasted
//   child       at most one: straight on (alpha blending), scattered, mirrored or refracted
//
// Light with an extent is found by shadow rays and by children, at no extra cost: children meet rectangles, spheres and
// the environment on their way. Light that both find is weighed (common/two_ways.glsl). The last hits of a path have no
// child; there shadow rays find everything. Straight rays from the eye hit no area light.
//
// Emissive triangles are found both ways, too. Children see them refracted through glass, and through blended surfaces;
// so translucent surfaces stop the shadow rays towards them, and light met behind one counts fully. The last hits do not
// sample them: their light is that of one bounce more.
//
// Glass. Shadow rays go straight through it, tinted (common/alpha.glsl), smooth or not; so a light behind a pane lights
// a room without waiting for a path to find it. Children have to find the same light for the weights of both ways: where
// one from a place that sampled lights meets glass, a shadow ray continues straight in its place, with its share. The
// refracted child would find that light a second time: it counts none until it is scattered, or mirrored outside
// (PATH_COVERED), except that of emissive surfaces. Paths from the eye, or a mirror, see everything through glass.
// Surfaces of glass sample no light from inside.
//
// Defines: those of common/bsdf.glsl, common/light.glsl, common/environment_choice.glsl, common/two_ways.glsl and
// render/shade.glsl.

#include "common/bsdf.glsl"
#include "common/environment_choice.glsl"
#include "common/light_choice.glsl"
#include "common/two_ways.glsl"
#include "render/fireflies.glsl"
#include "render/light_seen.glsl"
#include "render/shade.glsl"
#include "render/wave.glsl"

// Weight below which a child is traced with the probability weight / this, and then has this weight. Measured in two
// rooms: 1/4 is as good.
const float ROULETTE = 1.0 / 2.0;

uniform uint asks_lights, asks_environment; // 1: the scene has some; their shadow rays come in this order

struct eye_hit {
    uint j;
    path p;
    surface s;
    bsdf b;
    vec3 origin; // origin of shadow rays
    vec3 weight;
    float distance_;
    bool last;   // no child follows
    light_receiver receiver;
    float all_lights; // sum of their estimates
    // Light that shadow rays sample, and the numbers that remain to choose a point of it.
    uint light_number;
    float light_chance;
    vec2 light_u;
    float lights_chance; // probability of sampling a light, not an emitter
};

uint numbers_of(uint choice)
{
    return SEQUENCE_PATH + wave_number * SEQUENCE_PATH_SIZE + choice;
}

void choose_light(inout eye_hit e, uvec2 seed, uint index)
{
    e.light_u = sequence_pair_sorted(seed, numbers_of(SEQUENCE_PATH_LIGHT), index, frame.group_shift);
    e.light_number = light_choose(e.receiver, frame.light_count, e.light_u.x, e.light_chance, e.all_lights);
#ifdef HAS_EMITTERS
    if (!e.last) // light of emissive surfaces counts as a bounce
        e.lights_chance = lights_share(e.receiver, e.all_lights,
                                       emitters_around(e.origin, e.s.normal, passed_share(e.b.parts)));
#endif
}

// Evaluates the surface, for the shadow ray that is made next; the caller sets its group.
vec3 evaluate(eye_hit e, vec3 direction, out float found)
{
    vec3 sent = bsdf_evaluate(e.b, e.s, direction, found);
#ifdef LIGHT_LAYERS
    ray_part = part_asked(e.p, share_mirrored(sent, evaluated_scattered), 0u);
#endif
    return sent;
}

#ifdef HAS_EMITTERS
bool ask_for_emitter(eye_hit e, uint place, vec2 u)
{
    float found, of_side, side = side_choose(e.b.parts, u.x, of_side), chance = (1.0 - e.lights_chance) * of_side;
    vec3 normal = unpack_ray_normal(pack_ray_normal(side * e.s.normal));
    vec3 from = origin_towards(e.s, e.origin, e.distance_, side * e.s.geometric);
    emitter_sample sampled = emitter_sample_at(from, normal, u, e.p.time);
    vec3 arriving = vec3(0.0), sent = evaluate(e, sampled.direction, found);
    if (sampled.probability > 0.0 && side * dot(sampled.direction, e.s.normal) > 0.0) // the probability is for that side
        arriving = e.weight * sent * sampled.radiance / (sampled.probability * chance);
    arriving = limited(e.p, 0u, arriving * emitter_share_asked(sampled, chance, found));
#ifdef LIGHT_LAYERS
    ray_part.group = group_of_instance(sampled.instance);
#endif
    return add_shadow_ray_from(place, e.p, from, sampled.direction, RAY_STOPS_T_MIN, sampled.distance_, arriving);
}
#endif

bool ask_for_light(eye_hit e, uint place)
{
    float found, chance = e.light_chance;
    vec2 u = e.light_u;
#ifdef HAS_EMITTERS
    if (u.x >= e.lights_chance) {
        u.x = min((u.x - e.lights_chance) / (1.0 - e.lights_chance), 0.99999994);
        return ask_for_emitter(e, place, u);
    }
    u.x = min(u.x / e.lights_chance, 0.99999994);
    chance *= e.lights_chance;
#endif
    if (chance <= 0.0) {
        no_shadow_ray(place);
        return false;
    }
    vec3 from = e.origin;
    light_sample sampled = light_seen(e.s, e.distance_, e.light_number, u, from);
    vec3 arriving = e.weight * evaluate(e, sampled.direction, found) * (sampled.irradiance / chance);
#ifdef HAS_AREA_LIGHTS
    float probability = chance * light_probability(light_at(e.light_number), sampled);
    if (!e.last && probability > 0.0)
        arriving *= heuristic(probability, found);
#endif
#ifdef LIGHT_LAYERS
    ray_part.group = group_of_light(e.light_number);
#endif
    return add_shadow_ray(place, e.p, from, sampled.direction, sampled.distance_, limited(e.p, 0u, arriving));
}

// Density with which shadow rays sample the environment in a direction. A table ignores the sides of the surface.
float environment_density(eye_hit e, vec3 direction)
{
#ifdef HAS_ENVIRONMENT_TABLE
    return environment_probability(e.s.normal, direction);
#else
    float cosine = dot(e.s.normal, direction);
    return environment_probability(cosine < 0.0 ? -e.s.normal : e.s.normal, direction) * side_chance(e.b.parts, cosine);
#endif
}

bool ask_for_environment(eye_hit e, uint place, uvec2 seed, uint index)
{
    float probability, found, side = 1.0, of_side = 1.0;
    vec2 u = sequence_pair(seed, numbers_of(SEQUENCE_PATH_ENVIRONMENT), index);
#ifndef HAS_ENVIRONMENT_TABLE
    side = side_choose(e.b.parts, u.x, of_side);
#endif
    vec3 direction = environment_choose(side * e.s.normal, u, probability);
    probability *= of_side;
    vec3 arriving = vec3(0.0), sent = evaluate(e, direction, found);
    if (probability > 0.0 && max_component(sent) > 0.0)
        arriving = e.weight * sent * environment_radiance(direction) / probability;
    if (!e.last)
        arriving *= heuristic(probability, found);
    vec3 from = origin_towards(e.s, e.origin, e.distance_, direction);
#ifdef LIGHT_LAYERS
    ray_part.group = group_of_environment();
#endif
    return add_shadow_ray(place, e.p, from, direction, FAR, limited(e.p, 0u, arriving));
}

#ifdef HAS_AREA_LIGHTS
// Chooses one of the lights that a child's ray will hit if nothing is in the way, and its weight. `found`: the
// probability density of its direction per steradian; 0: no other technique samples them.
void meet_lights(inout path p, eye_hit e, vec3 origin, vec3 direction, float found, float choice)
{
    float sum = 0.0;
    for (uint i = 0u; i < frame.light_count; i++) {
        light l = light_at(i);
        float probability, distance_ = light_meet(l, origin, direction, probability), share = 1.0;
        if (distance_ < 0.0)
            continue;
        if (found > 0.0 && e.all_lights > 0.0)
            share = heuristic(found, probability * light_estimate(i, e.receiver) / e.all_lights * e.lights_chance);
        float size = share * max_component(l.colour.rgb);
        if (!(size > 0.0)) // no contribution, and a divisor
            continue;
        sum += size;
        if (!(size > choice * sum)) {
            choice = (choice * sum - size) / (sum - size);
            continue;
        }
        choice = choice * sum / size;
        p.light_number = i + 1u;
        p.light_distance = distance_ * (1.0 - 4.0 * PATH_OFFSET); // shadow rays end before it too
        p.light_share = share / size;
    }
    p.light_share *= sum;
}
#endif

// Number of the area light that a ray hits, plus 1.
uint met_number(path p)
{
#ifdef HAS_EMITTERS
    return p.light_number & PATH_LIGHT_MASK;
#else
    return p.light_number;
#endif
}

// Samples the light straight on behind glass, which the ray would have found. Returns the number of its live shadow rays.
uint ask_straight_on(eye_hit e, vec3 direction, vec3 through)
{
    uint place = e.j, alive = 0u;
    vec3 origin = off_surface(e.s, e.distance_, -e.s.geometric), carried = e.weight * through;
#ifdef LIGHT_LAYERS
    ray_part = part_met(e.p, LIGHT_EMITTED, met_number(e.p) != 0u ? group_of_light(met_number(e.p) - 1u) : 0u);
#endif
    if (asks_lights != 0u) {
        vec3 arriving = vec3(0.0);
        float rest = e.p.light_distance - e.distance_;
#ifdef HAS_AREA_LIGHTS
        if (met_number(e.p) != 0u && rest > 0.0)
            arriving = carried * light_at(met_number(e.p) - 1u).colour.rgb * e.p.light_share;
#endif
        if (add_shadow_ray(place, e.p, origin, direction, rest, limited(e.p, 1u, arriving)))
            alive++;
        place += wave.hits.count;
    }
    if (asks_environment != 0u) {
        vec3 arriving = carried * environment_radiance(direction) * e.p.environment_share;
#ifdef LIGHT_LAYERS
        ray_part.group = group_of_environment();
#endif
        if (add_shadow_ray(place, e.p, origin, direction, FAR, limited(e.p, 1u, arriving)))
            alive++;
    }
    return alive;
}

uint ask(eye_hit e, uvec2 seed, uint index)
{
    uint place = e.j, alive = 0u;
    if (asks_lights != 0u) {
        if (ask_for_light(e, place))
            alive++;
        place += wave.hits.count;
    }
    if (asks_environment != 0u && ask_for_environment(e, place, seed, index))
        alive++;
    return alive;
}

void ask_nothing(uint j)
{
    for (uint i = 0u; i < shadow_rays_a_hit; i++)
        no_shadow_ray(i * wave.hits.count + j);
}

// Emits the child of the surface.
void go_on(eye_hit e, uvec2 seed, uint index, bool asked, float choice)
{
    path p = e.p;
    vec2 u = sequence_pair(seed, numbers_of(SEQUENCE_PATH_DIRECTION), index);
    bsdf_choice chosen = bsdf_choose(e.b, e.s, choice, u);
    vec3 carried = e.weight * chosen.weight;
    float survival = min(max_component(carried) / ROULETTE, 1.0);
    float end = sequence_number(seed, numbers_of(SEQUENCE_PATH_END), index);
    if (!(end < survival)) // true for NaN too
        return;
    bool of_glass = chosen.lobe == BSDF_REFRACTED || e.b.leaves && chosen.lobe == BSDF_MIRRORED;
    bool covered = of_glass && (p.flags & (PATH_ASKED | PATH_COVERED)) != 0u;
    // Density with which shadow rays sample this direction.
    float found = asked && !of_glass ? chosen.probability : 0.0;
    p.flags &= ~(PATH_ASKED | PATH_COVERED);
    p.flags |= (found > 0.0 ? PATH_ASKED : 0u) | (covered ? PATH_COVERED : 0u);
    float roughness = chosen.lobe == BSDF_SCATTERED ? 1.0 : e.s.roughness;
#ifdef HAS_CLEARCOAT
    roughness = chosen.lobe == BSDF_COAT ? e.s.coat_roughness : roughness;
#endif
    p.flags = path_sent_on(p.flags, roughness);
    p.light_number = 0u;
    p.light_share = 0.0;
    p.environment_share = covered ? 0.0 : 1.0;
    if (frame.environment_kind == ENVIRONMENT_BACKDROP) // surfaces that scatter do not see it
        p.environment_share = chosen.lobe == BSDF_SCATTERED ? 0.0 : e.p.environment_share;
    if (found > 0.0 && asks_environment != 0u)
        p.environment_share = heuristic(found, environment_density(e, chosen.direction));
#ifdef HAS_AREA_LIGHTS
    float side = dot(chosen.direction, e.s.geometric) > 0.0 ? 1.0 : -1.0;
    if (!covered)
        meet_lights(p, e, off_surface(e.s, e.distance_, side * e.s.geometric), chosen.direction, found,
                   sequence_number(seed, numbers_of(SEQUENCE_PATH_MET_LIGHT), index));
#endif
#ifdef HAS_EMITTERS
    float cosine = dot(chosen.direction, e.s.normal), emitters_chance = (1.0 - e.lights_chance) *
                                                                        side_chance(e.b.parts, cosine);
    uint ray_normal = pack_ray_normal(cosine < 0.0 ? -e.s.normal : e.s.normal);
    p.flags = p.flags & (1u << PATH_NORMAL_SHIFT) - 1u | ray_normal << PATH_NORMAL_SHIFT;
    p.light_number |= ratio_code(emitters_chance, found) << PATH_LIGHT_BITS;
#endif
#ifdef LIGHT_LAYERS
    // In a direction with a density all lobes contribute, whichever was chosen.
    bool evaluated = chosen.probability > 0.0, mirrored = chosen.lobe == BSDF_MIRRORED || chosen.lobe == BSDF_COAT;
    vec3 share = evaluated ? share_mirrored(chosen.weight * chosen.probability, evaluated_scattered) : vec3(mirrored ? 1.0 : 0.0);
    note_first(e.p, share, chosen.lobe == BSDF_REFRACTED);
#endif
    float angle = chosen.lobe == BSDF_COAT ? 0.0 : rough_solid_angle(e.s, chosen.direction);
    angle = chosen.probability > 0.0 ? 1.0 / chosen.probability : angle;
    add_child(e.j, p, e.s, e.distance_, chosen.direction, carried / survival, false, sample_solid_angle(angle));
}

// Light of an area light that the ray hit before the surface.
vec3 met_light(path p, float distance_)
{
#ifdef HAS_AREA_LIGHTS
    if (met_number(p) != 0u && p.light_distance <= distance_)
        return light_at(met_number(p) - 1u).colour.rgb * p.light_share;
#endif
    return vec3(0.0);
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
    vec3 direction = r.direction_t_max.xyz, view = -direction;
    e.distance_ = h.distance;
    e.s = surface_of_path(e.p, h, r);
    e.weight = weight_at(e.p, e.s, h.distance);
    uvec2 seed = path_seed(e.p);
    uint index = path_sample(e.p);
    e.s.roughness = regularised_roughness(e.p, e.s.roughness, index);
#ifdef HAS_CLEARCOAT
    e.s.coat_roughness = regularised_roughness(e.p, e.s.coat_roughness, index);
#endif
    e.origin = off_surface(e.s, h.distance, e.s.geometric);
    e.last = last_wave != 0u || (e.p.flags & PATH_BOUNCES_MASK) >= frame.depth;
    e.all_lights = 0.0;
    e.lights_chance = 1.0;
    float NoV = clamp(dot(e.s.normal, view), 1e-4, 1.0); // a shading normal may lean away
    e.b = bsdf_of(e.s, view, NoV);
    e.receiver = light_receiver_of(e.s, e.b.parts, e.origin, view, NoV);
    float choice = sequence_number(seed, numbers_of(SEQUENCE_PATH_LOBE), index);
    bool straight = choice >= e.s.alpha;
    vec3 met = met_light(e.p, h.distance), sent = met;
#ifdef LIGHT_LAYERS
    uint met_group = met_number(e.p) != 0u ? group_of_light(met_number(e.p) - 1u) : 0u;
#endif
    bool asks = !straight && !e.s.unlit && !e.b.leaves;
    uint alive = 0u;
#ifdef HAS_EMITTERS
    e.s.emission *= emitter_share_met(e.p.light_number >> PATH_LIGHT_BITS, e.p.flags >> PATH_NORMAL_SHIFT, h, r, e.p.time,
                                      e.s.emission);
#endif
    if (!straight)
        sent += e.s.unlit ? e.s.base : e.s.emission;
    if (asks)
        choose_light(e, seed, index);
    float passes = 0.0; // share of its shadow rays for light behind it
    vec3 through = e.s.base * (e.s.transmission * (1.0 - e.s.metallic));
    if (!straight && !e.s.unlit && (e.p.flags & PATH_ASKED) != 0u && max_component(through) > 0.0)
        passes = asks ? 0.5 : 1.0; // either of the two
    vec3 weight = e.weight;
    if (sequence_number(seed, numbers_of(SEQUENCE_PATH_PASS), index) < passes) {
        e.weight = weight / passes;
        alive = ask_straight_on(e, direction, through);
    } else if (asks) {
        e.weight = weight / (1.0 - passes);
        alive = ask(e, seed, index);
    } else {
        ask_nothing(j);
    }
    e.weight = weight;
    if (straight) {
        e.p.light_number = e.p.light_distance > h.distance ? met_number(e.p) : 0u;
        e.p.light_distance -= h.distance;
        add_child(j, e.p, e.s, h.distance, direction, e.weight, true, 0.0);
    } else if (!e.s.unlit) {
        go_on(e, seed, index, asks, min(choice / e.s.alpha, 0.99999994));
    }
    bool seen = !straight && (e.p.flags & PATH_STRAIGHT) != 0u;
    vec3 brought = limited(e.p, 1u, e.weight * sent);
    radiance[k] = vec4(brought, seen ? e.p.weight_r : 0.0);
#ifdef LIGHT_LAYERS
    vec3 own = brought;
#if defined(LIGHT_GROUPS) && defined(HAS_AREA_LIGHTS)
    vec3 of_light = brought * share_of(met, sent);
    note_sent(e.p, h, part_met(e.p, LIGHT_EMITTED, met_group), of_light);
    own -= of_light;
#endif
    note_sent(e.p, h, part_met(e.p, LIGHT_EMITTED, group_of_instance(h.instance)), own);
#endif
    note_children(j, true, alive);
}
