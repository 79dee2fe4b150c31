/* SPDX-License-Identifier: MIT */
/* Encoding of videos with libavcodec and libavformat. */
#include "encode.h"
#include "helper/file.h"
#include "protocol/pixels/ycbcr.h"
#include "log.h"
#include "palette.h"
#include "sink.h"
#include "protocol/version.h"

#include <errno.h>
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/cpu.h>
#include <libavutil/opt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define THREADS_MAX 16
/* Slices gain nothing in smaller pictures, and libavcodec 59 stores slices of one or two rows or columns
 * incorrectly in version 3 of FFV1. */
#define FFV1_SLICED_EDGE_MIN 64
#define WAITING_BYTES_MAX (INT64_C(4) << 30)
#define KEY_FRAME_SECONDS 2 /* limits the distance that a player must go back to seek */

struct video_encoder {
    const struct video_plan *plan;
    struct ycbcr_converter converter;
    struct video_sink sink;
    AVFormatContext *format;
    AVStream *stream;
    AVCodecContext *codec;
    AVFrame *picture;
    AVPacket *packet;
    int64_t next_picture;
    struct palette *palette; /* GIF only: stores the pictures until the last one */
};

/* ---- beginning ---- */

/* Tags the video: its values are display values, with sRGB's curve over BT.709's primaries. */
static void describe_pictures(AVCodecContext *codec, const struct video_plan *plan,
                              const struct video_source *source)
{
    static const enum AVPixelFormat formats[] = {[VIDEO_YCBCR] = AV_PIX_FMT_YUV420P,
                                                 [VIDEO_RGB] = AV_PIX_FMT_BGR0,
                                                 [VIDEO_RGBA] = AV_PIX_FMT_BGRA,
                                                 [VIDEO_PALETTE] = AV_PIX_FMT_PAL8};
    const bool rgb = plan->pixels != VIDEO_YCBCR;
    const uint32_t odd = rgb ? 0 : 1; /* 4:2:0 needs even sizes */
    codec->width = (int)((source->width + odd) & ~odd);
    codec->height = (int)((source->height + odd) & ~odd);
    codec->pix_fmt = formats[plan->pixels];
    codec->sample_aspect_ratio = (AVRational){1, 1};
    codec->time_base = (AVRational){(int)plan->rate_denominator, (int)plan->rate_numerator};
    codec->framerate = (AVRational){(int)plan->rate_numerator, (int)plan->rate_denominator};
    codec->color_primaries = AVCOL_PRI_BT709;
    codec->color_trc = AVCOL_TRC_IEC61966_2_1;
    codec->colorspace = rgb ? AVCOL_SPC_RGB : AVCOL_SPC_BT709;
    codec->color_range = rgb ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
    codec->chroma_sample_location = rgb ? AVCHROMA_LOC_UNSPECIFIED : AVCHROMA_LOC_LEFT;
}

static void set_quality(AVCodecContext *codec, const struct video_plan *plan, AVDictionary **options)
{
    if (strcmp(plan->encoder, "libx264") == 0) {
        av_dict_set(options, "preset", "medium", 0);
        av_dict_set_int(options, "crf", (int64_t)plan->quality, 0);
    } else if (strcmp(plan->encoder, "mpeg4") == 0) {
        /* Equal quantiser steps: H.264's doubles every 6 and is 1 at 4; MPEG-4's is twice its scale, 1 to 31. */
        const double scale = exp2(((double)plan->quality - 4) / 6) / 2;
        codec->flags |= AV_CODEC_FLAG_QSCALE;
        codec->global_quality = (int)lround(FF_QP2LAMBDA * (scale < 1 ? 1 : scale > 31 ? 31 : scale));
    } else if (plan->pixels == VIDEO_RGBA) {
        av_dict_set_int(options, "quality", (int64_t)plan->quality, 0);
        av_dict_set_int(options, "lossless", plan->lossless, 0);
    } else if (plan->pixels == VIDEO_PALETTE) {
        return;
    } else if (codec->width < FFV1_SLICED_EDGE_MIN || codec->height < FFV1_SLICED_EDGE_MIN) {
        codec->level = 1;
    } else {
        codec->level = 3;  /* version 3: slices with checksums (RFC 9043) */
        codec->slices = 4; /* fixed, so that the file does not depend on the machine */
        av_dict_set_int(options, "slicecrc", 1, 0);
    }
}

