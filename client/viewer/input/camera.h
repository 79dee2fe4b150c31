/* SPDX-License-Identifier: MIT */
/* The camera that the user moves. World space, metres, radians; independent of window and daemon. */
#ifndef FARLIGHT_VIEWER_INPUT_CAMERA_H
#define FARLIGHT_VIEWER_INPUT_CAMERA_H

#include "lib/farlight.h"

struct viewer_camera {
    double eye[3], look_at[3]; /* always different places */
    double up[3];              /* unit vector; the orbit's axis */
    double fov_y;
};

double camera_distance(const struct viewer_camera *camera); /* from the eye to the target */

/* Orbits about the target, so that the view turns to the right and upwards. Stops before the poles. */
void camera_orbit(struct viewer_camera *camera, double right, double up);
/* Turns about the eye in the same way. */
void camera_turn(struct viewer_camera *camera, double right, double up);
/* The angles by which camera_orbit() or camera_turn() turns the view of `from` into the direction of `to`,
 * about the axis of `to`. */
void camera_swing(const struct viewer_camera *from, const struct viewer_camera *to, double *right, double *up);
/* Pans by a share of the picture's height at the target's distance. */
void camera_pan(struct viewer_camera *camera, double right, double up);
/* Multiplies the distance to the target, which stays at least `minimum` metres. */
void camera_dolly(struct viewer_camera *camera, double factor, double minimum);
/* Moves by metres to the right, upwards and forwards in the view, together with the target. */
void camera_fly(struct viewer_camera *camera, const double metres[3]);
/* Turns to another target; has no effect if that is the eye. */
void camera_focus(struct viewer_camera *camera, const double place[3]);

/* The unit direction from the eye through a point of the picture, in shares of its width and height from the top
 * left. */
void camera_ray(const struct viewer_camera *camera, double aspect, double x, double y, double direction[3]);

/* Sets the camera from a frame; `distance` is the target's. An orthographic camera (fov_y 0) becomes a
 * perspective one with the same extent at that distance. */
void camera_from_frame(struct viewer_camera *camera, const struct fl_frame *frame, double distance);
/* Interpolates between two cameras, share 0 to 1, easing in and out. */
void camera_between(const struct viewer_camera *from, const struct viewer_camera *to, double share,
                    struct viewer_camera *camera);
/* Rows of the matrix from the view's space (along -z, y upwards) to the world's. */
void camera_pose(const struct viewer_camera *camera, float world_from_view[12]);
/* Leaves time and moving unchanged */
void camera_export(const struct viewer_camera *camera, struct fl_view_camera *out);

#endif
