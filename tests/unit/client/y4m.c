/* SPDX-License-Identifier: MIT */
/* Raw video: every colour against the definition of BT.709 in floating point, half chroma against a plain filter,
 * the stream byte by byte, and what becomes of it when nobody reads it. */
#include "lib/farlight.h"
#include "lib/rate.h"
#include "protocol/pixels/ycbcr.h"
#include "tests/harness/test.h"

#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static struct fl_error error;

/* ---- the definitions ---- */

/* ITU-R BT.709-6, items 3.2 and 3.4, of 0 to 255; not rounded. */
static void ycbcr_of(const double rgb[3], double out[3])
{
    const double red = rgb[0] / 255, green = rgb[1] / 255, blue = rgb[2] / 255;
    const double luma = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
    out[0] = 16 + 219 * luma;
    out[1] = 128 + 224 * (blue - luma) / 1.8556;
    out[2] = 128 + 224 * (red - luma) / 1.5748;
}

/* IEC 61966-2-1 both ways: the colour of which so much covers black. */
static double over_black(double value, double alpha)
{
    const double encoded = value / 255;
    const double linear =
        (encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4)) * alpha / 255;
    return 255 * (linear <= 0.0031308 ? linear * 12.92 : 1.055 * pow(linear, 1 / 2.4) - 0.055);
}

static uint32_t noise_state = 1;
static uint8_t noise(void)
{
    noise_state = noise_state * 1664525u + 1013904223u;
    return (uint8_t)(noise_state >> 24);
}

static uint8_t *noise_pixels(uint32_t width, uint32_t height, bool opaque)
{
    uint8_t *pixels = malloc((size_t)width * height * 4);
    assert_non_null(pixels);
    for (size_t i = 0; i < (size_t)width * height * 4; i++)
        pixels[i] = opaque && i % 4 == 3 ? 255 : noise();
    return pixels;
}

/* ---- conversion ---- */

TEST(every_colour_becomes_the_nearest_luma_and_chroma)
{
    static uint8_t pixels[256 * 4], y[256], cb[256], cr[256];
    struct ycbcr_converter converter;
    const struct ycbcr_target planes = {y, cb, cr, 256, 256, 256, 1, false};
    assert_true(ycbcr_converter_init(&converter, 256, 1, YCBCR_ALPHA_OVER_BLACK));
    double maximum = 0;
    /* Red and blue in steps of 3 that hit both ends; green, which weighs most, in all steps. */
    for (unsigned red = 0; red < 256; red += 3)
        for (unsigned blue = 0; blue < 256; blue += 3) {
            for (unsigned green = 0; green < 256; green++)
                memcpy(pixels + (size_t)4 * green, (uint8_t[]){(uint8_t)red, (uint8_t)green, (uint8_t)blue, 255},
                       4);
            ycbcr_convert(&converter, pixels, &planes);
            for (unsigned green = 0; green < 256; green++) {
                double wanted[3];
                ycbcr_of((double[]){red, green, blue}, wanted);
                maximum = fmax(maximum, fabs(y[green] - wanted[0]));
                maximum = fmax(maximum, fabs(cb[green] - wanted[1]));
                maximum = fmax(maximum, fabs(cr[green] - wanted[2]));
            }
        }
    ycbcr_converter_finish(&converter);
    /* The nearest is half a step away at most; fixed point adds less than 1e-3 (see ycbcr.c). */
    if (maximum > 0.501)
        fail_msg("a value is off by %.4f", maximum);
}

TEST(black_white_and_grey_have_the_levels_of_the_standard)
{
    uint8_t pixels[] = {0, 0, 0, 255, 255, 255, 255, 255, 128, 128, 128, 255}, y[3], cb[3], cr[3];
    struct ycbcr_converter converter;
    const struct ycbcr_target planes = {y, cb, cr, 3, 3, 3, 1, false};
    assert_true(ycbcr_converter_init(&converter, 3, 1, YCBCR_ALPHA_OVER_BLACK));
    ycbcr_convert(&converter, pixels, &planes);
    ycbcr_converter_finish(&converter);
    assert_memory_equal(y, ((uint8_t[]){16, 235, 126}), 3); /* 16 + 219 * 128 / 255 = 125.9 */
    assert_memory_equal(cb, ((uint8_t[]){128, 128, 128}), 3);
    assert_memory_equal(cr, ((uint8_t[]){128, 128, 128}), 3);
}

