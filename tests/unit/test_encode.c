/* SPDX-License-Identifier: MIT */
/* What is encoded comes back: exactly from raw and zstd, close enough from JPEG. */
#include "encode/encoder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <zstd.h>

#include <cmocka.h>

/* A picture in memory of exactly its size, so that a read beyond it is seen by the address sanitizer. */
static struct picture make_picture(uint32_t width, uint32_t height, uint32_t bytes_per_pixel)
{
    size_t bytes = (size_t)width * height * bytes_per_pixel;
    uint8_t *pixels = malloc(bytes);
    assert_non_null(pixels);
    for (size_t i = 0; i < bytes; i++) {
        size_t x = i / bytes_per_pixel % width, y = i / bytes_per_pixel / width, channel = i % bytes_per_pixel;
        pixels[i] = (uint8_t)(127.5 + 120 * sin(0.05 * (double)x * (double)(channel + 1)) * cos(0.03 * (double)y));
    }
    return (struct picture){width, height, bytes_per_pixel, pixels};
}

static void drop_picture(struct picture *picture)
{
    free((void *)(uintptr_t)picture->pixels);
}

static uint8_t *encode(enum encoding encoding, const struct picture *picture, unsigned quality, size_t *bytes)
{
    struct error error = {0};
    uint8_t *out = NULL;
    if (!encoder_encode(encoding, picture, quality, &out, bytes, &error))
        fail_msg("%s", error.text);
    assert_non_null(out);
    return out;
}

static const uint32_t sizes[][2] = {{1, 1}, {7, 3}, {64, 64}, {321, 200}};

static void raw_bytes_are_the_pixels(void **state)
{
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        struct picture picture = make_picture(sizes[i][0], sizes[i][1], 16);
        size_t bytes;
        uint8_t *out = encode(ENCODING_RAW, &picture, 1, &bytes);
        assert_int_equal(bytes, (size_t)sizes[i][0] * sizes[i][1] * 16);
        assert_memory_equal(out, picture.pixels, bytes);
        free(out);
        drop_picture(&picture);
    }
}

static void zstd_gives_every_bit_back_at_every_level(void **state)
{
    (void)state;
    const unsigned qualities[] = {0, 1, 3, 19, 100};
    const uint32_t pixel_bytes[] = {4, 8, 16};
    for (size_t i = 0; i < 4; i++) {
        for (size_t k = 0; k < 5; k++) {
            struct picture picture = make_picture(sizes[i][0], sizes[i][1], pixel_bytes[k % 3]);
            size_t bytes, expected = (size_t)sizes[i][0] * sizes[i][1] * pixel_bytes[k % 3];
            uint8_t *out = encode(ENCODING_ZSTD, &picture, qualities[k], &bytes);
            assert_int_equal(ZSTD_getFrameContentSize(out, bytes), expected);
            uint8_t *back = malloc(expected);
            assert_non_null(back);
            assert_int_equal(ZSTD_decompress(back, expected, out, bytes), expected);
            assert_memory_equal(back, picture.pixels, expected);
            free(back);
            free(out);
            drop_picture(&picture);
        }
    }
}

static void zstd_makes_an_even_picture_small(void **state)
{
    (void)state;
    struct picture picture = make_picture(256, 256, 4);
    memset((void *)(uintptr_t)picture.pixels, 9, 256 * 256 * 4);
    size_t bytes;
    uint8_t *out = encode(ENCODING_ZSTD, &picture, 3, &bytes);
    assert_in_range(bytes, 1, 200);
    free(out);
    drop_picture(&picture);
}

/* Peak signal to noise of the colours, in dB; *subsampling as the JPEG's header has it. */
static double jpeg_psnr(uint32_t width, uint32_t height, unsigned quality, int *subsampling)
{
    struct picture picture = make_picture(width, height, 4);
    size_t bytes;
    uint8_t *out = encode(ENCODING_JPEG, &picture, quality, &bytes);
    tjhandle handle = tjInitDecompress();
    assert_non_null(handle);
    int got_width, got_height, colourspace;
    assert_int_equal(tjDecompressHeader3(handle, out, bytes, &got_width, &got_height, subsampling, &colourspace),
                     0);
    assert_int_equal(got_width, width);
    assert_int_equal(got_height, height);
    uint8_t *back = malloc((size_t)width * height * 4);
    assert_non_null(back);
    assert_int_equal(tjDecompress2(handle, out, bytes, back, (int)width, 0, (int)height, TJPF_RGBX, 0), 0);
    double sum = 0;
    for (size_t i = 0; i < (size_t)width * height * 4; i++) {
        double difference = i % 4 < 3 ? (double)back[i] - (double)picture.pixels[i] : 0;
        sum += difference * difference;
    }
    tjDestroy(handle);
    free(back);
    free(out);
    drop_picture(&picture);
    double mean = sum / (3.0 * width * height);
    return mean > 0 ? 10 * log10(255.0 * 255.0 / mean) : 99;
}

