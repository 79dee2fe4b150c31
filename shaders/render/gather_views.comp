// SPDX-License-Identifier: MIT
// Reads the radiance of an eye's samples from the pictures of a key view's layers (shared/key_view.h): at the
// intersection of a ray with the structure of that view, which names the layer; a ray that met nothing gets the
// environment. Widmer and others. An Adaptive Acceleration Structure for Screen-space Ray Tracing. 2015, section 5.1.
//
// Coverage is 1 wherever there is a surface: the layer's radiance includes light through blended surfaces.
//
// Defines: those of common/environment.glsl; OPEN the environment counts as 1; HAS_UNKNOWN the share of samples that the
// key view does not show is a layer of the picture; EYES the places where rays meet the layers are texels of
// shared/eye_hit.h, not rays and intersections, with SPREAD of common/sample_place.glsl; HAS_LENS rays begin on a lens;
// KEY_LAYERS the number of layers; MARK writes where rays meet layers instead of radiance, and marks the texels needed to
// read it later; KEPT the picture has such places.

#include "shared/key_view.h"
#include "shared/eye_hit.h"
#include "shared/hit.h"
#include "shared/layers.h"
#include "common/dispatch.glsl"
#include "common/environment.glsl"
#include "common/sample_place.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

uniform vec3 key_right, key_up, key_back, key_eye; // axes of the key view in the world, and its eye
uniform vec2 key_extent;                           // half width and height at distance 1, or of an orthographic view
uniform uint key_orthographic;
uniform uint key_width, key_height;
uniform uint first_slot; // first slot of the slice
uniform float key_bound; // maximum error of the structure's inverse distances, 1 / metres
#ifdef HAS_UNKNOWN
uniform uint first_unknown; // index in the sums
#endif

#ifdef EYES
layout(binding = UNIT_SHADE_HITS) uniform samplerBuffer eye_hits;
#elif !defined KEPT
layout(binding = UNIT_RAYS) uniform samplerBuffer rays;
layout(binding = UNIT_SHADE_HITS) uniform usamplerBuffer hits;
#endif
layout(binding = UNIT_KEY_LAYER_0) uniform samplerBuffer key_layer_0;
#if KEY_LAYERS > 1
layout(binding = UNIT_KEY_LAYER_1) uniform samplerBuffer key_layer_1;
#endif
#if KEY_LAYERS > 2
layout(binding = UNIT_KEY_LAYER_2) uniform samplerBuffer key_layer_2;
#endif
layout(std430, binding = BIND_SLICE_SUMS) writeonly buffer sum_block { vec4 slice_sums[]; };
layout(std430, binding = BIND_KEY_COUNTS) buffer count_block { uint unknown_count; };
#ifdef MARK
layout(std430, binding = BIND_KEY_MARKS) writeonly buffer mark_block { uint marks[]; };
#endif
#ifdef KEPT
layout(std430, binding = BIND_ACCUMULATION) buffer accumulation_block { vec4 accumulation[]; };
uniform uint first_kept; // first slot of the slice, in its band
#endif
#ifdef HAS_UNKNOWN
layout(std430, binding = BIND_LAYER_SUMS) writeonly buffer layer_block { vec4 layer_sums[]; };
#endif

// Share of inverse distance, besides the structure's own bound, within which a ray meets a surface: inverse distances of
// surfaces some centimetres apart differ by more at the distances of a room.
const float SURFACE_SHARE = 0.01;

vec4 key_texel(uint layer, ivec2 p)
{
    p = clamp(p, ivec2(0), ivec2(key_width, key_height) - 1);
    int place = p.y * int(key_width) + p.x;
#if KEY_LAYERS > 2
    if (layer == 2u)
        return texelFetch(key_layer_2, place);
#endif
#if KEY_LAYERS > 1
    if (layer == 1u)
        return texelFetch(key_layer_1, place);
#endif
    return texelFetch(key_layer_0, place);
}

// Inverse distance, which is linear in the picture's coordinates on every plane; in an orthographic view the distance
// itself.
float straight(float distance_)
{
    if (key_orthographic != 0u)
        return distance_;
    return distance_ == KEY_INFINITE ? 0.0 : 1.0 / distance_;
}

#ifdef HAS_LENS
vec3 met_plane; // plane that was met last, in the key view: right, up and forward; a point on it has the product 1
bool has_plane = false;

// Notes the plane of a place: `depths` lie at the place and its neighbours to the right and below, and change evenly.
void note_plane(vec4 depths, vec2 place, float met)
{
    vec2 slope = vec2(depths.y - depths.x + depths.w - depths.z, depths.z - depths.x + depths.w - depths.y) * 0.5;
    vec2 half_size = vec2(key_width, key_height) * 0.5, scale = half_size / key_extent;
    met_plane = vec3(slope.x * scale.x, -slope.y * scale.y, met + dot(slope, half_size - place));
    has_plane = key_orthographic == 0u;
}
#endif

