/* SPDX-License-Identifier: MIT */
/* From pixels and their metadata to the bytes of an image file, in memory. The only place that uses OpenImageIO;
 * C++ behind C. */
#ifndef FARLIGHT_CLIENT_OUTPUT_IMAGE_H
#define FARLIGHT_CLIENT_OUTPUT_IMAGE_H

#include "protocol/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

enum image_format { IMAGE_UNKNOWN, IMAGE_PNG, IMAGE_JPEG, IMAGE_EXR, IMAGE_HDR };

/* By the path's ending, else by `fallback` ("png", ..). */
enum image_format image_format_of(const char *path, const char *fallback);

struct image {
    enum image_format format;
    bool half;                               /* EXR: half floats */
    unsigned quality;                        /* JPEG */
    float frames_per_second;                 /* 0: unknown */
    const char *model;                       /* for the metadata; may be empty */
    const struct message_frame_begin *begin; /* encoding raw */
    const struct message_frame_end *end;
    const uint8_t *pixels;
};

/* Makes the libraries load their plug-ins while that is still allowed. False: a format is missing; its name is in
 * `reason`. */
bool image_prepare(char *reason, size_t reason_bytes);
/* *file is malloc'ed. False: `reason` says why. */
bool image_encode(const struct image *image, uint8_t **file, size_t *file_bytes, char *reason,
                  size_t reason_bytes);

/* A picture that is no frame. */
struct plain_image {
    enum image_format format; /* PNG or JPEG */
    uint32_t width, height;
    const float *pixels; /* red, green, blue, sRGB, 0 to 1 */
    const char *description;
};
/* As image_encode. */
bool image_encode_plain(const struct plain_image *image, uint8_t **file, size_t *file_bytes, char *reason,
                        size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
