/* SPDX-License-Identifier: MIT */
/* Encoded pictures come back: exactly from raw, zstd and predicted, close enough from JPEG. */
#include "encode/encoder.h"
#include "encode/sparse.h"
#include "protocol/pixels/predicted.h"

#include "tests/accuracy/ycbcr_exact.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <zstd.h>

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
    return (struct picture){
        .width = width, .height = height, .bytes_per_pixel = bytes_per_pixel, .pixels = pixels};
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

TEST(raw_bytes_are_the_pixels)
{
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

TEST(zstd_gives_every_bit_back_at_every_level)
{
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

TEST(zstd_makes_an_even_picture_small)
{
    struct picture picture = make_picture(256, 256, 4);
    memset((void *)(uintptr_t)picture.pixels, 9, 256 * 256 * 4);
    size_t bytes;
    uint8_t *out = encode(ENCODING_ZSTD, &picture, 3, &bytes);
    assert_in_range(bytes, 1, 200);
    free(out);
    drop_picture(&picture);
}

/* The prediction by the protocol's document, word by word. */
static uint8_t foretell(const uint8_t *plane, size_t x, size_t y, size_t width)
{
    int a = x ? plane[y * width + x - 1] : 0, b = y ? plane[(y - 1) * width + x] : 0;
    int c = x && y ? plane[(y - 1) * width + x - 1] : 0;
    int minimum = a < b ? a : b, maximum = a < b ? b : a;
    return (uint8_t)(c >= maximum ? minimum : c <= minimum ? maximum : a + b - c);
}

static uint8_t *decode_predicted(const uint8_t *in, size_t in_bytes, const struct picture *picture)
{
    size_t width = picture->width, plane_bytes = width * picture->height;
    size_t bytes = plane_bytes * picture->bytes_per_pixel;
    uint8_t *planes = malloc(bytes), *pixels = malloc(bytes);
    assert_true(planes && pixels);
    assert_int_equal(ZSTD_getFrameContentSize(in, in_bytes), bytes);
    assert_int_equal(ZSTD_decompress(planes, bytes, in, in_bytes), bytes);
    for (size_t channel = 0; channel < picture->bytes_per_pixel; channel++) {
        uint8_t *plane = planes + channel * plane_bytes;
        for (size_t i = 0; i < plane_bytes; i++) {
            plane[i] = (uint8_t)(plane[i] + foretell(plane, i % width, i / width, width));
            pixels[i * picture->bytes_per_pixel + channel] = plane[i];
        }
    }
    free(planes);
    return pixels;
}

/* Sizes about those of what is done at once, and pixels that leap as well as even ones. */
TEST(predicted_gives_every_bit_back_at_every_level)
{
    const uint32_t widths[] = {1, 7, 15, 16, 17, 33, 321}, heights[] = {1, 2, 9};
    const unsigned qualities[] = {0, 1, 3, 19, 100};
    uint32_t random = 1;
    for (unsigned i = 0; i < 7 * 3 * 3 * 2; i++) {
        struct picture picture = make_picture(widths[i % 7], heights[i / 7 % 3], 4u << i / 21 % 3);
        size_t bytes, expected = (size_t)picture.width * picture.height * picture.bytes_per_pixel;
        for (size_t k = 0; i >= 63 && k < expected; k++) {
            random = random * 1664525 + 1013904223;
            ((uint8_t *)(uintptr_t)picture.pixels)[k] = (uint8_t)(random >> 24);
        }
        uint8_t *out = encode(ENCODING_PREDICTED, &picture, qualities[i % 5], &bytes);
        uint8_t *back = decode_predicted(out, bytes, &picture);
        assert_memory_equal(back, picture.pixels, expected);
        memset(back, 0xa5, expected);
        struct predicted_form form = {picture.width, picture.height, picture.bytes_per_pixel};
        assert_int_equal(predicted_decode(&form, out, bytes, back).status, PREDICTED_DONE);
        assert_memory_equal(back, picture.pixels, expected);
        free(back);
        free(out);
        drop_picture(&picture);
    }
}

/* Neighbours are left, above and above left: each branch of the rule, worked out by hand. */
TEST(predicted_leaves_what_the_rule_says)
{
    const uint8_t pixels[] = {10, 0, 0, 255, 30, 0, 0, 255, 25,  0, 1, 255,  /* first row: less what is left */
                              50, 0, 0, 255, 60, 0, 0, 255, 200, 0, 3, 255}; /* c <= min; c >= max; between */
    const uint8_t left[] = {
        10, 20, (uint8_t)-5, 40, 10, (uint8_t)(200 - 55), 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 2, 255, 0, 0, 0, 0, 0};
    struct picture picture = {.width = 3, .height = 2, .bytes_per_pixel = 4, .pixels = pixels};
    size_t bytes;
    uint8_t planes[sizeof(pixels)], *out = encode(ENCODING_PREDICTED, &picture, 1, &bytes);
    assert_int_equal(ZSTD_decompress(planes, sizeof(planes), out, bytes), sizeof(planes));
    assert_memory_equal(planes, left, sizeof(left));
    free(out);
}

/* Blocks of eight: pixels with a surface stay, others get the mean beside them, or behind them in the row. */
TEST(what_is_not_there_is_filled_block_by_block)
{
    enum { WIDE = 20, HIGH = 9 };
    static const uint8_t first[4] = {10, 20, 30, 255}, second[4] = {20, 40, 61, 255}, mean[4] = {15, 30, 46, 255};
    static const uint8_t below[4] = {1, 2, 3, 4};
    uint8_t filled[WIDE * HIGH * 4];
    float depths[WIDE * HIGH] = {0};
    memset(filled, 200, sizeof(filled));
    depths[0] = depths[1] = 1.0f;
    memcpy(filled, first, 4);
    memcpy(filled + 4, second, 4);
    depths[8 * WIDE] = 2.0f;
    memcpy(filled + (size_t)4 * 8 * WIDE, below, 4);
    sparse_fill(filled, depths, WIDE, HIGH);
    for (size_t i = 0; i < WIDE * HIGH; i++) {
        const uint8_t *expected = i == 0 ? first : i == 1 ? second : i < (size_t)8 * WIDE ? mean : below;
        assert_memory_equal(filled + 4 * i, expected, 4);
    }
}

TEST(predicted_is_smaller_than_zstd_where_a_picture_is_smooth)
{
    struct picture picture = make_picture(321, 200, 4);
    size_t predicted_bytes, zstd_bytes;
    free(encode(ENCODING_PREDICTED, &picture, 1, &predicted_bytes));
    free(encode(ENCODING_ZSTD, &picture, 1, &zstd_bytes));
    print_message("%zu bytes predicted, %zu not\n", predicted_bytes, zstd_bytes);
    assert_true(predicted_bytes < zstd_bytes);
    drop_picture(&picture);
}

/* Converts to Y'CbCr; the caller drops its planes. */
static struct picture convert(const struct picture *picture, enum ycbcr kind)
{
    uint8_t *rows = exact_rows(&(struct exact_picture){picture->pixels, picture->width, picture->height, kind});
    assert_non_null(rows);
    struct picture made = *picture;
    made.pixels = NULL;
    made.ycbcr = kind;
    made.planes = ycbcr_planes_at(rows, picture->width);
    return made;
}

static void drop_planes(struct picture *picture)
{
    free((void *)(uintptr_t)picture->planes.y);
}

/* Peak signal to noise of the colours, in dB; *subsampling as the JPEG's header has it. */
static double jpeg_psnr(const struct picture *given, const struct picture *picture, unsigned quality,
                        int *subsampling)
{
    uint32_t width = picture->width, height = picture->height;
    size_t bytes;
    uint8_t *out = encode(ENCODING_JPEG, given, quality, &bytes);
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
        double difference = i % 4 < 3 ? (double)back[i] - (double)picture->pixels[i] : 0;
        sum += difference * difference;
    }
    tjDestroy(handle);
    free(back);
    free(out);
    double mean = sum / (3.0 * width * height);
    return mean > 0 ? 10 * log10(255.0 * 255.0 / mean) : 99;
}

static double jpeg_psnr_at(uint32_t width, uint32_t height, unsigned quality, int *subsampling)
{
    struct picture picture = make_picture(width, height, 4);
    double psnr = jpeg_psnr(&picture, &picture, quality, subsampling);
    drop_picture(&picture);
    return psnr;
}

TEST(jpeg_comes_close_and_keeps_full_chroma_from_quality_90)
{
    /* Bounds a little below what libjpeg-turbo 2.1 reaches for this picture. */
    const struct {
        unsigned quality;
        double psnr;
        int subsampling;
    } expected[] = {{50, 37, TJSAMP_420}, {89, 43, TJSAMP_420}, {90, 45, TJSAMP_444}, {100, 50, TJSAMP_444}};
    for (size_t i = 0; i < 4; i++) {
        int subsampling;
        double psnr = jpeg_psnr_at(321, 200, expected[i].quality, &subsampling);
        print_message("quality %u: %.1f dB\n", expected[i].quality, psnr);
        if (psnr < expected[i].psnr)
            fail_msg("quality %u gives %.1f dB, at least %.1f expected", expected[i].quality, psnr,
                     expected[i].psnr);
        assert_int_equal(subsampling, expected[i].subsampling);
    }
    int subsampling;
    assert_true(jpeg_psnr_at(1, 1, 95, &subsampling) > 40);
    jpeg_psnr_at(4, 3, 80, &subsampling);                  /* padded to more than at full chroma */
    assert_true(jpeg_psnr_at(17, 9, 0, &subsampling) > 5); /* out of range: the lowest there is */
}

/* Noise takes the most bytes that there are: the bound holds for scans, too. */
TEST(jpeg_in_scans_is_the_same_picture_of_any_content)
{
    for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
        struct picture picture = make_picture(sizes[i][0], sizes[i][1], 4);
        uint8_t *pixels = malloc(picture_bytes(&picture));
        assert_non_null(pixels);
        for (size_t k = 0, random = 1; k < picture_bytes(&picture); k++, random = random * 69069 + 1)
            pixels[k] = (uint8_t)(random >> 16);
        struct picture noise = picture;
        noise.pixels = pixels;
        const struct picture *const pictures[] = {&picture, &noise};
        for (int k = 0; k < 4; k++) {
            struct picture in_scans = *pictures[k / 2];
            in_scans.in_scans = true;
            const unsigned quality = k % 2 ? 100 : 75;
            int subsampling;
            const double plain = jpeg_psnr(pictures[k / 2], pictures[k / 2], quality, &subsampling);
            assert_true(jpeg_psnr(&in_scans, pictures[k / 2], quality, &subsampling) == plain);
        }
        free(pixels);
        drop_picture(&picture);
    }
}

