/* SPDX-License-Identifier: MIT */
/* An open file as output of libavformat. */
#include "sink.h"

#include <errno.h>
#include <libavformat/avformat.h>
#include <stdlib.h>
#include <unistd.h>

#define BUFFER_BYTES 65536

/* A position in the file: the writer's, or the reader's that moves the index to the front. */
struct place {
    struct video_sink *sink;
    int64_t at;
};

static int on_write(void *opaque, uint8_t *bytes, int count)
{
    struct place *place = opaque;
    for (int written = 0; written < count;) {
        const ssize_t more = pwrite(place->sink->fd, bytes + written, (size_t)(count - written), place->at);
        if (more < 0 && errno == EINTR)
            continue;
        if (more <= 0) {
            const int failure = more < 0 ? errno : EIO;
            if (place->sink->failure == 0)
                place->sink->failure = failure;
            return AVERROR(failure);
        }
        written += (int)more;
        place->at += more;
        if (place->at > place->sink->size_bytes)
            place->sink->size_bytes = place->at;
    }
    return count;
}

static int on_read(void *opaque, uint8_t *bytes, int count)
{
    struct place *place = opaque;
    for (;;) {
        const ssize_t got = pread(place->sink->fd, bytes, (size_t)count, place->at);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return AVERROR(errno);
        place->at += got;
        return got > 0 ? (int)got : AVERROR_EOF;
    }
}

static int64_t on_seek(void *opaque, int64_t offset, int whence)
{
    struct place *place = opaque;
    const int64_t size = place->sink->size_bytes;
    whence &= ~AVSEEK_FORCE;
    if (whence == AVSEEK_SIZE)
        return size;
    const int64_t base = whence == SEEK_CUR ? place->at : whence == SEEK_END ? size : 0;
    if ((whence != SEEK_SET && whence != SEEK_CUR && whence != SEEK_END) || offset < -base)
        return AVERROR(EINVAL);
    return place->at = base + offset;
}

static AVIOContext *open_at_start(struct video_sink *sink, bool writing)
{
    struct place *place = calloc(1, sizeof(*place));
    unsigned char *buffer = av_malloc(BUFFER_BYTES);
    AVIOContext *io = NULL;
    if (place && buffer) {
        place->sink = sink;
        io = avio_alloc_context(buffer, BUFFER_BYTES, writing, place, writing ? NULL : on_read,
                                writing ? on_write : NULL, on_seek);
    }
    if (!io) {
        av_free(buffer);
        free(place);
    }
    return io;
}

static int close_place(AVFormatContext *format, AVIOContext *io)
{
    (void)format;
    if (!io)
        return 0;
    free(io->opaque);
    av_freep(&io->buffer);
    avio_context_free(&io);
    return 0;
}

/* The muxer reads its own output to insert the index before it. */
static int open_again(AVFormatContext *format, AVIOContext **io, const char *url, int flags,
                      AVDictionary **options)
{
    (void)url;
    (void)options;
    if ((flags & AVIO_FLAG_WRITE) != 0)
        return AVERROR(EPERM);
    *io = open_at_start(format->opaque, false);
    return *io ? 0 : AVERROR(ENOMEM);
}

bool video_sink_attach(struct video_sink *sink, AVFormatContext *format)
{
    format->opaque = sink;
    format->io_open = open_again;
    format->io_close2 = close_place;
    format->flags |= AVFMT_FLAG_CUSTOM_IO;
    format->pb = open_at_start(sink, true);
    return format->pb != NULL;
}

void video_sink_detach(AVFormatContext *format)
{
    close_place(format, format->pb);
    format->pb = NULL;
}