/* x264 gives no reason for a failure; errno, 0 before the call, shows a lack of memory in this thread. */
static bool fail_codec(const struct video_encoder *encoder, int number, struct video_failure *failure)
{
    const bool no_memory = number == AVERROR(ENOMEM) || (number == AVERROR_EXTERNAL && errno == ENOMEM);
    video_fail_library(failure, "codec", encoder->plan->encoder, no_memory ? AVERROR(ENOMEM) : number);
    failure->remedy = no_memory ? "smaller frames need less" : NULL;
    return false;
}

static bool open_codec(struct video_encoder *encoder, const struct video_source *source,
                       struct video_failure *failure)
{
    const struct video_plan *plan = encoder->plan;
    const AVCodec *codec = avcodec_find_encoder_by_name(plan->encoder);
    AVDictionary *options = NULL;
    AVCodecContext *context = encoder->codec = codec ? avcodec_alloc_context3(codec) : NULL;
    if (!context)
        return video_fail_library(failure, "codec", plan->encoder, AVERROR(ENOMEM));
    describe_pictures(context, plan, source);
    const double key_frames = ceil(KEY_FRAME_SECONDS * av_q2d(context->framerate));
    context->gop_size = key_frames < 600 ? (int)key_frames : 600;
    const int processors = av_cpu_count();
    context->thread_count = processors < THREADS_MAX ? processors : THREADS_MAX;
    context->flags |= AV_CODEC_FLAG_BITEXACT;
    if ((encoder->format->oformat->flags & AVFMT_GLOBALHEADER) != 0)
        context->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    set_quality(context, plan, &options);
    errno = 0;
    const int result = avcodec_open2(context, codec, &options);
    if (result < 0)
        fail_codec(encoder, result, failure);
    av_dict_free(&options);
    return result >= 0;
}

static bool open_picture(struct video_encoder *encoder, struct video_failure *failure)
{
    AVFrame *picture = encoder->picture = av_frame_alloc();
    encoder->packet = av_packet_alloc();
    if (!picture || !encoder->packet)
        return video_fail_library(failure, "", "a picture", AVERROR(ENOMEM));
    picture->format = encoder->palette ? AV_PIX_FMT_BGRA : encoder->codec->pix_fmt;
    picture->width = encoder->codec->width;
    picture->height = encoder->codec->height;
    picture->color_primaries = encoder->codec->color_primaries;
    picture->color_trc = encoder->codec->color_trc;
    picture->colorspace = encoder->codec->colorspace;
    picture->color_range = encoder->codec->color_range;
    picture->chroma_location = encoder->codec->chroma_sample_location;
    const int result = av_frame_get_buffer(picture, 0);
    return result >= 0 || video_fail_library(failure, "", "a picture", result);
}

/* Reports the disk's error rather than the library's. */
static bool fail_file(const struct video_encoder *encoder, int number, struct video_failure *failure)
{
    if (encoder->sink.failure == 0)
        return video_fail_library(failure, "path", "cannot be written", number);
    video_fail(failure, "path", NULL, "cannot be written: %s", strerror(encoder->sink.failure));
    failure->lacks_space = file_is_lack_of_space(encoder->sink.failure);
    return false;
}

