// SPDX-License-Identifier: MIT
// Rays of pinhole eyes near a view's own eye, in the space of its face (quadtree/layout.h).
//
// In a face (x, y) is linear in w along a ray: far + w * along. `far` is the ray's place at infinity, and follows from
// its direction alone.
#include "quadtree/node.glsl"

// Directions of pixels in the eye's view: the top left corner and the steps to the right and down, as right, down and
// forward of the face, the first two in texels.
uniform vec3 eye_corner, eye_right, eye_down;
// Offset of the eye of the picture's first view from the face's eye, in the same units; and the steps to the eyes of the
// next views.
uniform vec3 eye_first, eye_across, eye_below;

struct eye_line {
    vec2 far, along;
    float cosine; // cosine of its angle with the forward direction
};

vec3 eye_of(uvec2 view)
{
    return eye_first + float(view.x) * eye_across + float(view.y) * eye_below;
}

vec3 direction_through(vec2 place)
{
    return eye_corner + place.x * eye_right + place.y * eye_down;
}

eye_line line_of(vec3 eye, vec3 direction)
{
    vec2 heading = direction.xy * (1.0 / direction.z);
    vec2 aside = heading / quadtree.scale_centre.xy;
    return eye_line(quadtree.scale_centre.zw + heading, (eye.xy - eye.z * heading) * (1.0 / quadtree.depths.x),
                    inversesqrt(1.0 + dot(aside, aside)));
}
