/* SPDX-License-Identifier: MIT */
/* Cameras: placed from an eye or around bounds, divided into views, and as the shaders take them. */
#ifndef FARLIGHT_RENDER_CONTEXT_CAMERA_H
#define FARLIGHT_RENDER_CONTEXT_CAMERA_H

#include "render/context/request.h"
#include "shared/frame.h"
#include "gpu_scene/scene.h"

/* How a camera that sees all of some bounds is placed. Angles in radians. */
struct frame_framing {
    float azimuth, elevation; /* the eye's: from +z about +y towards +x, and above the horizon */
    float fov_y;              /* before the zoom */
    float margin; /* share of the picture that stays free beside the bounds, at each edge, before the zoom */
    float zoom;   /* scales the picture about its middle */
};
/* A camera that sees everything, as near as that allows: two opposite edges of the picture, or of the margin, are
 * touched. It depends on the extent along these directions: the greatest dot product with a point for each.
 * `size`: the whole's, in metres; the eye is at least a part of that before it. */
#define FRAME_CAMERA_DIRECTIONS 5
void frame_camera_directions(double directions[FRAME_CAMERA_DIRECTIONS][3], const struct frame_framing *framing,
                             float aspect);
void frame_camera_around(struct frame_camera *camera, const struct frame_framing *framing, float aspect,
                         const double supports[FRAME_CAMERA_DIRECTIONS], double size);
/* Places a camera of path auto around a box. */
void frame_camera_auto(struct frame_camera *camera, const struct frame_framing *framing, const float lower[3],
                       const float upper[3], float aspect);
/* Pixels of one view. */
void frame_view_size(const struct frame_request *request, uint32_t *width, uint32_t *height);
bool frame_has_views(const struct frame_request *request); /* more than one */
/* How far the eye of view (across, down) lies from the camera, along its right and up; metres. */
void frame_view_eye(const struct frame_request *request, uint32_t across, uint32_t down, float eye[2]);
/* From eye, target and up; false if they do not span a view. */
bool frame_camera_look_at(struct frame_camera *camera, const float eye[3], const float look_at[3],
                          const float up[3], float fov_y);
/* Fills the camera's and the lens's part of the uniforms; a near, far or focal distance that the request leaves
 * open comes from the scene. */
void camera_fill_uniforms(struct frame_uniforms *uniforms, const struct frame_request *request,
                          const struct gpu_scene *scene);

#endif