static bool begin_file(struct video_encoder *encoder, const struct video_source *source,
                       struct video_failure *failure)
{
    char comment[4200];
    AVDictionary *options = NULL;
    encoder->stream = avformat_new_stream(encoder->format, NULL);
    if (!encoder->stream || avcodec_parameters_from_context(encoder->stream->codecpar, encoder->codec) < 0)
        return video_fail_library(failure, "", "a video", AVERROR(ENOMEM));
    encoder->stream->time_base = encoder->codec->time_base;
    encoder->stream->avg_frame_rate = encoder->codec->framerate;
    encoder->stream->sample_aspect_ratio = encoder->codec->sample_aspect_ratio;
    snprintf(comment, sizeof(comment), "farlight " FARLIGHT_VERSION "%s%s", source->model[0] != '\0' ? ": " : "",
             source->model);
    av_dict_set(&encoder->format->metadata, "comment", comment, 0);
    /* Omits the time of day and random numbers, so that the same frames make the same file. */
    encoder->format->flags |= AVFMT_FLAG_BITEXACT;
    /* The index comes first, so that a download can be played. */
    if (strcmp(encoder->plan->container, "mp4") == 0)
        av_dict_set(&options, "movflags", "faststart+write_colr", 0);
    if (encoder->plan->pixels == VIDEO_RGBA || encoder->plan->pixels == VIDEO_PALETTE)
        av_dict_set(&options, "loop", "0", 0); /* endlessly */
    const int result = avformat_write_header(encoder->format, &options);
    av_dict_free(&options);
    return (result >= 0 && encoder->sink.failure == 0) || fail_file(encoder, result, failure);
}

static bool open_palette(struct video_encoder *encoder, const struct video_source *source,
                         struct video_failure *failure)
{
    if (encoder->plan->pixels != VIDEO_PALETTE)
        return true;
    const int result = encoder->plan->palette->create(&encoder->palette, (int)source->width, (int)source->height);
    return result >= 0 || video_fail_library(failure, "", "the palette", result);
}

struct video_encoder *video_encoder_create(const struct video_plan *plan, const struct video_source *source,
                                           struct video_failure *failure)
{
    struct video_encoder *encoder = calloc(1, sizeof(*encoder));
    bool good = encoder &&
                ycbcr_converter_init(&encoder->converter, source->width, source->height, YCBCR_ALPHA_OVER_BLACK);
    if (good) {
        encoder->plan = plan;
        encoder->sink.fd = source->fd;
        good = avformat_alloc_output_context2(&encoder->format, NULL, plan->container, NULL) >= 0 &&
               video_sink_attach(&encoder->sink, encoder->format);
    }
    if (!good)
        video_fail_library(failure, "", "a video", AVERROR(ENOMEM));
    if (good && open_codec(encoder, source, failure) && open_palette(encoder, source, failure) &&
        open_picture(encoder, failure) && begin_file(encoder, source, failure))
        return encoder;
    video_encoder_destroy(encoder);
    return NULL;
}

/* ---- pictures ---- */

static void fill_rgba(struct video_encoder *encoder, const uint8_t *pixels)
{
    const AVFrame *picture = encoder->picture;
    for (int y = 0; y < picture->height; y++) {
        uint8_t *to = picture->data[0] + (ptrdiff_t)y * picture->linesize[0];
        for (int x = 0; x < picture->width; x++, to += 4, pixels += 4) {
            to[0] = pixels[2];
            to[1] = pixels[1];
            to[2] = pixels[0];
            to[3] = pixels[3];
        }
    }
}

static void fill_rgb(struct video_encoder *encoder, const uint8_t *pixels)
{
    const AVFrame *picture = encoder->picture;
    for (int y = 0; y < picture->height; y++) {
        const uint8_t *rgb = ycbcr_opaque_row(&encoder->converter, pixels, (uint32_t)y);
        uint8_t *to = picture->data[0] + (ptrdiff_t)y * picture->linesize[0];
        for (int x = 0; x < picture->width; x++, to += 4, rgb += 3) {
            to[0] = rgb[2];
            to[1] = rgb[1];
            to[2] = rgb[0];
            to[3] = 0xff;
        }
    }
}

static void fill_ycbcr(struct video_encoder *encoder, const uint8_t *pixels)
{
    const AVFrame *picture = encoder->picture;
    const struct ycbcr_target planes = {.y = picture->data[0],
                                        .cb = picture->data[1],
                                        .cr = picture->data[2],
                                        .y_stride_bytes = (size_t)picture->linesize[0],
                                        .c_stride_bytes = (size_t)picture->linesize[1],
                                        .width = (uint32_t)picture->width,
                                        .height = (uint32_t)picture->height,
                                        .half_chroma = true};
    ycbcr_convert(&encoder->converter, pixels, &planes);
}