TEST(jpeg_of_planes_looks_like_that_of_their_pixels)
{
    static const uint32_t odd_sizes[][2] = {{1, 1}, {7, 3}, {16, 17}, {321, 199}};
    for (size_t i = 0; i < 4; i++) {
        for (unsigned quality = 5; quality < 90; quality += 28) {
            struct picture picture = make_picture(odd_sizes[i][0], odd_sizes[i][1], 4);
            struct picture planes = convert(&picture, YCBCR_JPEG);
            int subsampling;
            double before = jpeg_psnr(&picture, &picture, quality, &subsampling);
            double psnr = jpeg_psnr(&planes, &picture, quality, &subsampling);
            print_message("%ux%u, quality %u: %.2f dB, of planes %.2f dB\n", odd_sizes[i][0], odd_sizes[i][1],
                          quality, before, psnr);
            assert_int_equal(subsampling, TJSAMP_420);
            /* Both have the same matrix and means, and round them elsewhere: of small pictures that is some
             * tenths. */
            assert_true(psnr > before - 0.5);
            drop_planes(&planes);
            drop_picture(&picture);
        }
    }
}

TEST(planes_are_for_the_encoder_that_takes_them)
{
    struct picture picture = make_picture(8, 8, 4);
    for (unsigned quality = 0; quality <= 100; quality++) {
        assert_int_equal(encoder_takes(ENCODING_RAW, quality), YCBCR_NONE);
        assert_int_equal(encoder_takes(ENCODING_ZSTD, quality), YCBCR_NONE);
        assert_int_equal(encoder_takes(ENCODING_PREDICTED, quality), YCBCR_NONE);
        assert_int_equal(encoder_takes(ENCODING_H264, quality), YCBCR_VIDEO);
        /* Full chroma is more than planes have. */
        assert_int_equal(encoder_takes(ENCODING_JPEG, quality), quality < 90 ? YCBCR_JPEG : YCBCR_NONE);
    }
    for (enum ycbcr kind = YCBCR_VIDEO; kind <= YCBCR_JPEG; kind++) {
        struct picture planes = convert(&picture, kind);
        const enum encoding encodings[] = {ENCODING_RAW, ENCODING_ZSTD, ENCODING_PREDICTED, ENCODING_JPEG};
        for (int i = 0; i < 4; i++) {
            uint8_t *out;
            size_t bytes;
            struct error error = {0};
            unsigned quality = kind == YCBCR_JPEG ? 90 : 75;
            assert_false(encoder_encode(encodings[i], &planes, quality, &out, &bytes, &error));
            assert_int_equal(error.kind, ERROR_UNSUPPORTED);
            assert_null(out);
        }
        drop_planes(&planes);
    }
    drop_picture(&picture);
}

