// SPDX-License-Identifier: MIT
// Choice of a single ray for all reflection and refraction of a surface: a visible facet, which reflects or refracts.
//
// Facets are distributed as in brdf(): GGX, each a smooth mirror or window by Fresnel's equations (metal: Schlick),
// with glTF's alpha, the square of the roughness. On a smooth surface, the ray's direction and mean weight are those of
// whitted.
//
// Light that a facet would mirror into another one is mirrored again by metal, as in brdf(); glass transmits it at the
// first facet, or, from inside, keeps it as the flat surface would. So glass loses no light at any roughness, and needs
// no table of what single facets lose.

#include "common/environment.glsl"
#include "common/grain.glsl"
#include "common/scattering.glsl"

// Minimum chance of a mirror beside a window in scenes with emitters: only rays find them, and few samples do.
#ifdef HAS_EMITTERS
const float MIRROR_CHANCE_MIN = 0.125;
#else
const float MIRROR_CHANCE_MIN = 0.0;
#endif

struct lobe {
    vec3 direction;    // unit
    vec3 weight;       // factor of the radiance along it; 0: there is no ray
    float solid_angle; // 1 / the density with which it was chosen, steradians; 0: the surface is smooth
    vec3 scattered;    // split_light()'s, for the facet where glass is seen from inside
    bool back;         // mirrored, once or again
    float roughness;   // roughness of the lobe
};

// Lit share of the visible facets, correlated by height as in V_SmithGGXCorrelated(). 0 below the horizon.
float lit_share(float NoV, float NoL, float alpha)
{
    float a2 = alpha * alpha, v = sqrt(a2 + (1.0 - a2) * NoV * NoV), l = sqrt(a2 + (1.0 - a2) * NoL * NoL);
    return max(NoL, 0.0) * (NoV + v) / max(NoV * l + max(NoL, 0.0) * v, 1e-7);
}

// Cosine-weighted direction about the normal, from one number: its upper bits and its lower ones.
vec3 again_direction(vec3 normal, float number)
{
    vec3 x, y;
    tangent_frame(normal, x, y);
    float sine = sqrt(number), phi = TWO_PI * fract(number * 4096.0);
    return sine * (cos(phi) * x + sin(phi) * y) + sqrt(1.0 - number) * normal;
}

// Share of the light along a direction that leaves after multiple reflections, by the model of brdf(), relative to the
// mean over all directions.
float again_share(surface s, split parts, vec3 light)
{
    return facets_lost_from(s, light, dot(light, s.normal)) / max(parts.again_mean, 1e-9) *
           over_scattered(s, parts, light);
}

#ifdef HAS_CLEARCOAT
// Lobe of the coat: a visible facet's, or the smooth coat's. `chance`: that with which it was chosen.
lobe coat_lobe(surface s, split parts, vec3 direction, float chance, vec2 u)
{
    float alpha = square(s.coat_roughness), NoV = coat_cosine(s, -direction), lit = 1.0;
    bool rough = alpha > FACET_ALPHA_MIN;
    vec3 x, y, facet = s.coat_normal;
    tangent_frame(s.coat_normal, x, y);
    vec3 view = normalize(vec3(-dot(direction, x), -dot(direction, y), NoV));
    lobe result = lobe(facet, vec3(0.0), 0.0, parts.scattered, true, s.coat_roughness);
    if (rough) {
        vec3 local = visible_facet(view, vec2(alpha), u);
        float VoH = clamp(dot(view, local), 1e-4, 1.0);
        facet = local.x * x + local.y * y + local.z * s.coat_normal;
        result.solid_angle = square(facet_turn(COAT_IOR, true)) / visible_facet_density(local, view, VoH, vec2(alpha));
        NoV = VoH;
    }
    result.direction = rough ? reflect(direction, facet) : coat_mirror_direction(s, direction);
    if (rough)
        lit = lit_share(view.z, dot(result.direction, s.coat_normal), alpha);
    bool out_ = dot(result.direction, s.geometric) > 0.0;
    result.weight = vec3(out_ ? s.coat * fresnel_dielectric(NoV, COAT_IOR) * lit / chance : 0.0);
    return result;
}
#endif

// Frame of the facets, and the view in it.
vec3 facet_frame(surface s, float NoV, vec3 direction, out vec3 x, out vec3 y)
{
    facet_axes(s, x, y);
    return normalize(vec3(-dot(direction, x), -dot(direction, y), NoV));
}

