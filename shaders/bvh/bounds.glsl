// SPDX-License-Identifier: MIT
// A ray against the bound of an element: a sphere (BVH_SPHERES) or a box. Both tests only ever err towards a hit.
//
// Rounding, with u = 2^-24. Box: a plane b is crossed at b i - o i, i = 1 / d. Its error is at most 4 u (|b| + |o|) |i|:
// the reciprocal 1 u (2.5 u on hardware), each product 1 u, the difference 1 u. The part of b is in the box: the
// builder pads it by 2^-21 |b| = 8 u |b|. The part of o is in `near_offset` and `far_offset`: 2^-21 |o i|, 8 u
// again. What the intersection of the primitive itself rounds is of the same size and has the other half.
// Sphere: distances from the line are squared, so the slack is that of the squared radius; the builder pads the radius by
// 8 u (|centre| + radius), the test adds RELATIVE_SLACK of the squared distance from the origin.

const float RELATIVE_SLACK = 4.76837158e-7; // 2^-21

#ifdef BVH_SPHERES

struct bound_ray {
    vec3 origin;
    vec3 direction;
    float inverse_square; // 1 / dot(direction, direction)
};

bound_ray bound_ray_of(vec3 origin, vec3 direction)
{
    return bound_ray(origin, direction, 1.0 / dot(direction, direction));
}

// Hit if the line passes the sphere, and the sphere is not all behind t_min nor beyond t_max.
bool bound_is_hit(bound_ray r, uvec4 lower, uvec4 upper, float t_min, float t_max)
{
    vec3 to_centre = uintBitsToFloat(lower.xyz) - r.origin;
    float closest = dot(to_centre, r.direction) * r.inverse_square;
    vec3 from_line = to_centre - closest * r.direction;
    float squared_radius = uintBitsToFloat(upper.x) + RELATIVE_SLACK * dot(to_centre, to_centre);
    float squared_half_chord = squared_radius - dot(from_line, from_line);
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

bound_ray bound_ray_of(vec3 origin, vec3 direction)
{
    // A component of zero would give infinite times zero. The replacement moves the ray sideways by 1e-12 of its
    // way, which is far below the slack.
    float smallest = 1e-12 * greatest(abs(direction));
    vec3 d = mix(direction, vec3(smallest), lessThan(abs(direction), vec3(smallest)));
    vec3 inverse = 1.0 / d;
    vec3 offset = origin * inverse;
    vec3 slack = RELATIVE_SLACK * abs(offset);
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
