// SPDX-License-Identifier: MIT
// Sampling of emissive triangles from a point: the tree of shared/emitter.h chooses one by power, distance and the angles
// on both sides; then a direction to it is chosen, or, where it looks small, a point of it by its area. Conty Estevez,
// Kulla. Importance Sampling of Many Lights with Adaptive Tree Splitting. 2018.
//
// Defines: HAS_EMITTERS the scene has some; those of common/motion.glsl and common/texture.glsl; HAS_TEXTURES some
// material has a texture.

#include "shared/emitter.h"
#include "shared/hit.h"
#include "common/motion.glsl"
#include "common/texture.glsl"
#include "common/unit.glsl"

#ifdef HAS_EMITTERS

struct emitter_sample {
    vec3 direction; // unit
    float distance_;
    vec3 radiance;
    float probability; // per steradian; 0: there is no sample
    uint instance;
};

emitter_starts find_emitters()
{
    uvec4 first = texelFetch(tables, 1), second = texelFetch(tables, 2);
    return emitter_starts(first.x, first.y, first.z, first.w, second.x, second.y, uintBitsToFloat(second.z), 0u);
}

emitter_node emitter_node_at(uint first_texel, uint index)
{
    int texel = int(first_texel + index * EMITTER_NODE_TEXELS);
    uvec4 second = texelFetch(tables, texel + 1);
    vec2 numbers = uintBitsToFloat(second.yz);
    return emitter_node(uintBitsToFloat(texelFetch(tables, texel)), second.x, numbers.x, numbers.y, second.w);
}

emitter_leaf emitter_leaf_at(uint first_texel, uint index)
{
    int texel = int(first_texel + index * EMITTER_LEAF_TEXELS);
    uvec4 first = texelFetch(tables, texel);
    return emitter_leaf(first.x, first.y, first.z, first.w, texelFetch(tables, texel + 1).x, 0u, 0u, 0u);
}

// Cosine of the difference of two angles of 0..pi; of 0 where the second one is larger.
float cosine_within(float cosine, float other)
{
    float sines = sqrt(max((1.0 - cosine * cosine) * (1.0 - other * other), 0.0));
    return cosine >= other ? 1.0 : cosine * other + sines;
}

// Minimum cosine at the receiver, whose normal is known only up to this (emitter_normal of path.comp).
const float EMITTER_COSINE_SLACK = 0.01;

// Upper estimate of the irradiance of a node's emitters at a point, without shadows: above 0 wherever light may arrive.
float emitter_importance(emitter_node node, vec3 position, vec3 normal)
{
    vec3 to_middle = node.centre_radius.xyz - position;
    float squared = max(dot(to_middle, to_middle), 1e-30), radius_squared = square(node.centre_radius.w);
    to_middle *= inversesqrt(squared);
    bool inside = squared <= radius_squared;
    // Cosine of half the angle under which the node is seen.
    float seen = inside ? -1.0 : sqrt(1.0 - radius_squared / squared);
    float received = cosine_within(dot(normal, to_middle), seen) + EMITTER_COSINE_SLACK;
    float sent = cosine_within(cosine_within(abs(dot(unpack_unit(node.axis), to_middle)), node.cos_spread), seen);
    received = inside ? 1.0 : received;
    sent = inside ? 1.0 : sent;
    return max(received, 0.0) * max(sent, 0.0) * node.power / max(squared, radius_squared);
}

float emitter_estimate(vec3 position, vec3 normal)
{
    return emitter_importance(emitter_node_at(find_emitters().nodes, 0u), position, normal);
}

// A triangle's corners in world space, and twice its area along its normal.
struct emitter_triangle {
    vec3 corner, first_edge, second_edge, across;
    uvec4 indices_material;
};