// Lit share of a rough surface's facets.
float facets_lit_share(surface s, float NoV, vec3 direction, vec3 light)
{
    float NoL = dot(light, s.normal);
#ifdef HAS_ANISOTROPY
    vec3 x, y, view = facet_frame(s, NoV, direction, x, y);
    return NoL > 0.0 ? facet_both_share(view, vec3(dot(light, x), dot(light, y), NoL), sampled_alpha(s)) : 0.0;
#else
    return lit_share(NoV, NoL, square(s.roughness));
#endif
}

// Chooses a facet of a rough surface that is seen along the direction. `angle`: 1 / the density of the choice.
vec3 facet_seen(surface s, float NoV, vec3 direction, vec2 u, out float angle)
{
    vec2 alpha = sampled_alpha(s);
    vec3 x, y;
    vec3 view = facet_frame(s, NoV, direction, x, y);
    vec3 facet = visible_facet(view, alpha, u);
    angle = 1.0 / visible_facet_density(facet, view, clamp(dot(view, facet), 1e-4, 1.0), alpha);
    return facet.x * x + facet.y * y + facet.z * s.normal;
}

// Turns a direction that a facet sends into another one to where the flat surface would send it. `side`: unit normal of
// the right side.
vec3 turned_to(vec3 direction, vec3 side)
{
    return direction - 2.0 * min(dot(direction, side), 0.0) * side;
}

// Shares and directions of the light along the view, at a facet or at the smooth surface.
struct facet_lobes {
    vec3 reflected, bent;       // directions
    vec3 mirror, again, window; // shares; again: multiple reflections
    SHARE enters;               // share that is neither mirrored nor absorbed by metal
    float window_size;          // sum over all colours, one of which glass may disperse
};

facet_lobes facet_lobes_of(surface s, split parts, float NoV, vec3 direction, vec3 facet, bool rough, inout float number)
{
    bool leaves = in_glass(s);
    float VoH = rough ? clamp(-dot(direction, facet), 1e-4, 1.0) : NoV;
    float lit = 1.0;
    SHARE dielectric = leaves ? inside_mirror(s, VoH) : outside_mirror(s, VoH, fresnel_dielectric(VoH, s.ior), 1.0);
    facet_lobes f;
    f.reflected = reflect(direction, facet);
    if (rough && leaves) {
        f.reflected = turned_to(f.reflected, s.normal);
    } else if (rough) {
        lit = facets_lit_share(s, NoV, direction, f.reflected);
    }
    f.mirror = mix(vec3(dielectric), metal_mirror(s, VoH), s.metallic) *
               (lit * over_mirrored(s, parts, f.reflected));
    f.again = parts.again_colour * (s.metallic * (1.0 - lit) * over_view(parts));
    // Glass is tinted once, where light enters it.
    f.enters = (1.0 - dielectric * lit) * (1.0 - s.metallic);
    f.window = (leaves ? vec3(1.0) : s.base) * (f.enters * s.transmission * over_view(parts));
    f.window_size = max_component(f.window);
    f.bent = bent_direction(s, disperse(s, number, f.window), direction, facet, s.normal);
    if (rough && leaves)
        f.bent = turned_to(f.bent, -s.normal);
    if (dot(f.bent, s.geometric) >= 0.0) { // totally reflected, or sent back by a tilted normal
        f.mirror += f.window;
        f.window = vec3(0.0);
        f.window_size = 0.0;
    }
    return f;
}

// Brightness of an environment image in the direction of a ray of weight 1: at least white.
float brightness_beyond(vec3 direction)
{
#ifdef HAS_ENVIRONMENT_TABLE
    return max(max_component(environment_radiance(direction)), 1.0);
#else
    return 1.0;
#endif
}

// Chances of mirror, multiple mirrors and window, by their shares and the brightness they may meet.
vec3 facet_chances(surface s, facet_lobes f)
{
    float window = f.window_size;
    if (window > 0.0 && in_glass(s)) // otherwise there is no direction, or it goes into the glass
        window *= brightness_beyond(f.bent);
    vec3 sizes = vec3(max_component(f.mirror) * brightness_beyond(f.reflected), max_component(f.again), window);
    float all_ = sizes.x + sizes.y + sizes.z;
    if (!(all_ > 0.0))
        return vec3(0.0);
    sizes /= all_;
    if (sizes.x > 0.0 && sizes.z > 0.0) {
        float both = sizes.x + sizes.z;
        sizes.x = max(sizes.x, MIRROR_CHANCE_MIN * both);
        sizes.z = both - sizes.x;
    }
    return sizes;
}

