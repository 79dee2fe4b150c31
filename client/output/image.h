/* SPDX-License-Identifier: MIT */
/* Encoding of pixels and their metadata as the bytes of an image file, in memory. C++ behind C. */
#ifndef FARLIGHT_CLIENT_OUTPUT_IMAGE_H
#define FARLIGHT_CLIENT_OUTPUT_IMAGE_H

#include "protocol/messages.h"
#include "raster.h"

#ifdef __cplusplus
extern "C" {
#endif

enum image_format {
    IMAGE_UNKNOWN,
    IMAGE_PNG,
    IMAGE_JPEG,
    IMAGE_EXR,
    IMAGE_HDR,
    IMAGE_WEBP,
    IMAGE_TIFF,
    IMAGE_GIF
};

/* Chooses by the path's ending, else by `fallback` ("png", ..). */
enum image_format image_format_of(const char *path, const char *fallback);
/* True if the module of library.h writes the format. */
bool image_needs_library(enum image_format format);

/* A picture of width x height whose part from (x, y) on the pixels are. */
struct image_window {
    uint32_t x, y, width, height;
};

struct mattes;

struct image {
    enum image_format format;
    bool half;                  /* EXR: half floats */
    bool dwaa;                  /* EXR: colours are compressed with loss */
    unsigned quality;           /* JPEG, WebP */
    float frames_per_second;    /* 0: unknown */
    bool full_metadata;         /* includes values that differ from run to run: times, the scene's revision */
    struct image_window window; /* EXR; no width: pixels are the whole picture */
    const char *light_groups;   /* EXR: "key,fill": names of their layers; NULL: none */
    const char *model;          /* metadata; may be empty */
    const char *part; /* EXR: the picture that the frame is a part of; NULL or empty: the frame is whole */
    const struct mattes *mattes; /* EXR: names for the layers of Cryptomatte; NULL: none */
    const float *origin;         /* metadata: position that was subtracted from the scene; NULL or 0: none */
    const char *colour_space, *display_view; /* conversion that the pixels have gone through; NULL: none */
    const float *chromaticities;             /* EXR: x and y of red, green, blue, white; NULL: unknown */
    const struct message_frame_begin *begin; /* encoding raw */
    const struct message_frame_end *end;
    const uint8_t *pixels;
};

/* *file is malloc'ed. False: `reason` is set. */
bool image_encode(const struct image *image, uint8_t **file, size_t *file_bytes, char *reason,
                  size_t reason_bytes);
/* Encodes a picture that is not a frame, as PNG or JPEG. */
bool image_encode_plain(enum image_format format, const struct raster *raster, const char *description,
                        uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
