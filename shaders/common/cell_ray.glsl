// SPDX-License-Identifier: MIT
// A ray in the cells of a cube that is sampled along three axes.
//
// In the cube it is p(s) = o + s d, in cells, and the largest component of d is 1 (or -1), so `s` too counts cells,
// along the ray's dominant axis. In an image the components are u, v, depth.
#include "common/candidate.glsl"

// Replaces a direction's zero component: the ray moves by less than a thousandth of a cell through a cube, and no
// quotient is infinite.
const float CELL_RAY_MIN_SLOPE = 1e-8;

// Distance, in cells, at which floats round positions by more than the distance of distinct planes: the origin of a ray
// from farther away is moved nearer, or its steps and intersections would be off.
const float CELL_RAY_FAR = 16384.0;

struct cell_ray {
    vec3 o, d;
    float scale; // s per distance; 0: the direction is invalid, and the ray hits nothing
    float begin; // s of the moved origin; smaller than that of the cube's entry by the cube's length or more
};

vec3 without_zeros(vec3 d)
{
    const float small = CELL_RAY_MIN_SLOPE;
    vec3 smallest = vec3(d.x < 0.0 ? -small : small, d.y < 0.0 ? -small : small, d.z < 0.0 ? -small : small);
    return mix(d, smallest, lessThan(abs(d), vec3(small)));
}

// Makes the ray. `place`: the cube's lower corner, world; size of a cell. `cells`: along a side.
cell_ray cell_ray_of(trace_ray r, vec4 place, float cells)
{
    vec3 size = abs(r.direction);
    float length_ = max_component(size);
    cell_ray c;
    c.scale = length_ / place.w;
    // The form of the conditions makes a direction that is NaN, or too small or large for a finite inverse, hit nothing.
    vec3 away = abs(r.origin);
    bool is_direction = length_ > 1e-30 && size.x + size.y + size.z < 1e30 && away.x + away.y + away.z < 1e30;
    c.scale = is_direction ? c.scale : 0.0;
    c.o = (r.origin - place.xyz) / place.w;
    c.d = without_zeros(is_direction ? r.direction / length_ : vec3(1.0, 0.0, 0.0));
    vec3 ahead = -c.o * c.d;
    float along = size.x == length_ ? ahead.x : size.y == length_ ? ahead.y : ahead.z;
    c.begin = along - 2.0 * cells;
    c.begin = c.begin > CELL_RAY_FAR ? c.begin : 0.0;
    c.o += c.begin * c.d;
    return c;
}

// Clips the interval of the ray to a box [lower, upper]; s_first > s_end if the ray misses it.
void clip(inout float s_first, inout float s_end, vec3 o, vec3 inverse, vec3 lower, vec3 upper)
{
    vec3 a = (lower - o) * inverse, b = (upper - o) * inverse;
    vec3 near = min(a, b), far = max(a, b);
    s_first = max(s_first, max_component(near));
    s_end = min(s_end, min_component(far));
}