#ifdef HAS_CLEARCOAT
// Chance of the coat's lobe among all of them.
float coat_chance_of(split parts)
{
    float below = max_component(parts.mirror + parts.again + parts.refracted);
    return parts.coat.mirrors / max(parts.coat.mirrors + below, 1e-9);
}
#endif

// Chooses a lobe. `parts`: split_light() of the same surface and NoV. `choice` chooses between mirror, window and
// multiple mirrors, and is stretched to [0, 1) again; `u` chooses the facet.
lobe lobe_choose(surface s, split parts, float NoV, vec3 direction, inout float choice, vec2 u)
{
    bool rough = facets_are_rough(s), leaves = in_glass(s);
    vec3 facet = s.normal;
    float facet_angle = 0.0;
    if (rough)
        facet = facet_seen(s, NoV, direction, u, facet_angle);
    facet_lobes f = facet_lobes_of(s, parts, NoV, direction, facet, rough, choice);
    vec3 scattered = leaves ? s.base * (f.enters * (1.0 - s.transmission)) : parts.scattered;
    lobe result = lobe(s.normal, vec3(0.0), 0.0, scattered, false, s.roughness);
    vec3 chances = facet_chances(s, f);
#ifdef HAS_CLEARCOAT
    // The coat is chosen before the facet below, by the mean over all facets.
    float coat_chance = coat_chance_of(parts);
    bool coated = choice < coat_chance;
    choice = clamp(coated ? choice / coat_chance : (choice - coat_chance) / (1.0 - coat_chance), 0.0, 0.99999994);
    if (coated)
        return coat_lobe(s, parts, direction, coat_chance, u);
#endif
    if (!(chances.x + chances.y + chances.z > 0.0))
        return result;
    float first = chances.x, second = chances.y;
    bool mirrored = choice < first, is_again = !mirrored && choice < first + second;
    float before = mirrored ? 0.0 : is_again ? first : first + second;
    float chance = mirrored ? first : is_again ? second : 1.0 - first - second;
    choice = clamp((choice - before) / chance, 0.0, 0.99999994);
#ifdef HAS_CLEARCOAT
    chance *= 1.0 - coat_chance;
#endif
    result.back = mirrored || is_again;
    result.direction = mirrored ? f.reflected : is_again ? again_direction(s.normal, choice) : f.bent;
    result.weight = (mirrored ? f.mirror : is_again ? f.again : f.window) / chance;
    float cosine = dot(result.direction, s.normal);
    if (is_again)
        result.weight *= again_share(s, parts, result.direction);
    if (result.back && !(dot(result.direction, s.geometric) > 0.0)) {
        result.weight = rough ? vec3(0.0) : result.weight;
        result.direction = reflect(direction, s.geometric);
    }
    float turned = facet_angle * square(turn_of(s, mirrored));
    result.solid_angle = is_again ? PI / max(cosine, 1e-3) : turned;
    return result;
}

// Reflectance of the lobes that send light back from the surface below a coat (see lobe_mirrored()), from a direction (of
// light, unit) to the eye, per steradian, times the cosine; and the density with which lobe_choose() sends a ray that
// way. Both are 0 where the surface is smooth, and for glass seen from inside. For multiple reflections the density is a
// mean over the facets.
vec3 lobe_mirrored_below(surface s, split parts, float NoV, vec3 view, vec3 light, out float density)
{
    float NoL = dot(s.normal, light);
    density = 0.0;
    if (!facets_are_rough(s) || NoL <= 0.0 || dot(s.geometric, light) <= 0.0 || in_glass(s))
        return vec3(0.0);
    vec3 facet = normalize(view + light);
    float number = 0.5;
    facet_lobes f = facet_lobes_of(s, parts, NoV, -view, facet, true, number);
    float VoH = clamp(dot(view, facet), 1e-4, 1.0);
    vec3 x, y;
    vec3 local_view = facet_frame(s, NoV, -view, x, y), local = vec3(dot(facet, x), dot(facet, y), dot(facet, s.normal));
    float mirrored = visible_facet_density(local, local_view, VoH, sampled_alpha(s)) / (4.0 * VoH);
    float again_size = max_component(parts.again), again_all = max_component(parts.mirror + parts.refracted) + again_size;
    density = facet_chances(s, f).x * mirrored + again_size / max(again_all, 1e-30) * NoL * INVERSE_PI;
    return f.mirror * mirrored + parts.again * (again_share(s, parts, light) * NoL * INVERSE_PI);
}

