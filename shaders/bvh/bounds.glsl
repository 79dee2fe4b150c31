// SPDX-License-Identifier: MIT
// Tests of rays against the bound of an element: spheres (BVH_SPHERES), boxes in floats, or boxes on the tree's grid
// (BVH_PACKED), whose cells are then the unit of the ray too. The tests err only towards a hit.
#include "tree/slack.glsl"

// Grid of the traversed tree; without one: 0 and 1.
struct tree_grid {
    vec3 lower;
    vec3 cells_per_unit;
};

#ifdef BVH_SPHERES

struct bound_ray {
    vec3 origin;
    vec3 direction;
    float inverse_square; // 1 / dot(direction, direction)
    float slack;
};

// Whether the line intersects the sphere, and the sphere is not entirely before t_min or beyond t_max.
bool sphere_is_hit(bound_ray r, vec4 centre_radius, float t_min, float t_max)
{
    vec3 to_centre = centre_radius.xyz - r.origin;
    float closest = dot(to_centre, r.direction) * r.inverse_square;
    vec3 from_line = to_centre - closest * r.direction;
    float squared_half_chord = square(centre_radius.w + r.slack) - dot(from_line, from_line);
    float outside = max(closest - t_max, t_min - closest);
    // Negated so that NaN counts as a hit.
    return !(squared_half_chord < 0.0) &&
           !(outside > 0.0 && outside * outside > squared_half_chord * r.inverse_square) && t_min < t_max;
}

// The rays of the packet, each with a test of its own. `alive` has a bit for each ray.
struct bundle {
    bound_ray rays[PACKET_RAYS];
    uint octant;
};

bundle bundle_of(object_ray o[PACKET_RAYS], uint alive, int leading, tree_grid grid, float slack)
{
    bundle b;
    b.octant = 0u;
    for (int k = 0; k < PACKET_RAYS; k++) {
        vec3 d = o[k].direction;
        b.rays[k] = bound_ray(o[k].origin, d, 1.0 / dot(d, d), slack * length(o[k].origin));
        if (k == leading)
            b.octant = (d.x < 0.0 ? 1u : 0u) | (d.y < 0.0 ? 2u : 0u) | (d.z < 0.0 ? 4u : 0u);
    }
    return b;
}

#else

// Interval of the distances at which the rays of a packet intersect the planes of boxes: a test of eight rays costs as
// much as one of two. Wald, Boulos, Shirley, Ray Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies, ACM
// TOG 2007, section 4.2 (interval arithmetic). A plane at p is hit at (p - c) i - e, with c the leading ray's origin, i
// of a ray between the minimum and the maximum inverse direction, e how far the ray's own origin is off c; e and the
// slack are in the offsets. Along an axis where the rays' directions differ in sign nothing is culled: scales are 0
// there, and offsets beyond everything. One ray has no interval: its minimum and maximum are equal.
struct bundle {
    vec3 scale_min, near_offset_min, far_offset_min;
#if PACKET_RAYS > 1
    vec3 scale_max, near_offset_max, far_offset_max;
#endif
    uint octant;
};

const float NOWHERE = 3e38;

bundle bundle_of(object_ray o[PACKET_RAYS], uint alive, int leading, tree_grid grid, float slack)
{
    vec3 scale[PACKET_RAYS], origin[PACKET_RAYS], slacks[PACKET_RAYS];
    vec3 centre = vec3(0.0), scale_leading = vec3(0.0);
    for (int k = 0; k < PACKET_RAYS; k++) {
        // A zero component would give infinity times zero. Its replacement moves the ray sideways by 1e-12 of its length,
        // far below the slack.
        vec3 d = o[k].direction * grid.cells_per_unit;
        float smallest = 1e-12 * max_component(abs(d));
        scale[k] = 1.0 / mix(d, vec3(smallest), lessThan(abs(d), vec3(smallest)));
        vec3 origin_here = o[k].origin;
#ifdef SHARED_ORIGIN
        origin_here = o[0].origin;
#endif
        origin[k] = (origin_here - grid.lower) * grid.cells_per_unit;
        slacks[k] = slack * (abs(origin_here) + abs(grid.lower)) * grid.cells_per_unit * abs(scale[k]);
        if (k == leading) {
            centre = origin[k];
            scale_leading = scale[k];
        }
    }
    bundle b;
    uvec3 negative = uvec3(lessThan(scale_leading, vec3(0.0)));
    b.octant = negative.x | negative.y << 1 | negative.z << 2;
#if PACKET_RAYS == 1
    b.scale_min = scale_leading;
    b.near_offset_min = centre * scale_leading + slacks[0];
    b.far_offset_min = centre * scale_leading - slacks[0];
#else
    vec3 minimum = scale_leading, maximum = scale_leading, before = vec3(-NOWHERE), after = vec3(NOWHERE);
    for (int k = 0; k < PACKET_RAYS; k++) {
#ifdef SHARED_ORIGIN
        vec3 off = vec3(0.0);
#else
        vec3 off = (origin[k] - centre) * scale[k];
#endif
        // The products centre * scale round as the ray's own would: the slack includes that.
        bool counts = (alive & 1u << k) != 0u;
        minimum = counts ? min(minimum, scale[k]) : minimum;
        maximum = counts ? max(maximum, scale[k]) : maximum;
        before = counts ? max(before, off + slacks[k]) : before;
        after = counts ? min(after, off - slacks[k]) : after;
    }
    bvec3 mixed = notEqual(lessThan(minimum, vec3(0.0)), lessThan(maximum, vec3(0.0)));
    b.scale_min = mix(minimum, vec3(0.0), mixed);
    b.scale_max = mix(maximum, vec3(0.0), mixed);
    b.near_offset_min = mix(centre * minimum + before, vec3(NOWHERE), mixed);
    b.near_offset_max = mix(centre * maximum + before, vec3(NOWHERE), mixed);
    b.far_offset_min = mix(centre * minimum + after, vec3(-NOWHERE), mixed);
    b.far_offset_max = mix(centre * maximum + after, vec3(-NOWHERE), mixed);
#endif
    return b;
}

// Tests a box. `near`, `far`: the corners that rays of the packet's octant reach first and last.
bool box_is_hit(bundle b, vec3 near, vec3 far, float t_min, float t_max)
{
    vec3 enter = near * b.scale_min - b.near_offset_min;
    vec3 leave = far * b.scale_min - b.far_offset_min;
#if PACKET_RAYS > 1
    vec3 enter_other = near * b.scale_max - b.near_offset_max;
    vec3 leave_other = far * b.scale_max - b.far_offset_max;
    enter = mix(enter_other, enter, lessThan(enter, enter_other));
    leave = mix(leave_other, leave, greaterThan(leave, leave_other));
#endif
    // NaN is ignored or, in the last comparison, counts as a hit: hence the negation.
    float enter_xy = max(enter.x, enter.y), enter_z = max(enter.z, t_min);
    float leave_xy = min(leave.x, leave.y), leave_z = min(leave.z, t_max);
    return !(max(enter_xy, enter_z) > min(leave_xy, leave_z));
}

#endif