/* Writes the encoder's finished packets; all of them if `picture` is NULL. */
static bool encode(struct video_encoder *encoder, const AVFrame *picture, struct video_failure *failure)
{
    errno = 0;
    int result = avcodec_send_frame(encoder->codec, picture);
    while (result >= 0) {
        result = avcodec_receive_packet(encoder->codec, encoder->packet);
        if (result == AVERROR(EAGAIN) || result == AVERROR_EOF)
            return true;
        if (result < 0)
            break;
        encoder->packet->stream_index = encoder->stream->index;
        encoder->packet->duration = 1;
        av_packet_rescale_ts(encoder->packet, encoder->codec->time_base, encoder->stream->time_base);
        const int written = av_interleaved_write_frame(encoder->format, encoder->packet);
        if (written < 0 || encoder->sink.failure != 0)
            return fail_file(encoder, written, failure);
    }
    return fail_codec(encoder, result, failure);
}

/* Stores a picture of a GIF until the last one: a common palette keeps still regions from flickering. */
static bool wait_for_palette(struct video_encoder *encoder, struct video_failure *failure)
{
    const AVFrame *picture = encoder->picture;
    const int64_t bytes = encoder->next_picture * picture->height * picture->linesize[0];
    if (bytes > WAITING_BYTES_MAX)
        return video_fail(
            failure, "frames", "make it shorter or smaller, or write a .webp file",
            "the pictures of a GIF file have their colours in common, and these need more than 4 GiB");
    const int result = encoder->plan->palette->put(encoder->palette, encoder->picture);
    return result >= 0 || video_fail_library(failure, "", "the palette", result);
}

bool video_encoder_write(struct video_encoder *encoder, const uint8_t *pixels, struct video_failure *failure)
{
    /* The encoder may still hold the previous picture. */
    const int result = av_frame_make_writable(encoder->picture);
    if (result < 0)
        return video_fail_library(failure, "", "a picture", result);
    if (encoder->plan->pixels == VIDEO_YCBCR)
        fill_ycbcr(encoder, pixels);
    else if (encoder->plan->pixels == VIDEO_RGBA)
        fill_rgba(encoder, pixels);
    else
        fill_rgb(encoder, pixels);
    encoder->picture->pts = encoder->next_picture++;
    return encoder->palette ? wait_for_palette(encoder, failure) : encode(encoder, encoder->picture, failure);
}

static bool encode_waiting(struct video_encoder *encoder, struct video_failure *failure)
{
    int result = encoder->plan->palette->put(encoder->palette, NULL);
    bool good = result >= 0;
    while (good) {
        av_frame_unref(encoder->picture);
        result = encoder->plan->palette->take(encoder->palette, encoder->picture);
        if (result == AVERROR_EOF)
            return true;
        good = result >= 0;
        if (good && !encode(encoder, encoder->picture, failure))
            return false;
    }
    return video_fail_library(failure, "", "the palette", result);
}

bool video_encoder_finish(struct video_encoder *encoder, struct video_failure *failure)
{
    if ((encoder->palette && !encode_waiting(encoder, failure)) || !encode(encoder, NULL, failure))
        return false;
    const int result = av_write_trailer(encoder->format);
    avio_flush(encoder->format->pb);
    return (result >= 0 && encoder->sink.failure == 0) || fail_file(encoder, result, failure);
}

void video_encoder_size(const struct video_encoder *encoder, uint32_t *width, uint32_t *height)
{
    *width = (uint32_t)encoder->codec->width;
    *height = (uint32_t)encoder->codec->height;
}

void video_encoder_destroy(struct video_encoder *encoder)
{
    if (!encoder)
        return;
    if (encoder->palette)
        encoder->plan->palette->destroy(encoder->palette);
    av_packet_free(&encoder->packet);
    av_frame_free(&encoder->picture);
    avcodec_free_context(&encoder->codec);
    if (encoder->format)
        video_sink_detach(encoder->format);
    avformat_free_context(encoder->format);
    ycbcr_converter_finish(&encoder->converter);
    free(encoder);
}
