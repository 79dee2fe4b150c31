/* SPDX-License-Identifier: MIT */
/* H.264 through libavcodec: an access unit per picture, in Annex B form, parameter sets before each key frame.
 *
 * Motion must be visible at once: no picture waits for a later one (no B-frames, no lookahead, threads share a
 * picture instead of taking turns), and none takes longer on the link than its share of time: with a buffer of one
 * picture, the rate control of the encoder keeps each within its bytes. Key frames come on request only. */
#include "encode/stream.h"

#include "base/parallel.h"
#include "encode/libav.h"
#include "protocol/pixels/ycbcr.h"

#include <errno.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define EDGE_MAX 8192u
#define RATE_DENOMINATOR 1000 /* denominator of pictures per second */
/* Minimum part of a picture that is worth a thread. */
#define PIXELS_PER_THREAD (512u * 512u)
#define THREADS_MAX 4u
#define KEY_FRAMES_NEVER (1 << 30) /* x264's value for that */
/* Bytes per pixel of an uncompressed picture, which stand for no limit: x264 accepts a limit later only if it
 * began with one. */
#define BYTES_PER_PIXEL_UNLIMITED 3u
#define BYTES_MIN 1000u /* per picture: x264 counts in kilobits */
#define BITS_MAX ((int64_t)1 << 30)

/* Codecs that the library may have, the best first: hardware, if there is any. */
enum codec { CODEC_NVENC, CODEC_X264, CODEC_COUNT };
static const char *const codec_names[CODEC_COUNT] = {"h264_nvenc", "libx264"};
/* Codecs whose device refuses them, which are not tried again, as there is no such device. A lack of memory
 * does not count. */
static atomic_bool codec_fails[CODEC_COUNT];
enum outcome { OUTCOME_DONE, OUTCOME_NO_MEMORY, OUTCOME_REFUSED };

struct encoder_stream {
    const struct libav *av;
    int rate_numerator;
    /* Open codec for the present size; NULL: none is open. */
    enum codec which;
    AVCodecContext *codec;
    AVFrame *frame;
    AVPacket *packet;
    struct ycbcr_converter converter;
    uint32_t width, height;
    int64_t next_picture;
};

/* ---- settings ----------------------------------------------------------------------------------- */

/* Constant rate factor that looks like a JPEG of that quality: 23, x264's default, at 75, and a step of 6,
 * which halves the rate, for 18. */
static double rate_factor(unsigned quality)
{
    unsigned clamped = quality < 1 ? 1 : quality > 100 ? 100 : quality;
    return 48 - clamped / 3.0;
}

/* Sets the rate, which the encoder reads before each picture. */
static void set_rate(struct encoder_stream *stream, const struct encoder_request *request)
{
    AVCodecContext *codec = stream->codec;
    uint64_t maximum = (uint64_t)stream->width * stream->height * BYTES_PER_PIXEL_UNLIMITED;
    uint64_t bytes = request->bytes && request->bytes < maximum ? request->bytes : maximum;
    double bits = 8.0 * (double)(bytes < BYTES_MIN ? BYTES_MIN : bytes);
    double bits_per_second = bits * stream->rate_numerator / RATE_DENOMINATOR;
    codec->rc_buffer_size = (int)fmin(bits, (double)BITS_MAX);
    codec->rc_max_rate = (int64_t)fmin(bits_per_second, (double)BITS_MAX);
    if (stream->which == CODEC_NVENC)
        codec->bit_rate = codec->rc_max_rate;
    else
        stream->av->av_opt_set_double(codec->priv_data, "crf", rate_factor(request->quality), 0);
}

static void describe_pictures(struct encoder_stream *stream)
{
    AVCodecContext *codec = stream->codec;
    codec->width = (int)((stream->width + 1) & ~1u);
    codec->height = (int)((stream->height + 1) & ~1u);
    codec->pix_fmt = AV_PIX_FMT_YUV420P;
    codec->sample_aspect_ratio = (AVRational){1, 1};
    codec->time_base = (AVRational){RATE_DENOMINATOR, stream->rate_numerator};
    codec->framerate = (AVRational){stream->rate_numerator, RATE_DENOMINATOR};
    codec->color_primaries = AVCOL_PRI_BT709;
    codec->color_trc = AVCOL_TRC_IEC61966_2_1;
    codec->colorspace = AVCOL_SPC_BT709;
    codec->color_range = AVCOL_RANGE_MPEG;
    codec->chroma_sample_location = AVCHROMA_LOC_LEFT;
}

