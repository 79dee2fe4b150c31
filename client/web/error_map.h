/* SPDX-License-Identifier: MIT */
/* A tracer against the reference, beside a view: all rays of its picture by both, and the difference of the two
 * pictures, as `farlight compare --tracers` has them. */
#ifndef FARLIGHT_CLIENT_WEB_ERROR_MAP_H
#define FARLIGHT_CLIENT_WEB_ERROR_MAP_H

#include "lib/farlight.h"

#define ERROR_MAP_SAMPLES 4u /* of a pixel: the reference may take long */
#define ERROR_MAP_PIXELS_MAX                                                                                      \
    921600u /* 1280 x 720: a larger picture is compared at a smaller size, for the same reason */

/* Zero: nothing is compared. */
struct error_map {
    uint32_t id;            /* of the request */
    struct fl_job *job;     /* of the tracer, then of the reference */
    struct fl_frame *frame; /* the tracer's, with what came of its rays; NULL: not yet */
    struct message_render render;
    struct record_camera_key key;
    struct record_clip_use clip;
};

/* Ends an earlier one. `camera` NULL: the view's own. */
bool error_map_begin(struct error_map *map, struct fl_scene *scene, const struct message_render *view,
                     const struct fl_view_camera *camera, struct fl_error *error);
/* True, once: `frame` has the tracer's pixels, the first frame->width * frame->height bytes of them replaced by
 * the errors, 0 to 255: the difference of the display values, the maximum of a pixel's channels. False: not yet,
 * or an error. Never waits. */
bool error_map_step(struct error_map *map, struct fl_scene *scene, struct fl_error *error);
void error_map_end(struct error_map *map);

#endif
