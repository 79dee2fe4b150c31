/* SPDX-License-Identifier: MIT */
/* YUV4MPEG2, the stream format of the mjpegtools (yuv4mpeg(5)): a line of text, then "FRAME" and three planes
 * each. */
#include "lib/rate.h"
#include "lib/stream.h"
#include "lib/text.h"
#include "protocol/pixels/ycbcr.h"

#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char frame_line[] = "FRAME\n";
#define FRAME_LINE_BYTES (sizeof(frame_line) - 1)
#define EDGE_MAX 8192u

struct fl_y4m {
    struct fl_y4m_options options;
    struct ycbcr_converter converter;
    uint8_t *frame; /* its line and its planes; NULL: before the first */
    size_t frame_bytes;
    bool broken;       /* ends within a frame: nothing may follow */
    bool never_blocks; /* an ordinary file */
};

struct fl_y4m *fl_y4m_begin(const struct fl_y4m_options *options, struct fl_error *error)
{
    struct stat status;
    if (fstat(options->fd, &status) < 0) {
        fl_error_set(error, FL_ERROR_FILE, "", "the video stream cannot be written: %s", strerror(errno));
        return NULL;
    }
    struct fl_y4m *y4m = calloc(1, sizeof(*y4m));
    if (!y4m) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    y4m->options = *options;
    y4m->never_blocks = S_ISREG(status.st_mode);
    return y4m;
}

/* ---- bytes ---- */

/* Writes without SIGPIPE: the signal is sent to the thread (POSIX), so it can be blocked and consumed. */
static ssize_t write_quietly(int fd, const uint8_t *bytes, size_t count)
{
    sigset_t pipe_signal, before, waiting;
    sigemptyset(&pipe_signal);
    sigaddset(&pipe_signal, SIGPIPE);
    sigpending(&waiting);
    if (pthread_sigmask(SIG_BLOCK, &pipe_signal, &before) != 0)
        return write(fd, bytes, count);
    const ssize_t written = write(fd, bytes, count);
    const int failure = errno;
    if (written < 0 && failure == EPIPE && sigismember(&waiting, SIGPIPE) == 0)
        sigtimedwait(&pipe_signal, NULL, &(struct timespec){0});
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    errno = failure;
    return written;
}

/* A pipe that poll() calls writable takes PIPE_BUF bytes at once: an interruption is seen before the next. */
static bool write_all(struct fl_y4m *y4m, const uint8_t *bytes, size_t count, struct fl_error *error)
{
    while (count > 0) {
        struct pollfd polled = {.fd = y4m->options.fd, .events = POLLOUT};
        if (!y4m->never_blocks && !fl_wait(&polled, 1, y4m->options.interrupt_fd, UINT64_MAX, error))
            return false;
        const size_t piece = y4m->never_blocks || count < PIPE_BUF ? count : PIPE_BUF;
        const ssize_t written = write_quietly(y4m->options.fd, bytes, piece);
        if (written < 0 && errno != EINTR && errno != EAGAIN)
            return fl_text_write_error(error, "", "the video stream cannot be written", errno);
        if (written > 0) {
            bytes += written;
            count -= (size_t)written;
        }
    }
    return true;
}

/* ---- frames ---- */

static struct ycbcr_target planes_of(const struct fl_y4m *y4m)
{
    const uint32_t width = y4m->converter.width, height = y4m->converter.height;
    const bool half = y4m->options.chroma == FL_Y4M_420;
    struct ycbcr_target planes = {.width = width, .height = height, .half_chroma = half, .y_stride_bytes = width};
    planes.c_stride_bytes = half ? (width + 1) / 2 : width;
    planes.y = y4m->frame + FRAME_LINE_BYTES;
    planes.cb = planes.y + (size_t)width * height;
    planes.cr = planes.cb + planes.c_stride_bytes * (half ? (height + 1) / 2 : height);
    return planes;
}

static bool write_header(struct fl_y4m *y4m, const struct fl_frame *frame, struct fl_error *error)
{
    char line[160];
    const bool half = y4m->options.chroma == FL_Y4M_420;
    const size_t luma_bytes = (size_t)frame->width * frame->height;
    const size_t half_bytes = (size_t)((frame->width + 1) / 2) * ((frame->height + 1) / 2);
    uint32_t numerator, denominator;
    const float rate = y4m->options.frames_per_second;
    fl_rate_exact(rate > 0 ? rate : 24, &numerator, &denominator);
    y4m->frame_bytes = FRAME_LINE_BYTES + luma_bytes + 2 * (half ? half_bytes : luma_bytes);
    if (!ycbcr_converter_init(&y4m->converter, frame->width, frame->height, YCBCR_ALPHA_OVER_BLACK) ||
        !(y4m->frame = malloc(y4m->frame_bytes)))
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    memcpy(y4m->frame, frame_line, FRAME_LINE_BYTES);
    const int length = snprintf(line, sizeof(line), "YUV4MPEG2 W%u H%u F%u:%u Ip A1:1 C%s XCOLORRANGE=LIMITED\n",
                                frame->width, frame->height, numerator, denominator, half ? "420mpeg2" : "444");
    return write_all(y4m, (const uint8_t *)line, (size_t)length, error);
}

static bool check_frame(const struct fl_y4m *y4m, const struct fl_frame *frame, struct fl_error *error)
{
    if (y4m->broken)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "this video stream has ended within a frame");
    if (frame->format != PROTOCOL_PIXEL_FORMAT_RGBA8) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "format", "a video cannot store %s pixels",
                     protocol_pixel_format_text(frame->format));
        return fl_error_remedy(error, "render with the pixel format rgba8");
    }
    if (frame->width - 1 >= EDGE_MAX || frame->height - 1 >= EDGE_MAX ||
        frame->pixels_bytes != (size_t)frame->width * frame->height * 4)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "size", "%ux%u pixels are not %zu bytes", frame->width,
                            frame->height, frame->pixels_bytes);
    if (!y4m->frame || (frame->width == y4m->converter.width && frame->height == y4m->converter.height))
        return true;
    fl_error_set(error, FL_ERROR_ARGUMENT, "size", "frame %u has %ux%u pixels, but the video has %ux%u",
                 frame->frame, frame->width, frame->height, y4m->converter.width, y4m->converter.height);
    return fl_error_remedy(error, "all frames of a video must have the size of the first");
}

bool fl_y4m_write(struct fl_y4m *y4m, const struct fl_frame *frame, struct fl_error *error)
{
    if (!check_frame(y4m, frame, error))
        return false;
    y4m->broken = true; /* cleared after the whole frame is written */
    if (!y4m->frame && !write_header(y4m, frame, error))
        return false;
    const struct ycbcr_target planes = planes_of(y4m);
    ycbcr_convert(&y4m->converter, frame->pixels, &planes);
    if (!write_all(y4m, y4m->frame, y4m->frame_bytes, error))
        return false;
    y4m->broken = false;
    return true;
}

void fl_y4m_end(struct fl_y4m *y4m)
{
    if (!y4m)
        return;
    ycbcr_converter_finish(&y4m->converter);
    free(y4m->frame);
    free(y4m);
}