static void set_latency(struct encoder_stream *stream, AVDictionary **options)
{
    const struct libav *av = stream->av;
    AVCodecContext *codec = stream->codec;
    unsigned wanted = stream->width * stream->height / PIXELS_PER_THREAD, processors = parallel_processors();
    unsigned maximum = processors < THREADS_MAX ? processors : THREADS_MAX;
    codec->thread_count = (int)(wanted < 1 ? 1 : wanted < maximum ? wanted : maximum);
    codec->thread_type = FF_THREAD_SLICE;
    codec->gop_size = KEY_FRAMES_NEVER;
    codec->max_b_frames = 0;
    av->av_dict_set(options, "forced-idr", "1", 0);
    if (stream->which == CODEC_NVENC) {
        av->av_dict_set(options, "preset", "p1", 0);
        av->av_dict_set(options, "tune", "ull", 0);
        av->av_dict_set(options, "rc", "vbr", 0);
        av->av_dict_set(options, "delay", "0", 0);
        av->av_dict_set(options, "zerolatency", "1", 0);
    } else {
        av->av_dict_set(options, "preset", "superfast", 0);
        av->av_dict_set(options, "tune", "zerolatency", 0);
        av->av_dict_set(options, "sc_threshold", "0", 0); /* no key frames on its own */
    }
}

/* ---- one size, one encoder ----------------------------------------------------------------------- */

static void stream_close(struct encoder_stream *stream)
{
    stream->av->av_packet_free(&stream->packet);
    stream->av->av_frame_free(&stream->frame);
    stream->av->avcodec_free_context(&stream->codec);
    ycbcr_converter_finish(&stream->converter);
}

static enum outcome outcome_of(int status)
{
    return status >= 0 ? OUTCOME_DONE : status == AVERROR(ENOMEM) ? OUTCOME_NO_MEMORY : OUTCOME_REFUSED;
}

static enum outcome open_codec(struct encoder_stream *stream, const AVCodec *codec,
                               const struct encoder_request *request)
{
    AVDictionary *options = NULL;
    stream->codec = stream->av->avcodec_alloc_context3(codec);
    if (!stream->codec)
        return OUTCOME_NO_MEMORY;
    describe_pictures(stream);
    set_latency(stream, &options);
    set_rate(stream, request);
    int status = stream->av->avcodec_open2(stream->codec, codec, &options);
    stream->av->av_dict_free(&options);
    return outcome_of(status);
}

static enum outcome open_frame(struct encoder_stream *stream)
{
    AVFrame *frame = stream->frame = stream->av->av_frame_alloc();
    stream->packet = stream->av->av_packet_alloc();
    if (!frame || !stream->packet ||
        !ycbcr_converter_init(&stream->converter, stream->width, stream->height, YCBCR_ALPHA_IGNORED))
        return OUTCOME_NO_MEMORY;
    frame->format = stream->codec->pix_fmt;
    frame->width = stream->codec->width;
    frame->height = stream->codec->height;
    return outcome_of(stream->av->av_frame_get_buffer(frame, 0));
}

static bool stream_open(struct encoder_stream *stream, const struct picture *picture,
                        const struct encoder_request *request)
{
    stream->width = picture->width;
    stream->height = picture->height;
    stream->next_picture = 0;
    for (enum codec which = 0; which < CODEC_COUNT; which++) {
        const AVCodec *codec = stream->av->avcodec_find_encoder_by_name(codec_names[which]);
        if (!codec || atomic_load(&codec_fails[which]))
            continue;
        stream->which = which;
        enum outcome outcome = open_codec(stream, codec, request);
        if (outcome == OUTCOME_DONE)
            outcome = open_frame(stream);
        if (outcome == OUTCOME_DONE)
            return true;
        stream_close(stream);
        /* The last codec has no successor. */
        if (outcome == OUTCOME_REFUSED && which + 1 < CODEC_COUNT)
            atomic_store(&codec_fails[which], true);
    }
    return false;
}

/* ---- pictures ------------------------------------------------------------------------------------ */

static void copy_plane(uint8_t *to, int to_stride, const uint8_t *from, size_t from_stride, int width, int rows)
{
    for (int row = 0; row < rows; row++)
        memcpy(to + (ptrdiff_t)row * to_stride, from + (size_t)row * from_stride, (size_t)width);
}

/* Copies planes that the device has converted. */
static void copy_planes(AVFrame *frame, const struct ycbcr_planes *from)
{
    int width = frame->width / 2, rows = frame->height / 2;
    copy_plane(frame->data[0], frame->linesize[0], from->y, from->y_stride_bytes, frame->width, frame->height);
    copy_plane(frame->data[1], frame->linesize[1], from->cb, from->c_stride_bytes, width, rows);
    copy_plane(frame->data[2], frame->linesize[2], from->cr, from->c_stride_bytes, width, rows);
}