TEST(what_is_transparent_lies_over_black_in_linear_light)
{
    uint8_t *pixels = malloc(65536 * 4);
    struct ycbcr_converter converter;
    assert_non_null(pixels);
    assert_true(ycbcr_converter_init(&converter, 256, 256, YCBCR_ALPHA_OVER_BLACK));
    for (unsigned i = 0; i < 65536; i++)
        memset(pixels + (size_t)4 * i, (int)(i % 256), 3), pixels[4 * i + 3] = (uint8_t)(i / 256);
    for (uint32_t alpha = 0; alpha < 256; alpha++) {
        const uint8_t *row = ycbcr_opaque_row(&converter, pixels, alpha);
        for (unsigned value = 0; value < 256; value++)
            if (fabs(row[3 * value] - over_black(value, alpha)) > 0.5 + 1e-9)
                fail_msg("%u with alpha %u becomes %d in place of %f", value, alpha, row[3 * value],
                         over_black(value, alpha));
    }
    /* Readers may rely on this: opaque pixels are unchanged, transparent ones black, half of white is 188,
     * not 128. */
    assert_int_equal(ycbcr_opaque_row(&converter, pixels, 255)[3 * 77], 77);
    assert_int_equal(ycbcr_opaque_row(&converter, pixels, 0)[3 * 255], 0);
    assert_int_equal(ycbcr_opaque_row(&converter, pixels, 128)[3 * 255], 188);
    ycbcr_converter_finish(&converter);
    free(pixels);
}

static uint32_t within(int64_t at, uint32_t count)
{
    return at < 0 ? 0 : at >= count ? count - 1 : (uint32_t)at;
}

/* A chroma sample by the definition in ycbcr.h, edges repeated. */
static void half_chroma_at(const uint8_t *pixels, uint32_t size[2], uint32_t x, uint32_t y, double out[3])
{
    double mean[3] = {0};
    for (int row = 0; row < 2; row++)
        for (int column = -1; column < 2; column++) {
            const uint32_t from_x = within((int64_t)2 * x + column, size[0]);
            const uint32_t from_y = within((int64_t)2 * y + row, size[1]);
            for (int c = 0; c < 3; c++)
                mean[c] +=
                    (column == 0 ? 2 : 1) / 8.0 * pixels[4 * ((size_t)from_y * size[0] + from_x) + (size_t)c];
        }
    ycbcr_of(mean, out);
}

TEST(half_chroma_is_filtered_and_odd_pictures_repeat_their_edges)
{
    static uint32_t sizes[][2] = {{1, 1}, {2, 2}, {3, 5}, {5, 3}, {16, 9}, {17, 8}, {1, 7}, {7, 1}};
    for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
        uint32_t *size = sizes[i];
        uint8_t *pixels = noise_pixels(size[0], size[1], true), y[1024], cb[256], cr[256];
        const uint32_t even[2] = {(size[0] + 1) & ~1u, (size[1] + 1) & ~1u};
        const struct ycbcr_target planes = {y, cb, cr, even[0], even[0] / 2, even[0], even[1], true};
        struct ycbcr_converter converter;
        assert_true(ycbcr_converter_init(&converter, size[0], size[1], YCBCR_ALPHA_OVER_BLACK));
        ycbcr_convert(&converter, pixels, &planes);
        ycbcr_converter_finish(&converter);
        for (uint32_t at = 0; at < even[0] * even[1]; at++) {
            double wanted[3];
            const uint8_t *from =
                pixels + 4 * ((size_t)within(at / even[0], size[1]) * size[0] + within(at % even[0], size[0]));
            ycbcr_of((double[]){from[0], from[1], from[2]}, wanted);
            if (fabs(y[at] - wanted[0]) > 0.501)
                fail_msg("%ux%u: luma %u is %d in place of %f", size[0], size[1], at, y[at], wanted[0]);
        }
        for (uint32_t at = 0; at < even[0] * even[1] / 4; at++) {
            double wanted[3];
            half_chroma_at(pixels, size, at % (even[0] / 2), at / (even[0] / 2), wanted);
            if (fabs(cb[at] - wanted[1]) > 0.501 || fabs(cr[at] - wanted[2]) > 0.501)
                fail_msg("%ux%u: chroma %u is %d,%d in place of %f,%f", size[0], size[1], at, cb[at], cr[at],
                         wanted[1], wanted[2]);
        }
        free(pixels);
    }
}