emitter_triangle emitter_triangle_at(uint instance_index, uint primitive, float time)
{
    instance i = instance_at_time(instance_index, time);
    uint close_offset = close_offset_of(i.geometry);
    emitter_triangle t;
    t.indices_material = texelFetch(triangles, int(primitive));
    vec3 corner = position_at_time(t.indices_material.x, close_offset, time);
    vec3 second = position_at_time(t.indices_material.y, close_offset, time) - corner;
    vec3 third = position_at_time(t.indices_material.z, close_offset, time) - corner;
    t.corner = affine_point(i.world_from_object, corner);
    t.first_edge = affine_vector(i.world_from_object, second);
    t.second_edge = affine_vector(i.world_from_object, third);
    t.across = cross(t.first_edge, t.second_edge);
    return t;
}

// A triangle seen from a point.
struct emitter_view {
    vec3 first, second, third; // unit, towards the corners
    float solid_angle;         // 0: sampled by its area
};

// Solid angles, steradians, between which directions are sampled: below, sampling by the area is as good, and the angles
// of the spherical triangle are imprecise; above, they are too.
const float EMITTER_ANGLE_MIN = 0.01, EMITTER_ANGLE_MAX = 6.25;

// View of a triangle, with its solid angle: Van Oosterom, Strackee. The Solid Angle of a Plane Triangle. 1983.
emitter_view emitter_view_of(emitter_triangle t, vec3 position)
{
    vec3 first = t.corner - position, second = first + t.first_edge, third = first + t.second_edge;
    vec3 lengths = vec3(length(first), length(second), length(third));
    float volume = abs(dot(first, t.across)) / max(lengths.x * lengths.y * lengths.z, 1e-30);
    first /= max(lengths.x, 1e-30);
    second /= max(lengths.y, 1e-30);
    third /= max(lengths.z, 1e-30);
    float angle = 2.0 * azimuth(volume, 1.0 + dot(first, second) + dot(second, third) + dot(third, first));
    return emitter_view(first, second, third, angle > EMITTER_ANGLE_MIN && angle < EMITTER_ANGLE_MAX ? angle : 0.0);
}

// Density per steradian of a point that is uniform on the triangle; 0: seen edge on.
float emitter_density(emitter_view view, vec3 across, vec3 direction, float distance_)
{
    float facing = 0.5 * abs(dot(across, direction)); // area times cosine
    float by_area = facing > 1e-7 * dot(across, across) / max(length(across), 1e-30) ? square(distance_) / facing : 0.0;
    return view.solid_angle > 0.0 ? 1.0 / view.solid_angle : by_area;
}

// Angle between two unit vectors, exact for small ones.
float angle_between(vec3 a, vec3 b)
{
    return azimuth(length(cross(a, b)), dot(a, b));
}

// A direction that is uniform in the spherical triangle: Arvo. Stratified Sampling of Spherical Triangles. 1995.
vec3 emitter_direction(emitter_view view, vec2 u)
{
    vec3 ab = normalize(cross(view.first, view.second)), bc = normalize(cross(view.second, view.third));
    vec3 ca = normalize(cross(view.third, view.first));
    float alpha = angle_between(ab, -ca), sin_alpha = sin(alpha), cos_alpha = cos(alpha);
    // u.x cuts off a triangle with that share of the area and the same first two corners; u.y is the way from the second
    // one to the far side.
    float area = u.x * (alpha + angle_between(bc, -ab) + angle_between(ca, -bc) - PI);
    float sine = -sin(area - alpha), cosine = -cos(area - alpha);
    float k = cosine + cos_alpha, l = sine - sin_alpha * dot(view.first, view.second);
    float divisor = (l * sine + k * cosine) * sin_alpha;
    float along = abs(divisor) > 1e-12 ? clamp((l + (l * cosine - k * sine) * cos_alpha) / divisor, -1.0, 1.0) : 1.0;
    vec3 side = view.third - dot(view.third, view.first) * view.first;
    vec3 last = along * view.first + sqrt(1.0 - along * along) * normalize(side);
    float z = 1.0 - u.y * (1.0 - dot(last, view.second));
    return z * view.second + sqrt(max(1.0 - z * z, 0.0)) * normalize(last - dot(last, view.second) * view.second);
}

