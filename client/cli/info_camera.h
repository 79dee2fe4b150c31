/* SPDX-License-Identifier: MIT */
/* The camera of 'farlight info --camera'. */
#ifndef FARLIGHT_CLI_INFO_CAMERA_H
#define FARLIGHT_CLI_INFO_CAMERA_H

#include "lib/farlight.h"

#include <jansson.h>

struct cli_info_camera {
    double eye[3], target[3], up[3]; /* world space; the target is as far away as the middle of the model */
    double fov_degrees;              /* vertical; 0: orthographic */
    double ortho_height;             /* metres */
};

/* Starts a daemon, and imports the model again. */
bool cli_info_find_camera(const struct fl_load_options *load, const struct fl_model_info *info,
                          struct cli_info_camera *camera, struct fl_error *error);
/* Prints the camera in a line of options for 'farlight render'. */
void cli_info_print_camera(const struct cli_info_camera *camera);
json_t *cli_info_camera_json(const struct cli_info_camera *camera); /* the caller owns it */

#endif