// Radiance from the four texels round a place, of which those count that agree with the surface that a ray met there.
// `known`: at least one of them does.
vec3 key_radiance(uint layer, vec2 place, float met, out bool known)
{
    vec2 corner = floor(place - 0.5), f = place - 0.5 - corner;
    ivec2 p = ivec2(corner);
    vec4 a = key_texel(layer, p), b = key_texel(layer, p + ivec2(1, 0));
    vec4 c = key_texel(layer, p + ivec2(0, 1)), d = key_texel(layer, p + ivec2(1, 1));
    vec4 there = vec4(greaterThanEqual(vec4(a.w, b.w, c.w, d.w), vec4(0.0)));
    vec4 depths = vec4(straight(a.w), straight(b.w), straight(c.w), straight(d.w));
    vec4 weights = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    float tolerance = SURFACE_SHARE * abs(met) + key_bound;
    // Four texels of one plane pass through the surface that was met, however steep it is.
    float fold = abs(depths.x - depths.y - depths.z + depths.w);
    bool plane = dot(there, vec4(1.0)) == 4.0 && fold <= tolerance && abs(dot(weights, depths) - met) <= tolerance;
#ifdef HAS_LENS
    if (plane)
        note_plane(depths, place, met);
#endif
    vec4 misfit = abs(depths - met) + (1.0 - there) * 1e30;
    float best = min(min(misfit.x, misfit.y), min(misfit.z, misfit.w));
    // Otherwise texels count that fit as well as the best one, within the difference that a steep surface may have
    // between texels.
    vec4 fits = vec4(lessThanEqual(misfit, vec4(best + tolerance))) * there;
    vec4 own = plane ? weights : fits * max(weights, vec4(1e-6));
    known = plane || best <= 0.1 * abs(met) + key_bound;
    float sum = max(dot(own, vec4(1.0)), 1e-30);
    return (own.x * a.rgb + own.y * b.rgb + own.z * c.rgb + own.w * d.rgb) / sum;
}

vec4 missed(vec3 direction)
{
    if (environment_is_hidden())
        return vec4(0.0);
    float coverage = frame.environment_kind != ENVIRONMENT_NONE ? 1.0 : 0.0;
#ifdef OPEN
    return vec4(vec3(1.0), coverage);
#else
    return vec4(environment_radiance(direction), coverage);
#endif
}

vec3 key_from_world(vec3 d)
{
    return vec3(dot(d, key_right), dot(d, key_up), -dot(d, key_back));
}

// Place in texels of a point along the axes of the key view, from its eye.
vec2 key_place(vec3 v)
{
    vec2 on_view = (key_orthographic != 0u ? v.xy : v.xy / v.z) / key_extent;
    return (vec2(on_view.x, -on_view.y) * 0.5 + 0.5) * vec2(key_width, key_height);
}

// Radiance at a place that a ray met. `known`: the layer shows it; false where the place is a guess, with perhaps nothing
// there.
vec3 met_radiance(vec4 met, uint layer, inout bool known, inout bool is_met)
{
    if (!known) { // the background beside the hiding surface, however far the point is from it
        vec4 shown = key_texel(layer, ivec2(floor(met.xy)));
        is_met = is_met && shown.w > 0.0;
        return shown.rgb;
    }
    return key_radiance(layer, met.xy, met.z, known);
}

#ifdef HAS_LENS
uniform uint lens_more; // samples of the lens besides the ray's own

// Adds other points of the lens, which see the plane that a ray has met without being traced: section 5.2 of the paper.
// They count as far as the layer shows that plane where they meet it. They lie round the lens's centre, at the ray's
// distance from it.
vec3 with_lens(uint k, vec3 origin, vec3 direction, uint layer, vec3 radiance)
{
    uvec2 pixel = pixel_of_slot(first_slot + (k >> frame.sample_shift));
    vec2 eye = eye_of_view(view_of_pixel(pixel)), on_lens = view_from_world_point(origin).xy - eye;
    vec3 forward = world_from_view_vector(vec3(0.0, 0.0, -1.0)), plane = met_plane;
    vec3 in_focus = key_from_world(origin + direction * (frame.lens.y / dot(direction, forward)) - key_eye);
    vec4 sum = vec4(radiance, 1.0);
    for (uint i = 1u; i <= lens_more; i++) {
        float angle = TWO_PI * float(i) / float(lens_more + 1u), c = cos(angle), s = sin(angle);
        vec2 turned = vec2(c * on_lens.x - s * on_lens.y, s * on_lens.x + c * on_lens.y);
        vec3 from = key_from_world(eye_world() + world_from_view_vector(vec3(eye + turned, 0.0)) - key_eye);
        vec3 towards = in_focus - from;
        float t = (1.0 - dot(plane, from)) / dot(plane, towards);
        vec3 p = from + t * towards;
        if (!(t > 0.0 && p.z > 0.0))
            continue;
        vec2 place = key_place(p);
        vec4 there = key_texel(layer, ivec2(floor(place)));
        bool known;
        vec3 more = key_radiance(layer, place, 1.0 / p.z, known);
        float off = (straight(there.w) - 1.0 / p.z) / (SURFACE_SHARE / p.z + key_bound);
        float weight = known && there.w > 0.0 ? exp(-off * off) : 0.0;
        sum += vec4(more, 1.0) * weight;
    }
    return sum.rgb / sum.a;
}
#endif

