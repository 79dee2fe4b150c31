/* SPDX-License-Identifier: MIT */
/* Comparison of a view's tracer with the reference: all rays of its picture by both, and the difference of the
 * two pictures, as by `farlight compare --tracers`. */
#ifndef FARLIGHT_CLIENT_WEB_ERROR_MAP_H
#define FARLIGHT_CLIENT_WEB_ERROR_MAP_H

#include "lib/farlight.h"

#define ERROR_MAP_SAMPLES 4u /* samples of a pixel: the reference may take long */
#define ERROR_MAP_PIXELS_MAX                                                                                      \
    921600u /* 1280 x 720: a larger picture is compared at a smaller size, for the same reason */

/* A comparison; zero: none. */
struct error_map {
    uint32_t id;            /* number of the request */
    struct fl_job *job;     /* job of the tracer, then of the reference */
    struct fl_frame *frame; /* the tracer's frame, with the results of its rays; NULL: not finished */
    struct message_render render;
    struct record_camera_key key;
    struct record_clip_use clip;
};

/* Starts a comparison, after ending an earlier one. `camera` NULL: the view's own. */
bool error_map_begin(struct error_map *map, struct fl_scene *scene, const struct message_render *view,
                     const struct fl_view_camera *camera, struct fl_error *error);
/* Advances without waiting. True, once: `frame` has the tracer's pixels, whose first frame->width *
 * frame->height bytes are replaced by the errors, 0 to 255: the difference of the display values, the maximum
 * of a pixel's channels. False: not finished, or an error. */
bool error_map_step(struct error_map *map, struct fl_scene *scene, struct fl_error *error);
void error_map_end(struct error_map *map);

#endif