TEST(jpeg_carries_rgba8_only)
{
    const enum encoding encodings[] = {ENCODING_RAW, ENCODING_ZSTD, ENCODING_JPEG, ENCODING_PREDICTED};
    for (int i = 0; i < 4; i++) {
        assert_true(encoder_supports(encodings[i], 4));
        assert_int_equal(encoder_supports(encodings[i], 8), encodings[i] != ENCODING_JPEG);
        assert_int_equal(encoder_supports(encodings[i], 16), encodings[i] != ENCODING_JPEG);
        assert_false(encoder_supports(encodings[i], 3));
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

TEST(impossible_sizes_are_errors_before_any_memory_is_asked_for)
{
    const struct picture pictures[] = {
        {.width = UINT32_MAX, .height = UINT32_MAX, .bytes_per_pixel = 16},
        {.width = 0, .height = 4, .bytes_per_pixel = 4},
        {.width = 70000, .height = 1, .bytes_per_pixel = 4},
        {.width = UINT32_MAX, .height = UINT32_MAX, .bytes_per_pixel = 8},
    };
    const enum encoding encodings[] = {ENCODING_ZSTD, ENCODING_RAW, ENCODING_JPEG, ENCODING_PREDICTED};
    for (int i = 0; i < 4; i++) {
        struct error error = {0};
        uint8_t *out;
        size_t bytes;
        assert_false(encoder_encode(encodings[i], &pictures[i], 3, &out, &bytes, &error));
        assert_true(error.kind != ERROR_NONE);
    }
}