TEST(frame_rates_are_the_fractions_that_are_meant)
{
    static const struct {
        float rate;
        uint32_t numerator, denominator;
    } rows[] = {{24, 24, 1},
                {25, 25, 1},
                {60, 60, 1},
                {12.5f, 25, 2},
                {23.976f, 24000, 1001},
                {23.98f, 24000, 1001},
                {29.97f, 30000, 1001},
                {59.94f, 60000, 1001},
                {119.88f, 120000, 1001},
                {47.952f, 48000, 1001},
                {0.5f, 1, 2},
                {0.1f, 1, 10},
                {14.985f, 2997, 200},
                {1000, 1000, 1},
                {0.001f, 1, 1000}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        uint32_t numerator, denominator;
        fl_rate_exact(rows[i].rate, &numerator, &denominator);
        if (numerator != rows[i].numerator || denominator != rows[i].denominator)
            fail_msg("%g is %u/%u in place of %u/%u", (double)rows[i].rate, numerator, denominator,
                     rows[i].numerator, rows[i].denominator);
    }
}

/* ---- the stream ---- */

static struct fl_frame frame_of(uint8_t *pixels, uint32_t width, uint32_t height)
{
    struct fl_frame frame = {.width = width, .height = height, .format = PROTOCOL_PIXEL_FORMAT_RGBA8};
    frame.pixels = pixels;
    frame.pixels_bytes = (size_t)width * height * 4;
    return frame;
}

static size_t read_file(FILE *file, uint8_t *bytes, size_t capacity)
{
    rewind(file);
    return fread(bytes, 1, capacity, file);
}

TEST(a_stream_is_a_header_and_frames_of_planes)
{
    uint8_t pixels[] = {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255}, found[512];
    /* Red, green, blue by BT.709: 16 + 219 (.2126, .7152, .0722) and so on, rounded. */
    static const char wanted_444[] = "YUV4MPEG2 W3 H1 F30000:1001 Ip A1:1 C444 XCOLORRANGE=LIMITED\n"
                                     "FRAME\n\x3f\xad\x20\x66\x2a\xf0\xf0\x1a\x76"
                                     "FRAME\n\x3f\xad\x20\x66\x2a\xf0\xf0\x1a\x76";
    /* Chroma of 3/4 red and 1/4 green; of 1/4 green and 3/4 blue. */
    static const char wanted_420[] = "YUV4MPEG2 W3 H1 F24:1 Ip A1:1 C420mpeg2 XCOLORRANGE=LIMITED\n"
                                     "FRAME\n\x3f\xad\x20\x57\xbe\xbb\x5f";
    static const struct {
        const char *bytes;
        size_t count;
        float rate;
        enum fl_y4m_chroma chroma;
        unsigned frames;
    } rows[] = {{wanted_444, sizeof(wanted_444) - 1, 29.97f, FL_Y4M_444, 2},
                {wanted_420, sizeof(wanted_420) - 1, 0, FL_Y4M_420, 1}};
    for (size_t i = 0; i < 2; i++) {
        FILE *file = tmpfile();
        assert_non_null(file);
        const struct fl_y4m_options options = {
            .fd = fileno(file), .frames_per_second = rows[i].rate, .chroma = rows[i].chroma};
        struct fl_y4m *y4m = fl_y4m_begin(&options, &error);
        const struct fl_frame frame = frame_of(pixels, 3, 1);
        assert_non_null(y4m);
        for (unsigned n = 0; n < rows[i].frames; n++)
            assert_true(fl_y4m_write(y4m, &frame, &error));
        fl_y4m_end(y4m);
        assert_int_equal(read_file(file, found, sizeof(found)), rows[i].count);
        assert_memory_equal(found, rows[i].bytes, rows[i].count);
        fclose(file);
    }
}