static void jpeg_comes_close_and_keeps_full_chroma_from_quality_90(void **state)
{
    (void)state;
    /* Bounds a little below what libjpeg-turbo 2.1 reaches for this picture. */
    const struct {
        unsigned quality;
        double psnr;
        int subsampling;
    } expected[] = {{50, 37, TJSAMP_420}, {89, 43, TJSAMP_420}, {90, 45, TJSAMP_444}, {100, 50, TJSAMP_444}};
    for (size_t i = 0; i < 4; i++) {
        int subsampling;
        double psnr = jpeg_psnr(321, 200, expected[i].quality, &subsampling);
        print_message("quality %u: %.1f dB\n", expected[i].quality, psnr);
        if (psnr < expected[i].psnr)
            fail_msg("quality %u gives %.1f dB, at least %.1f expected", expected[i].quality, psnr,
                     expected[i].psnr);
        assert_int_equal(subsampling, expected[i].subsampling);
    }
    int subsampling;
    assert_true(jpeg_psnr(1, 1, 95, &subsampling) > 40);
    jpeg_psnr(4, 3, 80, &subsampling); /* padded to more than at full chroma */
    assert_true(jpeg_psnr(17, 9, 0, &subsampling) > 5); /* out of range: the lowest there is */
}

static void jpeg_carries_rgba8_only(void **state)
{
    (void)state;
    for (int encoding = 0; encoding < ENCODING_COUNT; encoding++) {
        assert_true(encoder_supports((enum encoding)encoding, 4));
        assert_int_equal(encoder_supports((enum encoding)encoding, 8), encoding != ENCODING_JPEG);
        assert_int_equal(encoder_supports((enum encoding)encoding, 16), encoding != ENCODING_JPEG);
        assert_false(encoder_supports((enum encoding)encoding, 3));
    }
    assert_false(encoder_supports((enum encoding)99, 4));
    struct picture picture = make_picture(2, 2, 8);
    struct error error = {0};
    uint8_t *out;
    size_t bytes;
    assert_false(encoder_encode(ENCODING_JPEG, &picture, 90, &out, &bytes, &error));
    assert_int_equal(error.kind, ERROR_UNSUPPORTED);
    assert_null(out);
    error = (struct error){0};
    assert_false(encoder_encode((enum encoding)99, &picture, 90, &out, &bytes, &error));
    assert_int_equal(error.kind, ERROR_UNSUPPORTED);
    drop_picture(&picture);
}

static void impossible_sizes_are_errors_before_any_memory_is_asked_for(void **state)
{
    (void)state;
    const struct picture pictures[] = {{UINT32_MAX, UINT32_MAX, 16, NULL}, {0, 4, 4, NULL}, {70000, 1, 4, NULL}};
    const enum encoding encodings[] = {ENCODING_ZSTD, ENCODING_RAW, ENCODING_JPEG};
    for (int i = 0; i < 3; i++) {
        struct error error = {0};
        uint8_t *out;
        size_t bytes;
        assert_false(encoder_encode(encodings[i], &pictures[i], 3, &out, &bytes, &error));
        assert_true(error.kind != ERROR_NONE);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(raw_bytes_are_the_pixels),
        cmocka_unit_test(zstd_gives_every_bit_back_at_every_level),
        cmocka_unit_test(zstd_makes_an_even_picture_small),
        cmocka_unit_test(jpeg_comes_close_and_keeps_full_chroma_from_quality_90),
        cmocka_unit_test(jpeg_carries_rgba8_only),
        cmocka_unit_test(impossible_sizes_are_errors_before_any_memory_is_asked_for),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
