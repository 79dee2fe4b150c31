/* SPDX-License-Identifier: MIT */
/* Destinations of pictures: names of image files, folders and standard output. */
#ifndef FARLIGHT_OPTIONS_IMAGE_PATH_H
#define FARLIGHT_OPTIONS_IMAGE_PATH_H

#include "lib/farlight.h"

#include <sys/types.h>

enum cli_image {
    CLI_IMAGE_UNKNOWN,
    CLI_IMAGE_PNG,
    CLI_IMAGE_JPEG,
    CLI_IMAGE_EXR,
    CLI_IMAGE_HDR,
    CLI_IMAGE_WEBP,
    CLI_IMAGE_TIFF,
    CLI_IMAGE_GIF,
    CLI_IMAGE_MP4, /* first of the videos, which only animations write */
    CLI_IMAGE_MKV,
    CLI_IMAGE_Y4M,
    CLI_IMAGE_MOVING_WEBP,
    CLI_IMAGE_MOVING_GIF,
    CLI_IMAGE_COUNT
};

/* Recognise a format by its name ("png", ..) or by a path's ending; letter case does not matter. */
enum cli_image cli_image_by_name(const char *name);
enum cli_image cli_image_by_path(const char *path);
const char *cli_image_name(enum cli_image image);
bool cli_image_is_video(enum cli_image image);
/* Format of a series: WebP and GIF are animated pictures if the path has no place for the frame's number. */
enum cli_image cli_image_of_series(enum cli_image image, const char *path);
/* The name of a file without its folders. */
const char *cli_base_name(const char *path);
/* True if a file can be created at `path`, which is not created. `folder` gets its folder; a missing one is
 * checked to be creatable. */
bool cli_check_output(const char *path, char *folder, size_t folder_bytes, struct fl_error *error);
/* Refuses a missing folder, which may be misspelt or not mounted, unless `parents` allows making it. */
bool cli_check_folder(const char *path, const char *folder, bool parents, struct fl_error *error);
/* Makes the folder, and its parents, if they are missing. */
bool cli_make_folder(const char *folder, struct fl_error *error);
/* Replaces a file as a whole. */
bool cli_write_text(const char *path, const char *text, mode_t rights, struct fl_error *error);
/* Checks that writing to `path`, named by `option`, overwrites none of the inputs; NULL among them is skipped. */
bool cli_check_not_input(const char *path, const char *option, const char *const *inputs, size_t count,
                         struct fl_error *error);
/* Checks that a comparison of the inputs can write its picture to the path: PNG or JPEG, and none of the
 * inputs. Makes its folder. NULL: there is no picture. */
bool cli_check_error_picture(const char *picture, const char *const *inputs, size_t count, struct fl_error *error);
/* Makes a folder in $TMPDIR for a file that is then copied to standard output or a device. */
bool cli_temporary_folder(char *folder, size_t folder_bytes, struct fl_error *error);
/* Refuses a terminal as standard output; `what` would be written: "an image". */
bool cli_check_stdout(const char *what, struct fl_error *error);
/* Writes all bytes. False: errno has the reason. */
bool cli_write_all(int fd, const char *bytes, size_t count);
/* Copies a file to a device; NULL: standard output. */
bool cli_copy_to(const char *device, const char *path, struct fl_error *error);

#endif
