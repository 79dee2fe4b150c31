/* SPDX-License-Identifier: MIT */
/* An open file as the library's input and output; the library opens no files itself. */
#ifndef FARLIGHT_CLIENT_VIDEO_SINK_H
#define FARLIGHT_CLIENT_VIDEO_SINK_H

#include <stdbool.h>
#include <stdint.h>

struct AVFormatContext;

struct video_sink {
    int fd;
    int failure;        /* errno of the first write that failed; 0: none */
    int64_t size_bytes; /* size of the written file */
};

/* Makes *format write to the sink, which must outlive it. False: no memory. */
bool video_sink_attach(struct video_sink *sink, struct AVFormatContext *format);
/* Detaches it again, before the format is freed. */
void video_sink_detach(struct AVFormatContext *format);

#endif