static bool fill_frame(struct encoder_stream *stream, const struct picture *picture)
{
    AVFrame *frame = stream->frame;
    if (stream->av->av_frame_make_writable(frame) < 0) /* the encoder may still use the previous picture */
        return false;
    if (picture->ycbcr != YCBCR_NONE) {
        copy_planes(frame, &picture->planes);
        return true;
    }
    const struct ycbcr_target planes = {
        .y = frame->data[0],
        .cb = frame->data[1],
        .cr = frame->data[2],
        .y_stride_bytes = (size_t)frame->linesize[0],
        .c_stride_bytes = (size_t)frame->linesize[1],
        .width = (uint32_t)frame->width,
        .height = (uint32_t)frame->height,
        .half_chroma = true,
    };
    ycbcr_convert(&stream->converter, picture->pixels, &planes);
    return true;
}

/* Encodes one picture into one packet. */
static enum outcome encode_picture(struct encoder_stream *stream, const struct picture *picture,
                                   const struct encoder_request *request, struct encoded_picture *out)
{
    if (!fill_frame(stream, picture))
        return OUTCOME_NO_MEMORY;
    set_rate(stream, request);
    stream->frame->pts = stream->next_picture++;
    stream->frame->pict_type = request->key_frame ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;
    int status = stream->av->avcodec_send_frame(stream->codec, stream->frame);
    if (status >= 0)
        status = stream->av->avcodec_receive_packet(stream->codec, stream->packet);
    if (status < 0)
        return outcome_of(status);
    const AVPacket *packet = stream->packet;
    out->size_bytes = (size_t)packet->size;
    out->key_frame = packet->flags & AV_PKT_FLAG_KEY;
    out->bytes = malloc(out->size_bytes);
    if (out->bytes)
        memcpy(out->bytes, packet->data, out->size_bytes);
    stream->av->av_packet_unref(stream->packet);
    return out->bytes ? OUTCOME_DONE : OUTCOME_NO_MEMORY;
}

bool encoder_stream_encode(struct encoder_stream *stream, const struct picture *picture,
                           const struct encoder_request *request, struct encoded_picture *out, struct error *error)
{
    *out = (struct encoded_picture){0};
    bool is_open = stream->codec && stream->width == picture->width && stream->height == picture->height;
    if (picture->bytes_per_pixel != 4 || !picture->width || !picture->height || picture->width > EDGE_MAX ||
        picture->height > EDGE_MAX)
        return error_set(error, ERROR_UNSUPPORTED, "encoding", "h264 cannot carry %ux%u pixels of %u bytes",
                         picture->width, picture->height, picture->bytes_per_pixel);
    if (picture->ycbcr != YCBCR_NONE && picture->ycbcr != YCBCR_VIDEO)
        return error_set(error, ERROR_UNSUPPORTED, "encoding", "h264 does not take such planes");
    for (;;) {
        if (!is_open) {
            stream_close(stream);
            if (!stream_open(stream, picture, request))
                return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "no encoder of H.264 opens for %ux%u",
                                 picture->width, picture->height);
        }
        enum outcome outcome = encode_picture(stream, picture, request, out);
        if (outcome == OUTCOME_DONE)
            return true;
        enum codec which = stream->which;
        stream_close(stream); /* the next picture begins anew */
        if (outcome == OUTCOME_NO_MEMORY)
            return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "no memory for a picture in H.264");
        if (which + 1 == CODEC_COUNT)
            return error_set(error, ERROR_INTERNAL, "encoding", "%s gave no picture", codec_names[which]);
        atomic_store(&codec_fails[which], true);
        is_open = false;
    }
}

bool encoder_stream_supports(enum encoding encoding, uint32_t bytes_per_pixel)
{
    if (encoding != ENCODING_H264 || bytes_per_pixel != 4)
        return false;
    const struct libav *av = libav_load();
    for (enum codec which = 0; av && which < CODEC_COUNT; which++) {
        if (av->avcodec_find_encoder_by_name(codec_names[which]) && !atomic_load(&codec_fails[which]))
            return true;
    }
    return false;
}

struct encoder_stream *encoder_stream_create(enum encoding encoding, float frames_per_second, struct error *error)
{
    if (!encoder_stream_supports(encoding, 4)) {
        error_set(error, ERROR_UNSUPPORTED, "encoding", "libavcodec has no encoder of H.264");
        return NULL;
    }
    struct encoder_stream *stream = calloc(1, sizeof(*stream));
    if (!stream) {
        error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "no memory for a stream");
        return NULL;
    }
    stream->av = libav_load();
    double numerator = round((double)frames_per_second * RATE_DENOMINATOR);
    stream->rate_numerator = (int)fmin(fmax(numerator, 1), INT32_MAX);
    return stream;
}

void encoder_stream_destroy(struct encoder_stream *stream)
{
    if (!stream)
        return;
    stream_close(stream);
    free(stream);
}