// Whether some lobe of the surface is more than a single direction.
bool lobes_are_rough(surface s)
{
#ifdef HAS_CLEARCOAT
    if (square(s.coat_roughness) > FACET_ALPHA_MIN)
        return true;
#endif
    return facets_are_rough(s);
}

// Reflectance and density of lobe_mirrored_below() with the coat.
vec3 lobe_mirrored(surface s, split parts, float NoV, vec3 view, vec3 light, out float density)
{
    vec3 sent = lobe_mirrored_below(s, parts, NoV, view, light, density);
#ifdef HAS_CLEARCOAT
    float alpha = square(s.coat_roughness), chance = coat_chance_of(parts);
    density *= 1.0 - chance;
    if (alpha > FACET_ALPHA_MIN && chance > 0.0 && dot(s.coat_normal, light) > 0.0) {
        float cosine = coat_cosine(s, view), VoH = clamp(dot(view, normalize(view + light)), 1e-4, 1.0);
        float highlight = coat_highlight(s, parts.coat, view, light, s.coat_roughness);
        float lit = s.coat * fresnel_dielectric(VoH, COAT_IOR) * lit_share(cosine, dot(s.coat_normal, light), alpha);
        sent += highlight;
        density += chance * highlight / max(lit, 1e-7); // share sent to the coat, by its weight
    }
#endif
    return sent;
}

#ifdef HAS_AREA_LIGHTS
// The surface whose facets mirror lights: at least as rough as a highlight.
surface surface_of_highlights(surface s)
{
    s.roughness = max(s.roughness, ROUGHNESS_MIN_LIGHT);
#ifdef HAS_CLEARCOAT
    s.coat_roughness = max(s.coat_roughness, ROUGHNESS_MIN_LIGHT);
#endif
    return s;
}

float coat_share_of_highlights(split parts)
{
#ifdef HAS_CLEARCOAT
    return parts.coat.mirrors / max(parts.coat.mirrors + max_component(parts.mirror), 1e-9);
#else
    return 0.0;
#endif
}

// Chooses a direction (unit) from which a facet of such a surface, or of its coat, mirrors light to the eye.
vec3 highlight_choose(surface s, split parts, float NoV, vec3 view, vec2 u)
{
    float unused;
#ifdef HAS_CLEARCOAT
    if (is_in(coat_share_of_highlights(parts), u.x)) {
        vec3 x, y;
        tangent_frame(s.coat_normal, x, y);
        vec3 local = visible_facet(normalize(vec3(dot(view, x), dot(view, y), coat_cosine(s, view))),
                                   vec2(square(s.coat_roughness)), u);
        return reflect(-view, local.x * x + local.y * y + local.z * s.coat_normal);
    }
#endif
    return reflect(-view, facet_seen(s, NoV, -view, u, unused));
}

// Density of highlight_choose(), per steradian.
float highlight_density(surface s, split parts, float NoV, vec3 view, vec3 light)
{
    vec3 facet = normalize(view + light), x, y, local_view = facet_frame(s, NoV, -view, x, y);
    float VoH = clamp(dot(view, facet), 1e-4, 1.0), coat = coat_share_of_highlights(parts);
    vec3 local = vec3(dot(facet, x), dot(facet, y), dot(facet, s.normal));
    float density = (1.0 - coat) * visible_facet_density(local, local_view, VoH, sampled_alpha(s));
#ifdef HAS_CLEARCOAT
    tangent_frame(s.coat_normal, x, y);
    local_view = normalize(vec3(dot(view, x), dot(view, y), coat_cosine(s, view)));
    local = vec3(dot(facet, x), dot(facet, y), dot(facet, s.coat_normal));
    density += coat * visible_facet_density(local, local_view, VoH, vec2(square(s.coat_roughness)));
#endif
    return density / (4.0 * VoH);
}
#endif
