/* SPDX-License-Identifier: MIT */
/* Which encoder of H.264 is taken when one fails: a device that refuses is not asked again, memory that is short
 * for a moment changes nothing. The library is the real one, but what it calls the hardware's encoder is x264 as
 * well. */
#include "encode/libav.h"
#include "encode/stream.h"
#include "tests/harness/test.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#define EDGE 64u

static struct {
    struct libav faked;
    const struct libav *real;
    bool is_hardware; /* the encoder that was asked for last */
    unsigned hardware_opened;
    bool no_packet, refuses, sends_nothing; /* the hardware's, now */
    bool is_replaced;
} library;

const struct libav *__real_libav_load(void);
const struct libav *__wrap_libav_load(void);

static const AVCodec *find_encoder(const char *name)
{
    library.is_hardware = strcmp(name, "h264_nvenc") == 0;
    return library.real->avcodec_find_encoder_by_name("libx264");
}

static int open_encoder(AVCodecContext *codec, const AVCodec *which, AVDictionary **options)
{
    if (!library.is_hardware)
        return library.real->avcodec_open2(codec, which, options);
    if (library.refuses)
        return AVERROR_EXTERNAL;
    library.hardware_opened++;
    AVDictionary *fitting = NULL; /* the hardware's mean nothing to x264 */
    library.real->av_dict_set(&fitting, "tune", "zerolatency", 0);
    int status = library.real->avcodec_open2(codec, which, &fitting);
    library.real->av_dict_free(&fitting);
    return status;
}

static AVPacket *new_packet(void)
{
    return library.no_packet && library.is_hardware ? NULL : library.real->av_packet_alloc();
}

static int send_frame(AVCodecContext *codec, const AVFrame *frame)
{
    return library.sends_nothing ? AVERROR(ENOMEM) : library.real->avcodec_send_frame(codec, frame);
}

const struct libav *__wrap_libav_load(void)
{
    library.real = __real_libav_load();
    if (!library.real || !library.is_replaced)
        return library.real; /* the real library, for the other files of this program */
    library.faked = *library.real;
    library.faked.avcodec_find_encoder_by_name = find_encoder;
    library.faked.avcodec_open2 = open_encoder;
    library.faked.av_packet_alloc = new_packet;
    library.faked.avcodec_send_frame = send_frame;
    return &library.faked;
}

static bool encode(struct error *error)
{
    static const uint8_t pixels[EDGE * EDGE * 4];
    const struct picture picture = {.width = EDGE, .height = EDGE, .bytes_per_pixel = 4, .pixels = pixels};
    struct encoder_stream *stream = encoder_stream_create(ENCODING_H264, 30, error);
    assert_non_null(stream);
    struct encoded_picture out;
    bool done = encoder_stream_encode(stream, &picture, &(struct encoder_request){.quality = 75}, &out, error);
    free(out.bytes);
    encoder_stream_destroy(stream);
    return done;
}

/* Whether the hardware's encoder made the picture of a new stream. */
static bool takes_hardware(void)
{
    struct error error = {0};
    unsigned before = library.hardware_opened;
    if (!encode(&error))
        fail_msg("%s", error.text);
    return library.hardware_opened > before;
}

static int skip_without_h264(void **state)
{
    (void)state;
    library.is_replaced = true;
    if (!encoder_stream_supports(ENCODING_H264, 4))
        test_skip_file("no encoder of H.264 is here");
    return 0;
}
ALL_TESTS(skip_without_h264, NULL)

TEST(memory_that_is_short_once_takes_no_encoder_away)
{
    struct error error = {0};
    assert_true(takes_hardware());
    library.no_packet = true;
    assert_true(encode(&error)); /* another one has what it needs */
    library.no_packet = false;
    assert_true(takes_hardware());
    library.sends_nothing = true;
    assert_false(encode(&error));
    assert_int_equal(error.kind, ERROR_OUT_OF_MEMORY);
    library.sends_nothing = false;
    assert_true(takes_hardware());
}

TEST(a_device_that_refuses_is_not_asked_again)
{
    library.refuses = true;
    assert_false(takes_hardware());
    library.refuses = false;
    assert_false(takes_hardware());
}
