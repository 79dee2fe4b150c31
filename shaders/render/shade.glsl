// SPDX-License-Identifier: MIT
// Input and output of the integrators' shading passes: a hit of the wave in; its children and shadow rays out, with the
// light of these if they are not blocked. Hits are in the order of the list, j is the place in it.
//
// Defines: HAS_TIMES something moves: rays have a time; those of render/light_layers.glsl.

#include "shared/path.h"
#include "shared/ray.h"
#include "common/cone.glsl"
#include "common/dispatch.glsl"
#include "common/grain.glsl"
#include "common/material.glsl"
#include "common/sequence.glsl"
#include "common/slots.glsl"
#include "render/light_layers.glsl"
#include "render/path_texels.glsl"

layout(local_size_x = 64) in;

uniform uint first_slot; // first slot of the slice
uniform uint wave_number;
uniform uint last_wave;  // 1: no children
uniform uint children_a_hit; // capacity
uniform uint shadow_rays_a_hit;

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // texels: software GL fetches these faster
layout(binding = UNIT_SHADE_HITS) uniform usamplerBuffer hits;
layout(binding = UNIT_SHADE_PATHS) uniform usamplerBuffer paths;
layout(std430, binding = BIND_HIT_LIST) readonly buffer list_block { uint hit_list[]; };
layout(std430, binding = BIND_RADIANCE) writeonly buffer radiance_block { vec4 radiance[]; };
layout(std430, binding = BIND_CHILDREN) writeonly buffer child_block { uvec4 children[]; }; // CHILD_TEXELS each
layout(std430, binding = BIND_CHILD_COUNTS) buffer count_block { uint child_counts[]; };
layout(std430, binding = BIND_SHADOW_RAYS) writeonly buffer shadow_block { ray shadow_rays[]; };
layout(std430, binding = BIND_LIGHT_SAMPLES) writeonly buffer sample_block { vec4 light_samples[]; };
#ifdef HAS_TIMES
layout(std430, binding = BIND_RAY_TIMES) writeonly buffer time_block { float shadow_times[]; };
#endif

const float FAR = 1e30;

ray ray_at(uint k)
{
    return ray(texelFetch(rays, int(2u * k)), texelFetch(rays, int(2u * k + 1u)));
}

hit hit_at(uint k)
{
    uvec4 a = texelFetch(hits, int(3u * k)), b = texelFetch(hits, int(3u * k + 1u)), c = texelFetch(hits, int(3u * k + 2u));
    return hit(uintBitsToFloat(a.x), a.y, a.z, a.w, b, c.x, c.y, c.z, c.w);
}

path path_at(uint k)
{
    int texel = int(k) * PATH_TEXELS;
    return path_of_texels(texelFetch(paths, texel), texelFetch(paths, texel + 1), texelFetch(paths, texel + 2));
}

// Pixel and sample of a path, for common/sequence.glsl. In a picture of tiles (render/tiles.glsl) it is another pixel,
// but no two have the same.
uvec2 path_seed(path p)
{
    uvec2 pixel = pixel_of_slot(first_slot + (p.sample_slot >> frame.sample_shift));
    return sequence_seed(pixel_in_view(pixel), frame.seed);
}

uint path_sample(path p)
{
    return frame.sample_index + (p.sample_slot & (1u << frame.sample_shift) - 1u);
}

vec2 cone_at(path p, float distance_)
{
    return vec2(p.cone_width + p.cone_spread * distance_, p.cone_spread);
}

surface surface_of_path(path p, hit h, ray r)
{
    surface s = surface_at(h, r.origin_t_min.xyz, r.direction_t_max.xyz, cone_at(p, h.distance).x);
    if (s.emission_seen_only && (p.flags & PATH_STEP_MASK) != 0u) // a rough surface has sent the ray
        s.emission = vec3(0.0);
#ifdef HAS_DISPERSION
    s.carried = vec3(p.weight_r, p.weight_g, p.weight_b);
#endif
    return s;
}

// Weight of the light that a surface sends along a path: the path's, less the absorption of the body whose surface is met
// from inside. A body within another body counts as in air.
vec3 weight_at(path p, surface s, float distance_)
{
    vec3 weight = vec3(p.weight_r, p.weight_g, p.weight_b);
#ifdef HAS_VOLUME
    if (in_glass(s))
        weight *= exp(-s.absorption * distance_);
#endif
    return weight;
}

// Cone of a ray that a surface sends on. `solid_angle`: see add_child().
vec2 cone_sent_on(vec2 cone, surface s, vec3 direction, float solid_angle)
{
    float cosine = dot(direction, s.normal);
    if (dot(direction, s.geometric) > 0.0) {
        cone = cone_mirrored(cone, s.curvature);
    } else {
        float eta = index_ratio(s), sine_squared = min(square(eta) * (1.0 - square(cosine)), 0.99);
        cone = cone_refracted(cone, s.curvature, eta, sqrt(1.0 - sine_squared), max(-cosine, 0.1));
    }
    return solid_angle > 0.0 ? cone_scattered(cone, solid_angle) : cone;
}

// Solid angle over which the surface's roughness spreads a mirrored or refracted ray, steradians; for a smooth one 0.
float rough_solid_angle(surface s, vec3 direction)
{
    return lobe_solid_angle(facets_alpha(s), turn_of(s, dot(direction, s.geometric) > 0.0));
}

// Solid angle of the directions that one of the pixel's samples represents, if it was chosen with a density of 1 /
// `solid_angle`. The cone is half as wide as its share: at full width the noise is 2 dB lower still, but models whose
// textures are atlases are 1 dB farther from the truth at 64 samples, as a wide footprint extends over other parts of the
// image.
float sample_solid_angle(float solid_angle)
{
    return square(0.5 * frame.far_width.y) * solid_angle;
}

