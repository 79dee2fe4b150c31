/* SPDX-License-Identifier: MIT */
/* H.264 as the viewer decodes it: made by an encoder of the same library. */
#include "viewer/view/decode.h"
#include "tests/harness/test.h"

#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WIDTH 96
#define HEIGHT 64
#define FRAMES 6

static struct fl_error error;
static AVPacket *packets[FRAMES];

/* A frame of one grey that changes from frame to frame: Y' of limited range. */
static uint8_t luma_of(int frame)
{
    return (uint8_t)(60 + frame * 20);
}

static AVCodecContext *open_encoder(void)
{
    const AVCodec *codec = avcodec_find_encoder_by_name("libx264");
    if (!codec)
        return NULL;
    AVCodecContext *context = avcodec_alloc_context3(codec);
    context->width = WIDTH;
    context->height = HEIGHT;
    context->time_base = (AVRational){1, 30};
    context->pix_fmt = AV_PIX_FMT_YUV420P;
    context->colorspace = AVCOL_SPC_BT709;
    context->color_range = AVCOL_RANGE_MPEG;
    context->gop_size = 3;
    context->max_b_frames = 0;
    context->thread_count = 1;
    av_opt_set(context->priv_data, "preset", "ultrafast", 0);
    av_opt_set(context->priv_data, "tune", "zerolatency", 0);
    assert_int_equal(avcodec_open2(context, codec, NULL), 0);
    return context;
}

static int make_stream(void **state)
{
    (void)state;
    AVCodecContext *context = open_encoder();
    if (!context)
        return 0;
    AVFrame *frame = av_frame_alloc();
    frame->format = AV_PIX_FMT_YUV420P;
    frame->width = WIDTH;
    frame->height = HEIGHT;
    for (int i = 0; i < FRAMES; i++) {
        assert_int_equal(av_frame_get_buffer(frame, 0), 0);
        memset(frame->data[0], luma_of(i), (size_t)frame->linesize[0] * HEIGHT);
        memset(frame->data[1], 128, (size_t)frame->linesize[1] * HEIGHT / 2);
        memset(frame->data[2], 128, (size_t)frame->linesize[2] * HEIGHT / 2);
        frame->pts = i;
        packets[i] = av_packet_alloc();
        assert_int_equal(avcodec_send_frame(context, frame), 0);
        assert_int_equal(avcodec_receive_packet(context, packets[i]), 0);
        av_frame_unref(frame);
        frame->format = AV_PIX_FMT_YUV420P;
        frame->width = WIDTH;
        frame->height = HEIGHT;
    }
    av_frame_free(&frame);
    avcodec_free_context(&context);
    return 0;
}

static int drop_stream(void **state)
{
    (void)state;
    for (int i = 0; i < FRAMES; i++)
        av_packet_free(&packets[i]);
    return 0;
}

static struct fl_frame frame_of(int i)
{
    return (struct fl_frame){.width = WIDTH,
                             .height = HEIGHT,
                             .encoding = PROTOCOL_ENCODING_H264,
                             .key_frame = (packets[i]->flags & AV_PKT_FLAG_KEY) != 0,
                             .encoded = packets[i]->data,
                             .encoded_bytes = (size_t)packets[i]->size};
}

static bool decode(struct decoder *decoder, const struct fl_frame *frame, struct pixmap *picture)
{
    error = (struct fl_error){0};
    return decoder_decode(decoder, frame, picture, &error);
}

/* Limited range to full: (Y - 16) / 219. Within 2 of 255: the encoder's loss on an even grey, and rounding. */
static void check_grey(const struct pixmap *picture, int i)
{
    const int wanted = (int)lround((luma_of(i) - 16) / 219.0 * 255);
    assert_int_equal(picture->width, WIDTH);
    assert_int_equal(picture->height, HEIGHT);
    for (size_t p = 0; p < WIDTH * HEIGHT; p++)
        for (size_t c = 0; c < 4; c++)
            if (abs(picture->pixels[p * 4 + c] - (c < 3 ? wanted : 255)) > 2)
                fail_msg("frame %d, pixel %zu: %d in place of %d", i, p, picture->pixels[p * 4 + c], wanted);
}

EACH_TEST(make_stream, drop_stream)

TEST(every_frame_comes_out_as_soon_as_it_is_in)
{
    if (!packets[0])
        skip();
    struct decoder *decoder = decoder_create(&error);
    struct pixmap picture = {0};
    assert_non_null(decoder);
    for (int i = 0; i < FRAMES; i++) {
        const struct fl_frame frame = frame_of(i);
        const uint64_t before = picture.version;
        if (!decode(decoder, &frame, &picture))
            fail_msg("frame %d: %s", i, error.text);
        assert_true(picture.version != before);
        check_grey(&picture, i);
    }
    pixmap_finish(&picture);
    decoder_destroy(decoder);
}

TEST(after_a_damaged_frame_nothing_is_shown_before_a_key_frame)
{
    if (!packets[0])
        skip();
    struct decoder *decoder = decoder_create(&error);
    struct pixmap picture = {0};
    static const uint8_t rubbish[200] = {0, 0, 1, 0x65, 0xff, 0x13};
    struct fl_frame frame = frame_of(0);
    assert_true(decode(decoder, &frame, &picture));
    frame.encoded = (uint8_t *)(uintptr_t)rubbish; /* only read */
    frame.encoded_bytes = sizeof(rubbish);
    frame.key_frame = false;
    assert_false(decode(decoder, &frame, &picture));
    frame = frame_of(2);
    assert_false(frame.key_frame);
    assert_false(decode(decoder, &frame, &picture));
    frame = frame_of(3);
    assert_true(frame.key_frame);
    assert_true(decode(decoder, &frame, &picture));
    check_grey(&picture, 3);
    pixmap_finish(&picture);
    decoder_destroy(decoder);
}

/* Groups of pixels that exceed a row are the conversion's own affair. */
TEST(nothing_is_written_past_the_pixels_of_a_picture_of_an_odd_width)
{
    enum { BYTES = (WIDTH - 1) * HEIGHT * 4, MARGIN = 1024 };
    if (!packets[0])
        skip();
    struct decoder *decoder = decoder_create(&error);
    struct pixmap picture = {.width = WIDTH - 1, .height = HEIGHT, .pixels = malloc(BYTES + MARGIN)};
    struct fl_frame frame = frame_of(0);
    assert_non_null(picture.pixels);
    memset(picture.pixels, 0xa5, BYTES + MARGIN);
    frame.width = WIDTH - 1; /* H.264 has even ones, of which the last column is not part of the picture */
    assert_true(decode(decoder, &frame, &picture));
    for (size_t i = BYTES; i < BYTES + MARGIN; i++)
        assert_int_equal(picture.pixels[i], 0xa5);
    assert_int_equal(picture.pixels[BYTES - 1], 255);
    pixmap_finish(&picture);
    decoder_destroy(decoder);
}

TEST(a_frame_of_another_size_than_announced_is_refused)
{
    if (!packets[0])
        skip();
    struct decoder *decoder = decoder_create(&error);
    struct pixmap picture = {0};
    struct fl_frame frame = frame_of(0);
    frame.width = 2 * WIDTH;
    assert_false(decode(decoder, &frame, &picture));
    frame.width = WIDTH - 1; /* an odd one: the stream has a column more */
    assert_true(decode(decoder, &frame, &picture));
    assert_int_equal(picture.width, WIDTH - 1);
    pixmap_finish(&picture);
    decoder_destroy(decoder);
}