// Weights of the second and third corner at the triangle's point in a direction.
vec2 emitter_weights(emitter_triangle t, vec3 position, vec3 direction)
{
    vec3 to_corner = t.corner - position;
    vec3 from_corner = direction * (dot(to_corner, t.across) / dot(direction, t.across)) - to_corner;
    vec2 weights = vec2(dot(cross(from_corner, t.second_edge), t.across), dot(cross(t.first_edge, from_corner), t.across)) /
                   dot(t.across, t.across);
    weights = clamp(weights, 0.0, 1.0); // NaN becomes 0
    return weights / max(weights.x + weights.y, 1.0);
}

// Chooses a leaf of a node's tree. `number` chooses it and is stretched to [0, 1) again; the probability is that of the
// leaf.
uint emitter_choose_leaf(uint nodes, vec3 position, vec3 normal, inout float number, out float probability)
{
    uint link = emitter_node_at(nodes, 0u).link;
    probability = 1.0;
    for (int depth = 0; depth < EMITTER_DEPTH_MAX && (link & EMITTER_LEAF) == 0u; depth++) {
        emitter_node first = emitter_node_at(nodes, link), second = emitter_node_at(nodes, link + 1u);
        float own = emitter_importance(first, position, normal), both = own + emitter_importance(second, position, normal);
        float share = both > 0.0 ? own / both : 0.0;
        bool taken = number < share;
        number = min(taken ? number / share : (number - share) / (1.0 - share), 0.99999994);
        probability *= both > 0.0 ? (taken ? share : 1.0 - share) : 0.0;
        link = taken ? first.link : second.link;
    }
    return link & ~EMITTER_LEAF;
}

// Probability with which emitter_choose_leaf() chooses this leaf.
float emitter_leaf_probability(uint nodes, uint trail, vec3 position, vec3 normal, bool asked)
{
    uint link = asked ? emitter_node_at(nodes, 0u).link : EMITTER_LEAF;
    float probability = 1.0;
    for (int depth = 0; depth < EMITTER_DEPTH_MAX && (link & EMITTER_LEAF) == 0u; depth++) {
        emitter_node first = emitter_node_at(nodes, link), second = emitter_node_at(nodes, link + 1u);
        float own = emitter_importance(first, position, normal), both = own + emitter_importance(second, position, normal);
        float share = both > 0.0 ? own / both : 0.0;
        bool taken = (trail >> uint(depth) & 1u) == 0u;
        probability *= both > 0.0 ? (taken ? share : 1.0 - share) : 0.0;
        link = taken ? first.link : second.link;
    }
    return probability;
}

// End of the share of the i-th triangle of a leaf.
float emitter_share_end(uint shares, emitter_leaf leaf, uint i)
{
    uint place = leaf.first_share + i;
    return uintBitsToFloat(texelFetch(tables, int(shares + place / 4u))[place % 4u]);
}

float emitter_share(uint shares, emitter_leaf leaf, uint i)
{
    return emitter_share_end(shares, leaf, i) - (i > 0u ? emitter_share_end(shares, leaf, i - 1u) : 0.0);
}

// Chooses a triangle of a leaf, counted from its first one.
uint emitter_choose_triangle(uint shares, emitter_leaf leaf, inout float number, inout float probability)
{
    uint low = 0u, high = leaf.count - 1u;
    while (low < high) {
        uint middle = (low + high) / 2u;
        bool beyond = emitter_share_end(shares, leaf, middle) <= number;
        low = beyond ? middle + 1u : low;
        high = beyond ? high : middle;
    }
    if (leaf.count > 1u) {
        float share = emitter_share(shares, leaf, low);
        number = clamp((number - emitter_share_end(shares, leaf, low) + share) / max(share, 1e-30), 0.0, 0.99999994);
        probability *= share;
    }
    return low;
}