TEST(frames_that_do_not_fit_are_refused_and_write_nothing)
{
    uint8_t pixels[4 * 4 * 16] = {0}, found[512];
    FILE *file = tmpfile();
    assert_non_null(file);
    struct fl_y4m *y4m = fl_y4m_begin(&(struct fl_y4m_options){.fd = fileno(file)}, &error);
    assert_non_null(y4m);
    struct fl_frame frame = frame_of(pixels, 4, 4);
    frame.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    frame.pixels_bytes = sizeof(pixels);
    assert_false(fl_y4m_write(y4m, &frame, &error));
    assert_string_equal(error.field, "format");
    assert_non_null(strstr(error.remedy, "rgba8"));
    static const uint32_t wrong[][2] = {{0, 4}, {4, 0}, {4, 5}, {8193, 1}, {0xffffffff, 1}};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        frame = frame_of(pixels, wrong[i][0], wrong[i][1]);
        frame.pixels_bytes = i < 2 ? 0 : 64;
        assert_false(fl_y4m_write(y4m, &frame, &error));
        assert_string_equal(error.field, "size");
    }
    assert_int_equal(read_file(file, found, sizeof(found)), 0);
    frame = frame_of(pixels, 4, 4);
    assert_true(fl_y4m_write(y4m, &frame, &error));
    const size_t count = read_file(file, found, sizeof(found));
    frame = frame_of(pixels, 2, 8);
    assert_false(fl_y4m_write(y4m, &frame, &error));
    assert_non_null(strstr(error.text, "2x8 pixels, but the video has 4x4"));
    assert_int_equal(read_file(file, found, sizeof(found)), count);
    fl_y4m_end(y4m);
    fclose(file);
}

