/* SPDX-License-Identifier: MIT */
/* Decoding of H.264 with libavcodec. */
#include "decode.h"

#include <libavcodec/avcodec.h>
#include <libswscale/swscale.h>
#include <stdlib.h>
#include <string.h>

/* libswscale writes the pixels of a row in groups, whose size depends on the widest instructions and is at most
 * this; the last group may extend past the end of a row. */
#define GROUP_PIXELS 64

struct decoder {
    AVCodecContext *context;
    AVPacket *packet;
    AVFrame *frame;
    struct SwsContext *colours; /* converter for the last frame's size and format */
    uint8_t *padded;            /* owned: rows of whole groups; NULL: not needed so far */
    size_t padded_bytes;
    bool lost; /* frames are undecodable until the next key frame */
};

struct decoder *decoder_create(struct fl_error *error)
{
    const AVCodec *codec = avcodec_find_decoder(AV_CODEC_ID_H264);
    struct decoder *decoder = calloc(1, sizeof(*decoder));
    if (!codec || !decoder) {
        fl_error_set(error, FL_ERROR_SYSTEM, "", "libavcodec has no decoder for H.264");
        free(decoder);
        return NULL;
    }
    av_log_set_level(AV_LOG_QUIET); /* errors of a frame end with the next key frame */
    decoder->context = avcodec_alloc_context3(codec);
    decoder->packet = av_packet_alloc();
    decoder->frame = av_frame_alloc();
    if (decoder->context && decoder->packet && decoder->frame) {
        /* Threads for slices output a frame as soon as it is complete; threads for frames would delay some. */
        decoder->context->flags |= AV_CODEC_FLAG_LOW_DELAY;
        decoder->context->thread_type = FF_THREAD_SLICE;
        decoder->context->err_recognition = AV_EF_EXPLODE;
        if (avcodec_open2(decoder->context, codec, NULL) == 0)
            return decoder;
    }
    fl_error_set(error, FL_ERROR_SYSTEM, "", "libavcodec's decoder for H.264 cannot be opened");
    decoder_destroy(decoder);
    return NULL;
}

static bool reserve(struct decoder *decoder, size_t bytes, struct fl_error *error)
{
    if (bytes <= decoder->padded_bytes)
        return true;
    free(decoder->padded);
    decoder->padded = malloc(bytes);
    decoder->padded_bytes = decoder->padded ? bytes : 0;
    return decoder->padded || fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
}

static bool to_pixels(struct decoder *decoder, struct pixmap *picture, struct fl_error *error)
{
    const AVFrame *frame = decoder->frame;
    const int *matrix =
        sws_getCoefficients(frame->colorspace == AVCOL_SPC_SMPTE170M ? SWS_CS_SMPTE170M : SWS_CS_ITU709);
    const int is_full = frame->color_range == AVCOL_RANGE_JPEG;
    decoder->colours =
        sws_getCachedContext(decoder->colours, picture->width, picture->height, (enum AVPixelFormat)frame->format,
                             picture->width, picture->height, AV_PIX_FMT_RGBA, SWS_BILINEAR, NULL, NULL, NULL);
    if (!decoder->colours ||
        sws_setColorspaceDetails(decoder->colours, matrix, is_full, matrix, 1, 0, 1 << 16, 1 << 16) < 0)
        return fl_error_set(error, FL_ERROR_SYSTEM, "", "a frame in H.264 has an unknown colour space");
    const int row_bytes = picture->width * 4, group_bytes = GROUP_PIXELS * 4;
    const int stride_bytes = (row_bytes + group_bytes - 1) / group_bytes * group_bytes;
    const bool is_padded = stride_bytes != row_bytes;
    if (is_padded && !reserve(decoder, (size_t)stride_bytes * (size_t)picture->height, error))
        return false;
    uint8_t *const planes[] = {is_padded ? decoder->padded : picture->pixels};
    sws_scale(decoder->colours, (const uint8_t *const *)frame->data, frame->linesize, 0, picture->height, planes,
              &stride_bytes);
    for (size_t y = 0; is_padded && y < (size_t)picture->height; y++)
        memcpy(picture->pixels + y * (size_t)row_bytes, decoder->padded + y * (size_t)stride_bytes,
               (size_t)row_bytes);
    return true;
}

/* The chroma of an H.264 stream is subsampled by 2, so an odd edge may be longer by one. */
static bool is_of_size(const AVFrame *decoded, const struct fl_frame *frame)
{
    return (uint32_t)decoded->width - frame->width <= 1 && (uint32_t)decoded->height - frame->height <= 1;
}

bool decoder_decode(struct decoder *decoder, const struct fl_frame *frame, struct pixmap *picture,
                    struct fl_error *error)
{
    if (decoder->lost && !frame->key_frame)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "", "the frame before it is missing");
    if (decoder->lost)
        avcodec_flush_buffers(decoder->context);
    decoder->lost = true;
    if (av_new_packet(decoder->packet, (int)frame->encoded_bytes) < 0)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    memcpy(decoder->packet->data, frame->encoded, frame->encoded_bytes);
    const bool good = avcodec_send_packet(decoder->context, decoder->packet) == 0 &&
                      avcodec_receive_frame(decoder->context, decoder->frame) == 0;
    av_packet_unref(decoder->packet);
    if (!good || !is_of_size(decoder->frame, frame))
        return fl_error_set(error, FL_ERROR_PROTOCOL, "", "a frame in H.264 cannot be decoded");
    decoder->lost = !pixmap_resize(picture, (int)frame->width, (int)frame->height, error) ||
                    !to_pixels(decoder, picture, error);
    return !decoder->lost;
}

void decoder_destroy(struct decoder *decoder)
{
    if (!decoder)
        return;
    free(decoder->padded);
    sws_freeContext(decoder->colours);
    av_frame_free(&decoder->frame);
    av_packet_free(&decoder->packet);
    avcodec_free_context(&decoder->context);
    free(decoder);
}
