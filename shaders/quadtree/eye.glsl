// SPDX-License-Identifier: MIT
// The rays of pinhole eyes near that of a view, in the space of its face (quadtree/layout.h).
//
// In a face (x, y) is linear in w along a ray: far + w * along. `far` is where the ray goes, far away, and follows from
// its direction alone; the eye's place adds what is left.
#include "quadtree/node.glsl"

// Of pixels of the eye's view from its top left: right, down and forward in the face, the first two in texels.
uniform vec3 eye_corner, eye_right, eye_down;
// Of the eye of the picture's first view, from that of the face, likewise; and from it to those of the next ones.
uniform vec3 eye_first, eye_across, eye_below;
uniform float eye_near; // along the eye's view, metres
uniform float eye_far;  // from the face's eye, beyond all that it sees, metres

struct eye_line {
    vec2 far, along;
    float w_near; // where it begins, or comes before the eye of the face
    float w_last; // beyond which there is nothing
};

vec3 eye_of(uvec2 view)
{
    return eye_first + float(view.x) * eye_across + float(view.y) * eye_below;
}

// Of an eye; `place`: in pixels of its view.
eye_line line_through(vec3 eye, vec2 place)
{
    vec3 direction = eye_corner + place.x * eye_right + place.y * eye_down;
    vec2 scale = quadtree.scale_centre.xy, heading = direction.xy / direction.z;
    float unit = quadtree.depths.x, near = quadtree.depths.w;
    float reach = (length(vec3(eye.xy / scale, eye.z)) + eye_far) / length(vec3(direction.xy / scale, direction.z));
    eye_line line;
    line.far = quadtree.scale_centre.zw + heading;
    line.along = (eye.xy - eye.z * heading) / unit;
    line.w_near = unit / max(eye.z + eye_near * direction.z, near);
    line.w_last = unit / max(eye.z + reach * direction.z, near);
    return line;
}
