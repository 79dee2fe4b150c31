/* SPDX-License-Identifier: MIT */
/* Videos through the real writer, read back with ffmpeg's own programs: what is in the file, what a player is told
 * about it, and what is left of one that does not come about. */
#include "lib/farlight.h"
#include "lib/ycbcr.h"

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmocka.h>

static struct fl_error error;
static char folder[64], video_path[96];

static bool find_writer(void)
{
    char self[4096], program[4200];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    assert_true(length > 0);
    self[length] = '\0';
    for (int i = 0; i < 3; i++) /* build/CONFIG/tests/unit/test: the programs are in build/CONFIG */
        *strrchr(self, '/') = '\0';
    snprintf(program, sizeof program, "%s/farlight-video", self);
    setenv("FARLIGHT_LIBEXEC", self, 1);
    return access(program, X_OK) == 0;
}

static void need(bool reader)
{
    if (!find_writer()) {
        print_message("skipped: farlight-video is not built\n");
        skip();
    }
    if (reader && system("ffprobe -version >/dev/null 2>&1 && ffmpeg -version >/dev/null 2>&1") != 0) {
        print_message("skipped: ffmpeg and ffprobe are not installed\n");
        skip();
    }
}

static int make_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof folder, "%s/farlight-video-XXXXXX", P_tmpdir);
    return mkdtemp(folder) == NULL ? -1 : 0;
}

static int remove_folder(void **state)
{
    (void)state;
    return rmdir(folder); /* fails where a test has left something */
}

static size_t count_files(void)
{
    size_t count = 0;
    DIR *listing = opendir(folder);
    assert_non_null(listing);
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing))
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(listing);
    return count;
}

static const char *path_of(const char *name)
{
    snprintf(video_path, sizeof video_path, "%s/%s", folder, name);
    return video_path;
}

/* ---- pictures ---- */

/* Squares of 32 pixels; with the frame's number they move on. */
static const uint8_t colours[][3] = {{255, 0, 0}, {0, 255, 0},     {0, 0, 255},    {255, 255, 255},
                                     {0, 0, 0},   {128, 128, 128}, {200, 120, 40}, {20, 90, 160}};
#define COLOURS (sizeof colours / sizeof colours[0])
#define SQUARE 32u

static const uint8_t *colour_at(uint32_t frame, uint32_t x, uint32_t y)
{
    return colours[(x / SQUARE + 3 * (y / SQUARE) + frame) % COLOURS];
}

static struct fl_frame make_frame(uint32_t number, uint32_t width, uint32_t height)
{
    struct fl_frame frame = {.frame = number, .width = width, .height = height, .samples = 1, .fov_y = 1};
    frame.format = PROTOCOL_PIXEL_FORMAT_RGBA8;
    frame.pixels_bytes = (size_t)width * height * 4;
    frame.pixels = malloc(frame.pixels_bytes);
    assert_non_null(frame.pixels);
    for (uint32_t i = 0; i < width * height; i++) {
        memcpy(frame.pixels + 4 * (size_t)i, colour_at(number, i % width, i / width), 3);
        frame.pixels[4 * (size_t)i + 3] = 255;
    }
    return frame;
}

static void write_frames(struct fl_video *video, uint32_t count, uint32_t width, uint32_t height)
{
    for (uint32_t i = 0; i < count; i++) {
        struct fl_frame frame = make_frame(i, width, height);
        const bool written = fl_video_write(video, &frame, &error);
        free(frame.pixels);
        if (!written)
            fail_msg("frame %u: %s: %s", i, error.field, error.text);
    }
}

static void write_video(const struct fl_video_options *options, uint32_t count, uint32_t width, uint32_t height)
{
    error = (struct fl_error){0};
    struct fl_video *video = fl_video_start(options, &error);
    if (video == NULL)
        fail_msg("%s: %s", error.field, error.text);
    write_frames(video, count, width, height);
    if (!fl_video_finish(video, &error))
        fail_msg("%s: %s", error.field, error.text);
    assert_int_equal(fl_video_info(video)->frames, count);
    fl_video_destroy(video);
}

/* ---- reading back ---- */