vec3 off_surface(surface s, float distance_, vec3 side)
{
    return s.position + PATH_OFFSET * max(max_component(abs(s.position)), distance_) * side;
}

// Origin of a shadow ray in a direction. `origin`: of those on the viewer's side.
vec3 origin_towards(surface s, vec3 origin, float distance_, vec3 direction)
{
#ifdef HAS_DIFFUSE_TRANSMISSION
    if (dot(direction, s.geometric) < 0.0)
        return off_surface(s, distance_, -s.geometric);
#endif
    return origin;
}

uint child_count = 0u, child_octant = 0u;

// Adds a child; one without weight or direction, or beyond the depth, is skipped. Other values are the parent's.
// `solid_angle`: of the directions that it represents, steradians; 0: a smooth mirror or window sends it on, or it goes
// straight on.
void add_child(uint j, path parent, surface s, float distance_, vec3 direction, vec3 weight, bool straight,
               float solid_angle)
{
    uint bounces = (parent.flags & PATH_BOUNCES_MASK) + (straight ? 0u : 1u);
    if (!(dot(direction, direction) > 0.5) || last_wave != 0u || bounces > frame.depth)
        return;
    if (!(max_component(weight) > 0.0)) // true for NaN too
        return;
    vec3 side = dot(direction, s.geometric) > 0.0 ? s.geometric : -s.geometric;
    path p = parent;
    p.weight_r = weight.r;
    p.weight_g = weight.g;
    p.weight_b = weight.b;
    vec2 cone = cone_at(parent, distance_);
#ifdef HAS_TEXTURES // only textures are filtered by it
    if (!straight)
        cone = cone_sent_on(cone, s, direction, solid_angle);
#endif
    p.cone_width = cone.x;
    p.cone_spread = cone.y;
    uint kept = straight ? ~PATH_BOUNCES_MASK : ~(PATH_BOUNCES_MASK | PATH_STRAIGHT);
    p.flags = bounces | parent.flags & kept;
    uint texel = uint(CHILD_TEXELS) * (j * children_a_hit + child_count);
    children[texel] = floatBitsToUint(vec4(off_surface(s, distance_, side), 0.0));
    children[texel + 1u] = floatBitsToUint(vec4(direction, FAR));
    path_texels texels = texels_of_path(p);
    children[texel + 2u] = texels.a;
    children[texel + 3u] = texels.b;
    children[texel + 4u] = texels.c;
    uvec3 negative = uvec3(lessThan(direction, vec3(0.0)));
    child_octant = negative.x | negative.y << 1 | negative.z << 2;
    child_count++;
}

#ifdef LIGHT_LAYERS
uint group_of_instance(uint instance_index)
{
#ifdef LIGHT_GROUPS
    if (instance_index != HIT_NO_PRIMITIVE)
        return instance_at(instance_index).flags >> INSTANCE_LIGHT_GROUP_SHIFT & INSTANCE_LIGHT_GROUP_MASK;
#endif
    return 0u;
}

// Notes light that an integrator writes to radiance[]; ground.comp replaces it where the hit is the ground's.
void note_sent(path p, hit h, light_part part, vec3 light)
{
    if ((h.material & HIT_GROUND) == 0u)
        note_part(p, part, light);
}
#endif

void put_light_sample(uint place, vec4 light)
{
#ifdef LIGHT_LAYERS
    light_samples[2u * place] = light;
    light_samples[2u * place + 1u] = vec4(light.rgb * ray_part.mirrored, code_of(ray_part));
#else
    light_samples[place] = light;
#endif
}

void no_shadow_ray(uint place)
{
    if (shadow_rays_a_hit == 0u) // there is no place for one either
        return;
    shadow_rays[place] = ray(vec4(0.0), vec4(0.0, 0.0, 1.0, -1.0));
    put_light_sample(place, vec4(0.0)); // a dead ray is not blocked, so it must have no light
#ifdef HAS_TIMES
    shadow_times[place] = 0.0;
#endif
}

// Adds a shadow ray. `arriving`: the radiance at the eye if the ray reaches the light. False if it is zero. `t_min`: 0 or
// RAY_STOPS_T_MIN.
bool add_shadow_ray_from(uint place, path p, vec3 origin, vec3 direction, float t_min, float distance_, vec3 arriving)
{
    bool alive = max_component(arriving) > 0.0; // false for NaN
    if (!alive && shadow_rays_a_hit == 0u)
        return false;
    // The ray ends short of the light, as a model may have a surface at its position. Both cases share one store, as each
    // store is code.
    vec4 start = vec4(origin, t_min), way = vec4(direction, distance_ * (1.0 - 4.0 * PATH_OFFSET));
    shadow_rays[place] = ray(alive ? start : vec4(0.0), alive ? way : vec4(0.0, 0.0, 1.0, -1.0));
    put_light_sample(place, alive ? vec4(arriving, 0.0) : vec4(0.0));
#ifdef HAS_TIMES
    shadow_times[place] = alive ? p.time : 0.0;
#endif
    return alive;
}

bool add_shadow_ray(uint place, path p, vec3 origin, vec3 direction, float distance_, vec3 arriving)
{
    return add_shadow_ray_from(place, p, origin, direction, 0.0, distance_, arriving);
}

// Notes the children of a hit. `first`: the first batch of the wave's shadow rays, which also emits the children.
void note_children(uint j, bool first, uint shadow_rays_alive)
{
    uint before = first ? child_count | child_octant << CHILD_OCTANT_SHIFT : child_counts[j];
    child_counts[j] = before + (shadow_rays_alive << SHADOW_RAYS_SHIFT);
}
