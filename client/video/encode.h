/* SPDX-License-Identifier: MIT */
/* Encoding of frames as a video file; the only user of libavcodec and libavformat. */
#ifndef FARLIGHT_CLIENT_VIDEO_ENCODE_H
#define FARLIGHT_CLIENT_VIDEO_ENCODE_H

#include "protocol/messages.h"

/* A failure, as an answer reports it. */
struct video_failure {
    const char *field;
    char reason[512];
    const char *remedy;
    bool lacks_space; /* true if the disk is full */
};
/* Returns false. */
bool video_fail(struct video_failure *failure, const char *field, const char *remedy, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

enum video_pixels {
    VIDEO_YCBCR,   /* BT.709, 4:2:0 */
    VIDEO_RGB,     /* unchanged colours */
    VIDEO_RGBA,    /* unchanged colours and alpha */
    VIDEO_PALETTE, /* 255 colours for all pictures, and one that leaves the previous picture's pixel */
};

/* Parameters of a video, derived from a request. */
struct video_plan {
    const char *container; /* the library's name: "mp4", "matroska", "webp", "gif" */
    const char *encoder;   /* the library's name */
    enum video_pixels pixels;
    const struct palette_maker *palette; /* GIF only */
    bool lossless;
    unsigned quality; /* on the encoder's scale; unused for lossless videos and GIF */
    uint32_t rate_numerator, rate_denominator;
};
/* Chooses container and encoder. False: the request cannot be fulfilled. */
bool video_plan(struct video_plan *plan, const struct message_video_begin *wanted, struct video_failure *failure);
/* True if the encoder's format allows this size. */
bool video_plan_allows(const struct video_plan *plan, uint32_t width, uint32_t height,
                       struct video_failure *failure);

struct video_encoder;

struct video_source {
    uint32_t width, height;
    const char *model; /* metadata; may be empty */
    int fd;            /* empty file, open for reading and writing; stays the caller's */
};

/* Starts a video; the file is valid once video_encoder_finish has returned true. NULL: see `failure`. */
struct video_encoder *video_encoder_create(const struct video_plan *plan, const struct video_source *source,
                                           struct video_failure *failure);
/* `pixels`: rgba8 of the source's size. */
bool video_encoder_write(struct video_encoder *encoder, const uint8_t *pixels, struct video_failure *failure);
bool video_encoder_finish(struct video_encoder *encoder, struct video_failure *failure);
/* Size of the video, which is even where the encoder needs that. */
void video_encoder_size(const struct video_encoder *encoder, uint32_t *width, uint32_t *height);
void video_encoder_destroy(struct video_encoder *encoder);

/* Redirects the libraries' log into error texts. */
void video_keep_log(void);

#endif