#ifdef MARK
// Marks the four texels that key_radiance() reads.
void mark(vec2 place, uint layer)
{
    ivec2 corner = ivec2(floor(place - 0.5)), last = ivec2(key_width, key_height) - 1;
    ivec2 low = clamp(corner, ivec2(0), last), high = clamp(corner + 1, ivec2(0), last);
    uint width = key_width, first = layer * width * key_height;
    marks[first + uint(low.y) * width + uint(low.x)] = 1u;
    marks[first + uint(low.y) * width + uint(high.x)] = 1u;
    marks[first + uint(high.y) * width + uint(low.x)] = 1u;
    marks[first + uint(high.y) * width + uint(high.x)] = 1u;
}
#endif

#if !defined EYES && !defined KEPT
vec4 origin, direction; // those of the ray

// Converts an intersection to the texel of shared/eye_hit.h.
vec4 eye_hit_of(uint k)
{
    origin = texelFetch(rays, int(2u * k));
    direction = texelFetch(rays, int(2u * k + 1u));
    uvec2 met = texelFetch(hits, int(3u * k)).xy;
    float distance_ = uintBitsToFloat(met.x);
    uint unknown = (met.y & HIT_UNKNOWN) != 0u ? EYE_UNKNOWN : 0u;
    if (!(direction.w > origin.w))
        return vec4(0.0, 0.0, 0.0, float(EYE_DEAD));
    if (!(distance_ >= 0.0))
        return vec4(0.0, 0.0, 0.0, float(unknown));
    vec3 v = key_from_world(origin.xyz + distance_ * direction.xyz - key_eye);
    uint layer = clamp((met.y & HIT_LAYER_MASK) >> HIT_LAYER_SHIFT, 1u, uint(KEY_LAYERS));
    return vec4(key_place(v), key_orthographic != 0u ? v.z : 1.0 / v.z, float(layer * EYE_LAYER + unknown));
}
#endif

vec4 met_by(uint k)
{
#ifdef KEPT
    vec4 kept = accumulation[first_kept + k];
    accumulation[first_kept + k] = vec4(0.0);
    return kept;
#elif defined EYES
    return texelFetch(eye_hits, int(k));
#else
    return eye_hit_of(k);
#endif
}

vec3 direction_of(uint k)
{
#if defined KEPT || defined EYES
    vec3 from, towards;
    float t_min;
    uvec2 in_view = pixel_in_view(pixel_of_slot(first_slot + (k >> frame.sample_shift)));
    camera_ray_through(place_of_sample(in_view, k & (1u << frame.sample_shift) - 1u), from, towards, t_min);
    return towards;
#else
    return direction.xyz;
#endif
}

void main()
{
    uint k = item_index();
    if (k >= wave.rays.count)
        return;
    vec4 met = met_by(k);
    uint bits = uint(met.w), layer = max(bits & EYE_LAYER_MASK, 1u) - 1u;
    bool is_met = (bits & EYE_LAYER_MASK) != 0u, known = (bits & EYE_UNKNOWN) == 0u;
#ifdef MARK
    if (is_met)
        mark(met.xy, layer);
    slice_sums[k] = met;
#else
    vec4 sum = vec4(0.0); // stays for a pixel beyond the picture's edge
    if (is_met)
        sum = vec4(met_radiance(met, layer, known, is_met), 1.0);
#ifdef HAS_LENS
    if (has_plane && known)
        sum.rgb = with_lens(k, origin.xyz, direction.xyz, layer, sum.rgb);
#endif
    if (!is_met && (bits & EYE_DEAD) == 0u)
        sum = missed(direction_of(k));
    slice_sums[k] = sum;
#ifdef HAS_UNKNOWN
    layer_sums[first_unknown + k] = vec4(vec3(known ? 0.0 : 1.0), 1.0);
#endif
    if (!known && wave.stopped == 0u)
        atomicAdd(unknown_count, 1u);
#endif
}
