// SPDX-License-Identifier: MIT
// A ray among the cells of a cube that was sampled along three axes.
//
// In the cube it is p(s) = o + s d, in cells, and the greatest component of d is 1 (or -1), so `s` too counts cells,
// along the axis that the ray runs along most. In an image the components are u, v, depth.
#include "common/candidate.glsl"

// A ray's component where it has none: it moves by less than a thousandth of a cell on its way through a cube, and
// no quotient is infinite.
const float CELL_RAY_LEAST_SLOPE = 1e-8;

// From so far away, in cells, floats round places by more than what planes are told apart by: a ray that comes from
// farther is taken to begin nearer, or it would step and cross a little beside itself.
const float CELL_RAY_FAR = 16384.0;

struct cell_ray {
    vec3 o, d;
    float scale; // s of a distance; 0: the direction is no direction, and the ray goes nowhere
    float begin; // s of the ray where it is taken to begin; less than where it comes to the cube by its length or more
};

vec3 without_zeros(vec3 d)
{
    const float small = CELL_RAY_LEAST_SLOPE;
    vec3 least_ = vec3(d.x < 0.0 ? -small : small, d.y < 0.0 ? -small : small, d.z < 0.0 ? -small : small);
    return mix(d, least_, lessThan(abs(d), vec3(small)));
}

// `place`: the cube's lower corner, world; size of a cell. `cells`: along a side.
cell_ray cell_ray_of(trace_ray r, vec4 place, float cells)
{
    vec3 size = abs(r.direction);
    float length_ = greatest(size);
    cell_ray c;
    c.scale = length_ / place.w;
    // Written so that what is no number, or too small or large for its inverse to be one, goes nowhere.
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

// Where [lower, upper] of the ray is inside a box; all of it behind the other where it is not.
void clip(inout float s_first, inout float s_end, vec3 o, vec3 inverse, vec3 lower, vec3 upper)
{
    vec3 a = (lower - o) * inverse, b = (upper - o) * inverse;
    vec3 near = min(a, b), far = max(a, b);
    s_first = max(s_first, greatest(near));
    s_end = min(s_end, least(far));
}
