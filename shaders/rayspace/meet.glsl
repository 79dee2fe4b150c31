// SPDX-License-Identifier: MIT
// Whether a ray of a bundle may meet a bounding sphere and box. Errs towards a meeting only; NaN counts as one.
#include "rayspace/ray.glsl"

// Bounds in world space.
struct bounds {
    vec3 centre;
    float radius;
    vec3 lower, upper;
};

// Tests the cone from the sphere's centre against the sphere enlarged by the radius of the origins (section 3.3.1). The
// distance from the axis is that of a difference, not of squares: near the axis these cancel.
bool cone_meets_sphere(bundle b, vec3 centre, float radius)
{
    vec3 q = centre - b.centre;
    float reach = b.radius + radius, far = b.end + reach, squared = dot(q, q);
    float along = dot(q, b.axis), across = length(q - along * b.axis);
    bool inside = b.secant == 0.0 || squared <= reach * reach;
    bool beside = across * (1.0 - 3.8147e-6) > along * b.tangent + reach * b.secant;
    return !(squared > far * far) && (inside || !(along < -reach || beside));
}

// Tests where rays of the bundle may enter and leave the box along each axis, by intervals of origins and directions.
bool slabs_meet_box(bundle b, vec3 lower, vec3 upper)
{
    bvec3 forward = greaterThan(b.direction_lower, vec3(1e-6)), backward = lessThan(b.direction_upper, vec3(-1e-6));
    vec3 fast = mix(-b.direction_lower, b.direction_upper, forward);
    vec3 slow = mix(-b.direction_upper, b.direction_lower, forward);
    // Distance to the near side from the nearest origin, and to the far side from the farthest one.
    vec3 to_near = mix(b.origin_lower - upper, lower - b.origin_upper, forward);
    vec3 to_far = mix(b.origin_upper - lower, upper - b.origin_lower, forward);
    bvec3 one_way = bvec3(forward.x || backward.x, forward.y || backward.y, forward.z || backward.z);
    vec3 enter = mix(vec3(0.0), max(to_near, 0.0) / fast, one_way);
    vec3 leave = mix(vec3(3e38), to_far / slow, one_way);
    // Along an axis where directions differ in sign, the bundle misses a box beside it that it does not approach.
    bvec3 below = lessThan(b.origin_upper, lower), above = greaterThan(b.origin_lower, upper);
    bvec3 away = bvec3(below.x && b.direction_upper.x <= 0.0 || above.x && b.direction_lower.x >= 0.0,
                       below.y && b.direction_upper.y <= 0.0 || above.y && b.direction_lower.y >= 0.0,
                       below.z && b.direction_upper.z <= 0.0 || above.z && b.direction_lower.z >= 0.0);
    float first = max_component(enter), last = min(b.end, min(leave.x, min(leave.y, leave.z)));
    return !(first > last * PRUNE_SLACK) && !any(away) && last >= 0.0;
}

bool may_meet(bundle b, bounds what)
{
    if (b.end < 0.0)
        return false;
#ifdef RAYSPACE_SPHERES
    return cone_meets_sphere(b, what.centre, what.radius);
#else
    return cone_meets_sphere(b, what.centre, what.radius) && slabs_meet_box(b, what.lower, what.upper);
#endif
}
