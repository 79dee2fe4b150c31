/* SPDX-License-Identifier: MIT */
/* From frames to the bytes of a video file. The only place that uses libavcodec and libavformat. */
#ifndef FARLIGHT_CLIENT_VIDEO_ENCODE_H
#define FARLIGHT_CLIENT_VIDEO_ENCODE_H

#include "protocol/messages.h"

/* What is wrong, for an answer. */
struct video_failure {
    const char *field;
    char reason[512];
    const char *remedy;
    bool lacks_space; /* on the disk */
};
/* Returns false. */
bool video_fail(struct video_failure *failure, const char *field, const char *remedy, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

enum video_pixels {
    VIDEO_YCBCR,   /* BT.709, 4:2:0 */
    VIDEO_RGB,     /* as they are */
    VIDEO_RGBA,    /* likewise, with alpha */
    VIDEO_PALETTE, /* 255 colours for all pictures, and one that lets the picture before shine through */
};

/* What a video will be; made of a request. */
struct video_plan {
    const char *container; /* the library's name: "mp4", "matroska", "webp", "gif" */
    const char *encoder;   /* the library's name */
    enum video_pixels pixels;
    const struct palette_maker *palette; /* of a GIF */
    bool lossless;
    unsigned quality; /* on the encoder's scale; lossless, or of a GIF: without meaning */
    uint32_t rate_numerator, rate_denominator;
};
/* Chooses container and encoder. False: the request cannot be met. */
bool video_plan(struct video_plan *plan, const struct message_video_begin *wanted, struct video_failure *failure);
/* Whether the encoder's format has pictures of this size. */
bool video_plan_allows(const struct video_plan *plan, uint32_t width, uint32_t height,
                       struct video_failure *failure);

struct video_encoder;

struct video_source {
    uint32_t width, height;
    const char *model; /* for the metadata; may be empty */
    int fd;            /* empty file, open for reading and writing; stays the caller's */
};

/* The file is valid once video_encoder_finish has returned true. NULL: see `failure`. */
struct video_encoder *video_encoder_create(const struct video_plan *plan, const struct video_source *source,
                                           struct video_failure *failure);
/* `pixels`: rgba8 of the source's size. */
bool video_encoder_write(struct video_encoder *encoder, const uint8_t *pixels, struct video_failure *failure);
bool video_encoder_finish(struct video_encoder *encoder, struct video_failure *failure);
/* Of the video: even where the encoder needs that. */
void video_encoder_size(const struct video_encoder *encoder, uint32_t *width, uint32_t *height);
void video_encoder_destroy(struct video_encoder *encoder);

/* From now on the libraries' log goes into error texts instead of being printed. */
void video_keep_log(void);

#endif
