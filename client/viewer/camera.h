/* SPDX-License-Identifier: MIT */
/* A camera that people move. World space, metres, radians; no window and no daemon. */
#ifndef FARLIGHT_CLIENT_VIEWER_CAMERA_H
#define FARLIGHT_CLIENT_VIEWER_CAMERA_H

#include "lib/farlight.h"

struct viewer_camera {
    double eye[3], look_at[3]; /* never the same place */
    double up[3];              /* unit; what the orbit's axis is */
    double fov_y;
};

double camera_distance(const struct viewer_camera *camera); /* from the eye to what is looked at */

/* About what is looked at, so that the view turns to the right and upwards. Stops before the poles. */
void camera_orbit(struct viewer_camera *camera, double right, double up);
/* The same about the eye: looks around. */
void camera_turn(struct viewer_camera *camera, double right, double up);
/* Moves picture and camera along: so much of the picture's height, at the distance of what is looked at. */
void camera_pan(struct viewer_camera *camera, double right, double up);
/* The distance is multiplied; not beyond `least` metres. */
void camera_dolly(struct viewer_camera *camera, double factor, double least);
/* Metres to the right, upwards and forwards, as seen; what is looked at comes along. */
void camera_fly(struct viewer_camera *camera, const double metres[3]);
/* Looks at another place from where it is; nothing happens if that is the eye. */
void camera_focus(struct viewer_camera *camera, const double place[3]);

/* From the eye through a place of the picture, shares of its width and height from the top left. Unit. */
void camera_ray(const struct viewer_camera *camera, double aspect, double x, double y, double direction[3]);

/* From a frame; `distance` is that of what it looks at. An orthographic one (fov_y 0) becomes one that sees as
 * much at that distance. */
void camera_from_frame(struct viewer_camera *camera, const struct fl_frame *frame, double distance);
/* Between two cameras, share 0 to 1 of the way, begun and ended gently. */
void camera_between(const struct viewer_camera *from, const struct viewer_camera *to, double share,
                    struct viewer_camera *camera);
void camera_export(const struct viewer_camera *camera, struct fl_view_camera *out); /* time and moving stay */

#endif
