/* SPDX-License-Identifier: MIT */
/* A decoder of H.264 that is asked for each picture before it gets the next packet. */
#ifndef FARLIGHT_TESTS_H264_PLAYER_H
#define FARLIGHT_TESTS_H264_PLAYER_H

#include "encode/stream.h"
#include "tests/harness/test.h"

#include <libavcodec/avcodec.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct player {
    AVCodecContext *context;
    AVPacket *packet;
    AVFrame *frame;
};

static inline struct player player_begin(void)
{
    struct player player = {.packet = av_packet_alloc(), .frame = av_frame_alloc()};
    const AVCodec *codec = avcodec_find_decoder(AV_CODEC_ID_H264);
    assert_non_null(codec);
    player.context = avcodec_alloc_context3(codec);
    assert_true(player.context && player.packet && player.frame);
    player.context->flags |= AV_CODEC_FLAG_LOW_DELAY;
    player.context->thread_count = 1;
    player.context->err_recognition = AV_EF_EXPLODE;
    assert_int_equal(avcodec_open2(player.context, codec, NULL), 0);
    av_log_set_level(AV_LOG_QUIET);
    return player;
}

static inline void player_end(struct player *player)
{
    av_packet_free(&player->packet);
    av_frame_free(&player->frame);
    avcodec_free_context(&player->context);
}

/* Whether the packet gives a picture before the next one is given. */
static inline bool play(struct player *player, const uint8_t *bytes, size_t size_bytes)
{
    assert_int_equal(av_new_packet(player->packet, (int)size_bytes), 0);
    memcpy(player->packet->data, bytes, size_bytes);
    bool good = avcodec_send_packet(player->context, player->packet) == 0 &&
                avcodec_receive_frame(player->context, player->frame) == 0;
    av_packet_unref(player->packet);
    return good;
}

/* Quality of the shown picture, in dB; the formulas of BT.709-6 in reverse. */
static inline double psnr(const AVFrame *shown, const uint8_t *pixels, uint32_t width, uint32_t height)
{
    double sum = 0;
    for (uint32_t y = 0; y < height; y++) {
        for (uint32_t x = 0; x < width; x++, pixels += 4) {
            double luma = (shown->data[0][y * (uint32_t)shown->linesize[0] + x] - 16) / 219.0;
            double cb = (shown->data[1][y / 2 * (uint32_t)shown->linesize[1] + x / 2] - 128) / 224.0;
            double cr = (shown->data[2][y / 2 * (uint32_t)shown->linesize[2] + x / 2] - 128) / 224.0;
            double red = luma + 1.5748 * cr, blue = luma + 1.8556 * cb;
            double green = (luma - 0.2126 * red - 0.0722 * blue) / 0.7152;
            sum +=
                pow(255 * red - pixels[0], 2) + pow(255 * green - pixels[1], 2) + pow(255 * blue - pixels[2], 2);
        }
    }
    double mean = sum / (3.0 * width * height);
    return mean > 0 ? 10 * log10(255.0 * 255.0 / mean) : 99;
}

/* Where libavcodec has no encoder of H.264, or none of the version that this was built for is there. */
static inline int skip_without_h264(void **state)
{
    (void)state;
    if (!encoder_stream_supports(ENCODING_H264, 4))
        test_skip_file("no encoder of H.264 is here");
    return 0;
}

#endif
