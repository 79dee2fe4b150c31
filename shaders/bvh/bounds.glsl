// SPDX-License-Identifier: MIT
// A ray against the bound of an element: a sphere (BVH_SPHERES) or a box. Both tests only ever err towards a hit.
//
// Rounding, with u = 2^-24. A box's plane b is crossed at b i - o i, i = 1 / d: the reciprocal errs by 1 u (2.5 u
// on hardware), each product by 1 u, the difference by 1 u, which moves the plane by at most 5 u (|b| + |o|). The
// intersection of the primitive itself errs by about as much (corners are taken relative to the origin), and a
// sphere's distance from the line by less than 8 u of the same. The part of b is in the bounds: the builder pads
// them by BVH_PAD_RELATIVE = 8 u of their magnitude. The part of o is the slack of the ray: OBJECT_SLACK |o| with
// 16 u. In the top tree the ray is yet to be taken to an object's space, which rounds again, by some 6 u |o| in
// that space, and so by that times the matrix's condition in this one: WORLD_SLACK is 128 u, for conditions up to
// 20.
const float OBJECT_SLACK = 9.5367431640625e-7;  // 2^-20
const float WORLD_SLACK = 7.62939453125e-6;     // 2^-17

#ifdef BVH_SPHERES

struct bound_ray {
    vec3 origin;
    vec3 direction;
    float inverse_square; // 1 / dot(direction, direction)
    float slack;
};

bound_ray bound_ray_of(vec3 origin, vec3 direction, float relative_slack)
{
    return bound_ray(origin, direction, 1.0 / dot(direction, direction), relative_slack * length(origin));
}

// Hit if the line passes the sphere, and the sphere is not all behind t_min nor beyond t_max.
bool bound_is_hit(bound_ray r, uvec4 lower, uvec4 upper, float t_min, float t_max)
{
    vec3 to_centre = uintBitsToFloat(lower.xyz) - r.origin;
    float closest = dot(to_centre, r.direction) * r.inverse_square;
    vec3 from_line = to_centre - closest * r.direction;
    float squared_half_chord = square(uintBitsToFloat(upper.x) + r.slack) - dot(from_line, from_line);
    float outside = max(closest - t_max, t_min - closest);
    // negated so that what is not a number counts as a hit
    return !(squared_half_chord < 0.0) &&
           !(outside > 0.0 && outside * outside > squared_half_chord * r.inverse_square) && t_min < t_max;
}

#else

struct bound_ray {
    vec3 inverse;
    vec3 near_offset;
    vec3 far_offset;
    bvec3 is_negative;
};

bound_ray bound_ray_of(vec3 origin, vec3 direction, float relative_slack)
{
    // A component of zero would give infinite times zero. The replacement moves the ray sideways by 1e-12 of its
    // way, which is far below the slack.
    float smallest = 1e-12 * greatest(abs(direction));
    vec3 d = mix(direction, vec3(smallest), lessThan(abs(direction), vec3(smallest)));
    vec3 inverse = 1.0 / d;
    vec3 offset = origin * inverse;
    vec3 slack = relative_slack * abs(offset);
    return bound_ray(inverse, offset + slack, offset - slack, lessThan(d, vec3(0.0)));
}

bool bound_is_hit(bound_ray r, uvec4 lower, uvec4 upper, float t_min, float t_max)
{
    uvec3 near_corner = mix(lower.xyz, upper.xyz, r.is_negative);
    uvec3 far_corner = mix(upper.xyz, lower.xyz, r.is_negative);
    vec3 enter = uintBitsToFloat(near_corner) * r.inverse - r.near_offset;
    vec3 leave = uintBitsToFloat(far_corner) * r.inverse - r.far_offset;
    float t_enter = max(greatest(enter), t_min);
    float t_leave = min(min(leave.x, leave.y), min(leave.z, t_max));
    return !(t_enter > t_leave); // negated so that what is not a number counts as a hit
}

#endif