vec3 emitter_radiance(uvec4 indices_material, vec2 weights)
{
    material m = material_at(indices_material.w & HIT_MATERIAL_MASK);
    vec3 radiance = m.emission_ior.rgb;
#ifdef HAS_TEXTURES
    if (m.texture_emission != 0u) {
        vec4 uv01 = texelFetch(texcoords, int(indices_material.x)) * (1.0 - weights.x - weights.y) +
                    texelFetch(texcoords, int(indices_material.y)) * weights.x +
                    texelFetch(texcoords, int(indices_material.z)) * weights.y;
        radiance *= sample_slot(m.texture_emission, uv01).rgb;
    }
#endif
    return radiance;
}

// Samples a point of the emitters. `u`: two numbers in [0, 1) that choose the triangle and the point on it.
emitter_sample emitter_sample_at(vec3 position, vec3 normal, vec2 u, float time)
{
    emitter_starts starts = find_emitters();
    float probability;
    emitter_leaf leaf = emitter_leaf_at(starts.leaves, emitter_choose_leaf(starts.nodes, position, normal, u.x, probability));
    uint primitive = leaf.first_primitive + emitter_choose_triangle(starts.shares, leaf, u.x, probability);
    emitter_triangle t = emitter_triangle_at(leaf.instance, primitive, time);
    emitter_view view = emitter_view_of(t, position);
    float root = sqrt(u.x);
    vec2 weights = vec2(root * (1.0 - u.y), root * u.y);
    if (view.solid_angle > 0.0)
        weights = emitter_weights(t, position, emitter_direction(view, u));
    vec3 to_point = t.corner + weights.x * t.first_edge + weights.y * t.second_edge - position;
    emitter_sample result;
    result.distance_ = length(to_point);
    result.direction = to_point / max(result.distance_, 1e-30);
    result.probability = probability * emitter_density(view, t.across, result.direction, result.distance_);
    result.radiance = emitter_radiance(t.indices_material, weights);
    result.instance = leaf.instance;
    return result;
}

// Stands for emitter_probability() where hits do not say which triangle they are on: the density of a point that is
// uniform on all emitters, as if it faced the ray.
float emitter_rough_probability(float distance_)
{
    return square(distance_) / max(find_emitters().area, 1e-30);
}

// The last run that begins at or before a triangle of an instance.
emitter_run emitter_find_run(emitter_starts starts, uint instance_index, uint primitive, bool asked)
{
    uint low = 0u, high = asked ? starts.run_count : 0u;
    while (high > low + 1u) {
        uint middle = (low + high) / 2u;
        uvec2 key = texelFetch(tables, int(starts.runs + middle)).xy;
        bool beyond = key.x > instance_index || key.x == instance_index && key.y > primitive;
        low = beyond ? low : middle;
        high = beyond ? middle : high;
    }
    uvec4 found = texelFetch(tables, int(starts.runs + low));
    return emitter_run(found.x, found.y, found.z, found.w);
}

// Density per steradian with which emitter_sample_at() finds the point that a ray from `position` hit; 0: it never does.
// `asked`: false skips the work.
float emitter_probability(vec3 position, vec3 normal, uint instance_index, uint primitive, vec3 direction,
                          float distance_, float time, bool asked)
{
    emitter_starts starts = find_emitters();
    emitter_run run = emitter_find_run(starts, instance_index, primitive, asked);
    uint ordinal = primitive - run.first_primitive;
    if (!asked || run.instance != instance_index || ordinal >= run.count)
        return 0.0;
    uint place = ordinal / starts.cluster_size;
    emitter_leaf leaf = emitter_leaf_at(starts.leaves, run.first_leaf + place);
    float probability = emitter_leaf_probability(starts.nodes, leaf.trail, position, normal, asked);
    if (leaf.count > 1u)
        probability *= emitter_share(starts.shares, leaf, ordinal - place * starts.cluster_size);
    emitter_triangle t = emitter_triangle_at(instance_index, primitive, time);
    return probability * emitter_density(emitter_view_of(t, position), t.across, direction, distance_);
}

#endif