static char probe_text[4096];

/* Standard output of a program that must succeed; *bytes is malloc'ed. */
static size_t output_of(const char *command, uint8_t **bytes)
{
    size_t count = 0, capacity = 1 << 22;
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    *bytes = malloc(capacity);
    assert_non_null(*bytes);
    for (size_t got = 1; got > 0; count += got) {
        got = fread(*bytes + count, 1, capacity - count, pipe);
        assert_true(count + got < capacity);
    }
    if (pclose(pipe) != 0)
        fail_msg("%s failed", command);
    return count;
}

static void probe(const char *path)
{
    char command[512];
    uint8_t *bytes;
    snprintf(command, sizeof command,
             "ffprobe -v error -count_frames -show_streams -show_format -of default=noprint_wrappers=1 '%s'",
             path);
    const size_t count = output_of(command, &bytes);
    snprintf(probe_text, sizeof probe_text, "\n%.*s", (int)count, (const char *)bytes);
    free(bytes);
}

static void expect(const char *line)
{
    char wanted[128];
    snprintf(wanted, sizeof wanted, "\n%s\n", line);
    if (strstr(probe_text, wanted) == NULL)
        fail_msg("'%s' is not in:%s", line, probe_text);
}

static size_t decode(const char *path, const char *format, uint8_t **bytes)
{
    char command[512];
    snprintf(command, sizeof command, "ffmpeg -v error -i '%s' -f rawvideo -pix_fmt %s -", path, format);
    return output_of(command, bytes);
}

/* ---- tests ---- */

static void an_mp4_holds_every_frame_in_its_colours_and_says_what_it_is(void **state)
{
    (void)state;
    const uint32_t width = 128, height = 96, count = 12;
    need(true);
    write_video(&(struct fl_video_options){.path = path_of("a.mp4"), .frames_per_second = 23.976f}, count, width,
                height);
    probe(video_path);
    static const char *const said[] = {"codec_name=h264",
                                       "width=128",
                                       "height=96",
                                       "pix_fmt=yuv420p",
                                       "color_range=tv",
                                       "color_space=bt709",
                                       "color_primaries=bt709",
                                       "color_transfer=iec61966-2-1",
                                       "chroma_location=left",
                                       "r_frame_rate=24000/1001",
                                       "nb_read_frames=12",
                                       "avg_frame_rate=24000/1001",
                                       "sample_aspect_ratio=1:1"};
    for (size_t i = 0; i < sizeof said / sizeof said[0]; i++)
        expect(said[i]);
    uint8_t *decoded;
    const size_t frame_bytes = (size_t)width * height * 3 / 2;
    assert_int_equal(decode(video_path, "yuv420p", &decoded), count * frame_bytes);
    for (uint32_t frame = 0; frame < count; frame++)
        for (uint32_t i = 0; i < (width / SQUARE) * (height / SQUARE); i++) {
            const uint32_t x = i % (width / SQUARE) * SQUARE + 16, y = i / (width / SQUARE) * SQUARE + 16;
            const uint8_t *rgb = colour_at(frame, x, y), *planes = decoded + frame * frame_bytes;
            const size_t chroma = (size_t)width * height + (size_t)(y / 2) * (width / 2) + x / 2;
            const double luma = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
            const double wanted[3] = {16 + 219 * luma / 255, 128 + 224 * (rgb[2] - luma) / 1.8556 / 255,
                                      128 + 224 * (rgb[0] - luma) / 1.5748 / 255};
            const uint8_t found[3] = {planes[(size_t)y * width + x], planes[chroma],
                                      planes[chroma + (size_t)width * height / 4]};
            /* In the middle of a square of one colour nothing but quantisation is left: at CRF 18 a step or two.
             */
            for (int c = 0; c < 3; c++)
                if (fabs(found[c] - wanted[c]) > 3)
                    fail_msg("frame %u at %u,%u: component %d is %d in place of %.2f", frame, x, y, c, found[c],
                             wanted[c]);
        }
    free(decoded);
    unlink(video_path);
    assert_int_equal(count_files(), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_mp4_holds_every_frame_in_its_colours_and_says_what_it_is),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