TEST(a_reader_that_has_gone_is_an_error_and_no_signal)
{
    int ends[2];
    uint8_t pixels[64] = {0};
    sigset_t waiting;
    signal(SIGPIPE, SIG_DFL); /* would end this test */
    for (int kind = 0; kind < 2; kind++) {
        assert_int_equal(kind == 0 ? pipe(ends) : socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
        close(ends[0]);
        struct fl_y4m *y4m = fl_y4m_begin(&(struct fl_y4m_options){.fd = ends[1]}, &error);
        assert_non_null(y4m);
        const struct fl_frame frame = frame_of(pixels, 4, 4);
        error = (struct fl_error){0};
        assert_false(fl_y4m_write(y4m, &frame, &error));
        assert_int_equal(error.code, FL_ERROR_FILE);
        assert_non_null(strstr(error.text, "Broken pipe"));
        assert_false(fl_y4m_write(y4m, &frame, &error));
        assert_int_equal(error.code, FL_ERROR_ARGUMENT);
        fl_y4m_end(y4m);
        close(ends[1]);
    }
    sigpending(&waiting);
    assert_false(sigismember(&waiting, SIGPIPE));
    assert_null(fl_y4m_begin(&(struct fl_y4m_options){.fd = ends[1]}, &error));
    assert_int_equal(error.code, FL_ERROR_FILE);
}

TEST(a_full_disk_is_reported)
{
    uint8_t pixels[64] = {0};
    const int fd = open("/dev/full", O_WRONLY);
    assert_true(fd >= 0);
    struct fl_y4m *y4m = fl_y4m_begin(&(struct fl_y4m_options){.fd = fd}, &error);
    const struct fl_frame frame = frame_of(pixels, 4, 4);
    assert_non_null(y4m);
    assert_false(fl_y4m_write(y4m, &frame, &error));
    assert_non_null(strstr(error.text, "No space left"));
    fl_y4m_end(y4m);
    close(fd);
}

TEST(a_reader_that_does_not_read_can_be_interrupted)
{
    int ends[2], interrupt[2];
    uint8_t *pixels = noise_pixels(512, 512, true); /* more than a pipe holds */
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(pipe(interrupt), 0);
    assert_int_equal(write(interrupt[1], "x", 1), 1);
    for (int flags = 0; flags < 2; flags++) { /* blocking and not */
        assert_int_equal(fcntl(ends[1], F_SETFL, flags == 0 ? 0 : O_NONBLOCK), 0);
        struct fl_y4m *y4m =
            fl_y4m_begin(&(struct fl_y4m_options){.fd = ends[1], .interrupt_fd = interrupt[0]}, &error);
        const struct fl_frame frame = frame_of(pixels, 512, 512);
        assert_non_null(y4m);
        assert_false(fl_y4m_write(y4m, &frame, &error));
        assert_int_equal(error.code, FL_ERROR_INTERRUPTED);
        fl_y4m_end(y4m);
    }
    for (int i = 0; i < 2; i++) {
        close(ends[i]);
        close(interrupt[i]);
    }
    free(pixels);
}

TEST(ffmpeg_reads_the_stream_from_a_pipe)
{
    const uint32_t width = 37, height = 21, count = 3;
    static uint8_t found[37 * 21 * 3 * 3];
    if (system("ffmpeg -version >/dev/null 2>&1") != 0) {
        print_message("skipped: ffmpeg is not installed\n");
        skip();
    }
    for (int half = 0; half < 2; half++) {
        char path[64], command[256];
        snprintf(path, sizeof(path), "%s/farlight-y4m-XXXXXX", P_tmpdir);
        const int out = mkstemp(path);
        assert_true(out >= 0);
        snprintf(command, sizeof(command), "ffmpeg -v error -i - -f rawvideo -pix_fmt %s -y %s",
                 half ? "yuv420p" : "yuv444p", path);
        FILE *pipe = popen(command, "w");
        assert_non_null(pipe);
        const struct fl_y4m_options options = {.fd = fileno(pipe), .chroma = half ? FL_Y4M_420 : FL_Y4M_444};
        struct fl_y4m *y4m = fl_y4m_begin(&options, &error);
        assert_non_null(y4m);
        uint8_t *pixels = noise_pixels(width, height, false);
        const struct fl_frame frame = frame_of(pixels, width, height);
        for (uint32_t n = 0; n < count; n++)
            assert_true(fl_y4m_write(y4m, &frame, &error));
        fl_y4m_end(y4m);
        assert_int_equal(pclose(pipe), 0);
        /* Nothing is converted on the way: the planes come back as they are. */
        static uint8_t planes_memory[37 * 21 * 3];
        const size_t luma = (size_t)width * height, chroma = half ? (size_t)19 * 11 : luma;
        const struct ycbcr_target planes = {planes_memory,
                                            planes_memory + luma,
                                            planes_memory + luma + chroma,
                                            width,
                                            half ? 19 : width,
                                            width,
                                            height,
                                            half != 0};
        struct ycbcr_converter converter;
        assert_true(ycbcr_converter_init(&converter, width, height, YCBCR_ALPHA_OVER_BLACK));
        ycbcr_convert(&converter, pixels, &planes);
        ycbcr_converter_finish(&converter);
        const size_t frame_bytes = luma + 2 * chroma;
        assert_int_equal(read(out, found, sizeof(found)), count * frame_bytes);
        for (uint32_t n = 0; n < count; n++)
            assert_memory_equal(found + n * frame_bytes, planes_memory, frame_bytes);
        free(pixels);
        close(out);
        unlink(path);
    }
}
