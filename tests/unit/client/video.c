/* SPDX-License-Identifier: MIT */
/* Videos through the real writer, read back with ffmpeg's own programs: what is in the file, what a player is told
 * about it, and what is left of one that does not come about. */
#include "lib/helper.h"
#include "protocol/pixels/ycbcr.h"
#include "tests/harness/test.h"
#include "protocol/version.h"

#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static struct fl_error error;
static char folder[64], video_path[96];

static bool find_writer(void)
{
    char self[4096], program[4200];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof(self) - 1);
    assert_true(length > 0);
    self[length] = '\0';
    for (int i = 0; i < 3; i++) /* build/CONFIG/tests/unit/test: the programs are in build/CONFIG */
        *strrchr(self, '/') = '\0';
    snprintf(program, sizeof(program), "%s/farlight-video", self);
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
    snprintf(folder, sizeof(folder), "%s/farlight-video-XXXXXX", P_tmpdir);
    return !mkdtemp(folder) ? -1 : 0;
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
    for (const struct dirent *entry = readdir(listing); entry; entry = readdir(listing))
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(listing);
    return count;
}

static const char *path_of(const char *name)
{
    snprintf(video_path, sizeof(video_path), "%s/%s", folder, name);
    return video_path;
}

/* ---- pictures ---- */

/* Squares of 32 pixels; with the frame's number they move on. */
static const uint8_t colours[][3] = {{255, 0, 0}, {0, 255, 0},     {0, 0, 255},    {255, 255, 255},
                                     {0, 0, 0},   {128, 128, 128}, {200, 120, 40}, {20, 90, 160}};
#define COLOURS (sizeof(colours) / sizeof(colours[0]))
#define SQUARE 32u

static const uint8_t *colour_at(uint32_t frame, uint32_t x, uint32_t y)
{
    return colours[(x / SQUARE + 3 * (y / SQUARE) + frame) % COLOURS];
}

static struct fl_frame make_frame(uint32_t number, uint32_t width, uint32_t height)
{
    struct fl_frame frame = {
        .frame = number, .width = width, .height = height, .samples = 1, .layers = 1, .fov_y = 1};
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

static struct fl_video *begin_video(const struct fl_video_options *options)
{
    error = (struct fl_error){0};
    struct fl_video *video = fl_video_start(options, &error);
    if (!video)
        fail_msg("%s: %s", error.field, error.text);
    return video;
}

static void write_video(const struct fl_video_options *options, uint32_t count, uint32_t width, uint32_t height)
{
    struct fl_video *video = begin_video(options);
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
    snprintf(command, sizeof(command),
             "ffprobe -v error -count_frames -show_streams -show_format -of default=noprint_wrappers=1 '%s'",
             path);
    const size_t count = output_of(command, &bytes);
    snprintf(probe_text, sizeof(probe_text), "\n%.*s", (int)count, (const char *)bytes);
    free(bytes);
}

static void expect(const char *line)
{
    char wanted[128];
    snprintf(wanted, sizeof(wanted), "\n%s\n", line);
    if (!strstr(probe_text, wanted))
        fail_msg("'%s' is not in:%s", line, probe_text);
}

static size_t decode(const char *path, const char *format, uint8_t **bytes)
{
    char command[512];
    snprintf(command, sizeof(command), "ffmpeg -v error -i '%s' -f rawvideo -pix_fmt %s -", path, format);
    return output_of(command, bytes);
}

/* ---- tests ---- */

ALL_TESTS(make_folder, remove_folder)

TEST(an_mp4_holds_every_frame_in_its_colours_and_says_what_it_is)
{
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
    for (size_t i = 0; i < sizeof(said) / sizeof(said[0]); i++)
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

static const uint8_t *find_bytes(const uint8_t *bytes, size_t count, const char *word)
{
    return memmem(bytes, count, word, strlen(word));
}

static size_t read_file(const char *path, uint8_t **bytes)
{
    char command[160];
    snprintf(command, sizeof(command), "cat '%s'", path);
    return output_of(command, bytes);
}

TEST(an_mp4_has_its_index_in_front_and_names_the_program)
{
    uint8_t *bytes;
    need(false);
    write_video(&(struct fl_video_options){.path = path_of("a.mp4"), .model = "teapot.glb"}, 3, 64, 64);
    const size_t count = read_file(video_path, &bytes);
    const uint8_t *index = find_bytes(bytes, count, "moov"), *data = find_bytes(bytes, count, "mdat");
    assert_non_null(index);
    assert_non_null(data);
    assert_true(index < data);
    assert_non_null(find_bytes(bytes, count, "farlight " FARLIGHT_VERSION ": teapot.glb"));
    free(bytes);
    unlink(video_path);
}

TEST(the_same_frames_make_the_same_file)
{
    static const struct fl_video_options kinds[] = {{.format = "mp4"},
                                                    {.format = "mkv"},
                                                    {.format = "mkv", .lossless = true},
                                                    {.format = "mp4", .codec = "mpeg4"},
                                                    {.format = "webp"},
                                                    {.format = "gif"}};
    need(false);
    for (size_t i = 0; i < sizeof(kinds) / sizeof(kinds[0]); i++) {
        uint8_t *bytes[2];
        size_t counts[2];
        for (int run = 0; run < 2; run++) {
            struct fl_video_options options = kinds[i];
            options.path = path_of("a");
            write_video(&options, 30, 160, 96);
            counts[run] = read_file(video_path, &bytes[run]);
            unlink(video_path);
        }
        assert_int_equal(counts[0], counts[1]);
        assert_memory_equal(bytes[0], bytes[1], counts[0]);
        free(bytes[0]);
        free(bytes[1]);
    }
}

TEST(a_lossless_video_gives_every_pixel_back)
{
    static const uint32_t sizes[][2] = {{96, 64}, {65, 67}, {1, 1}, {2, 300}, {200, 2}, {7, 300}};
    uint32_t noise = 1;
    need(true);
    for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
        const uint32_t width = sizes[i][0], height = sizes[i][1];
        struct ycbcr_converter converter;
        struct fl_video *video =
            begin_video(&(struct fl_video_options){.path = path_of("a.mkv"), .lossless = true});
        assert_string_equal(fl_video_info(video)->encoder, "ffv1");
        struct fl_frame frames[2] = {make_frame(0, width, height), make_frame(1, width, height)};
        for (size_t at = 0; at < frames[1].pixels_bytes; at++) { /* alpha too: over black */
            noise = noise * 1664525u + 1013904223u;
            frames[1].pixels[at] = (uint8_t)(noise >> 24);
        }
        for (int n = 0; n < 2; n++)
            assert_true(fl_video_write(video, &frames[n], &error));
        if (!fl_video_finish(video, &error))
            fail_msg("%ux%u: %s", width, height, error.text);
        assert_int_equal(fl_video_info(video)->width, width);
        assert_int_equal(fl_video_info(video)->height, height);
        fl_video_destroy(video);
        uint8_t *decoded;
        assert_int_equal(decode(video_path, "rgb24", &decoded), (size_t)2 * width * height * 3);
        assert_true(ycbcr_converter_init(&converter, width, height, YCBCR_ALPHA_OVER_BLACK));
        for (uint32_t row = 0; row < 2 * height; row++)
            assert_memory_equal(decoded + (size_t)row * width * 3,
                                ycbcr_opaque_row(&converter, frames[row / height].pixels, row % height),
                                (size_t)width * 3);
        ycbcr_converter_finish(&converter);
        probe(video_path);
        expect("codec_name=ffv1");
        expect("color_transfer=iec61966-2-1");
        expect("color_primaries=bt709");
        free(decoded);
        free(frames[0].pixels);
        free(frames[1].pixels);
        unlink(video_path);
    }
}

TEST(an_odd_picture_repeats_its_last_column_and_row)
{
    const uint32_t width = 65, height = 33;
    need(true);
    struct fl_video *video = begin_video(&(struct fl_video_options){.path = path_of("a.mkv"), .quality = 1});
    write_frames(video, 2, width, height);
    assert_true(fl_video_finish(video, &error));
    assert_int_equal(fl_video_info(video)->width, 66);
    assert_int_equal(fl_video_info(video)->height, 34);
    fl_video_destroy(video);
    probe(video_path);
    expect("width=66");
    expect("height=34");
    expect("codec_name=h264");
    uint8_t *decoded;
    assert_int_equal(decode(video_path, "yuv420p", &decoded), 2 * 66 * 34 * 3 / 2);
    /* The column that was added is as the one before, but for the encoder's rounding at its best quality. */
    for (uint32_t y = 0; y < 34; y++)
        assert_in_range(decoded[y * 66 + 65] - decoded[y * 66 + 64] + 4, 0, 8);
    for (uint32_t x = 0; x < 66; x++)
        assert_in_range(decoded[33 * 66 + x] - decoded[32 * 66 + x] + 4, 0, 8);
    free(decoded);
    unlink(video_path);
}

TEST(mpeg4_is_available_on_request)
{
    uint8_t *decoded;
    need(true);
    write_video(&(struct fl_video_options){.path = path_of("a.mp4"), .codec = "mpeg4", .frames_per_second = 25}, 5,
                64, 64);
    probe(video_path);
    expect("codec_name=mpeg4");
    expect("r_frame_rate=25/1");
    expect("nb_read_frames=5");
    assert_int_equal(decode(video_path, "yuv420p", &decoded), 5 * 64 * 64 * 3 / 2);
    for (uint32_t i = 0; i < 4;
         i++) { /* luma in the squares' middle; 6: at this quality a scale of 3, steps of 6 */
        const uint32_t x = i % 2 * 32 + 16, y = i / 2 * 32 + 16;
        const uint8_t *rgb = colour_at(0, x, y);
        const double wanted = 16 + 219 * (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]) / 255;
        if (fabs(decoded[y * 64 + x] - wanted) > 6)
            fail_msg("%d in place of %f", decoded[y * 64 + x], wanted);
    }
    free(decoded);
    unlink(video_path);
}

TEST(lower_quality_makes_smaller_files)
{
    uint64_t before = UINT64_MAX;
    need(false);
    for (unsigned quality = 10; quality <= 40; quality += 15) {
        struct fl_video *video =
            begin_video(&(struct fl_video_options){.path = path_of("a.mp4"), .quality = quality});
        struct fl_frame frame = make_frame(0, 256, 256);
        uint32_t noise = 1;
        for (size_t i = 0; i < frame.pixels_bytes; i++) {
            noise = noise * 1664525u + 1013904223u;
            frame.pixels[i] |= (uint8_t)(noise >> 26);
        }
        assert_true(fl_video_write(video, &frame, &error));
        assert_true(fl_video_finish(video, &error));
        assert_true(fl_video_info(video)->size_bytes < before);
        before = fl_video_info(video)->size_bytes;
        fl_video_destroy(video);
        free(frame.pixels);
        unlink(video_path);
    }
}

/* ---- videos that do not come about ---- */

TEST(an_unwritable_output_is_reported_before_the_first_frame)
{
    static const struct {
        const char *name;
        struct fl_video_options options;
        const char *text, *remedy, *field; /* NULL: the path */
    } rows[] = {
        {"missing/a.mp4", {0}, "No such file", "", NULL},
        {"", {.format = "mp4"}, "Is a directory", "", NULL},
        {"a.avi", {0}, "the ending belongs to no supported video format", ".mp4, .mkv, .webp or .gif", NULL},
        {"a.mp4", {.lossless = true}, "an MP4 file cannot contain FFV1", ".mkv", NULL},
        {"a.mkv", {.lossless = true, .codec = "h264"}, "h264 is not lossless, which is asked", "leave", NULL},
        {"a.mkv", {.codec = "ffv1"}, "ffv1 is lossless, which is not asked for", "ask for lossless", NULL},
        {"a.mp4", {.codec = "h264_v4l2m2m"}, "is not a codec that can be written", "h264, mpeg4", NULL},
        {"a.mp4", {.frames_per_second = 2000}, "not within 0.001 .. 1000", "", "frames_per_second"},
        {"a.mp4", {.quality = 52}, "1 (best) to 51", "", NULL},
        {"a.webp", {.quality = 101}, "not within 0 .. 100", "", "quality"},
        {"a.webp", {.codec = "h264"}, "written in one way only", "leave", NULL},
        {"a.gif", {.lossless = true}, "a GIF file has 256 colours", ".webp", NULL},
        {"\xff.mp4", {0}, "no UTF-8", "", "path"}};
    need(false);
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        struct fl_video_options options = rows[i].options;
        options.path = path_of(rows[i].name);
        error = (struct fl_error){0};
        if (fl_video_start(&options, &error))
            fail_msg("%s was begun", video_path);
        assert_int_equal(error.code, !rows[i].field ? FL_ERROR_FILE : FL_ERROR_ARGUMENT);
        assert_string_equal(error.field, !rows[i].field ? video_path : rows[i].field);
        if (!strstr(error.text, rows[i].text) || !strstr(error.remedy, rows[i].remedy))
            fail_msg("%s: %s (%s)", error.field, error.text, error.remedy);
        assert_int_equal(count_files(), 0);
    }
}

TEST(the_smallest_picture_makes_a_video)
{
    static const char *const codecs[] = {"h264", "mpeg4"};
    uint8_t *decoded;
    need(true);
    for (size_t i = 0; i < 2; i++) {
        write_video(&(struct fl_video_options){.path = path_of("a.mp4"), .codec = codecs[i]}, 2, 1, 1);
        assert_int_equal(decode(video_path, "yuv420p", &decoded), 2 * 2 * 2 * 3 / 2);
        free(decoded);
        unlink(video_path);
    }
}

TEST(a_frame_that_does_not_fit_ends_the_video_and_nothing_is_left)
{
    static const struct {
        uint32_t first[2], second[2];
        enum protocol_pixel_format format;
        const char *text, *remedy;
    } rows[] = {{{64, 64}, {64, 32}, PROTOCOL_PIXEL_FORMAT_RGBA8, "64x32 pixels, but the video has 64x64", "size"},
                {{64, 64}, {64, 64}, PROTOCOL_PIXEL_FORMAT_RGBA16F, "rgba16f pixels", "rgba8"},
                {{0, 0},
                 {8192, 4368},
                 PROTOCOL_PIXEL_FORMAT_RGBA8,
                 "H.264 cannot encode pictures of 8192x4368",
                 "smaller"}};
    need(false);
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        struct fl_video *video = begin_video(&(struct fl_video_options){.path = path_of("a.mp4")});
        if (rows[i].first[0] > 0)
            write_frames(video, 1, rows[i].first[0], rows[i].first[1]);
        struct fl_frame frame = {
            .frame = 7, .width = rows[i].second[0], .height = rows[i].second[1], .samples = 1, .layers = 1};
        frame.format = rows[i].format;
        frame.pixels_bytes = (size_t)frame.width * frame.height * fl_bytes_per_pixel(frame.format);
        frame.pixels = calloc(1, frame.pixels_bytes);
        assert_non_null(frame.pixels);
        error = (struct fl_error){0};
        assert_true(fl_video_write(video, &frame, &error));
        assert_false(fl_video_finish(video, &error));
        assert_int_equal(error.code, FL_ERROR_FILE);
        if (!strstr(error.text, rows[i].text) || !strstr(error.remedy, rows[i].remedy))
            fail_msg("%s: %s (%s)", error.field, error.text, error.remedy);
        assert_int_equal(count_files(), 0);
        assert_false(fl_video_write(video, &frame, &error));
        assert_int_equal(error.code, FL_ERROR_ARGUMENT);
        fl_video_destroy(video);
        free(frame.pixels);
    }
}

TEST(a_video_without_frames_is_refused)
{
    need(false);
    struct fl_video *video = begin_video(&(struct fl_video_options){.path = path_of("a.mkv")});
    assert_false(fl_video_finish(video, &error));
    assert_non_null(strstr(error.text, "a video needs at least one frame"));
    assert_non_null(strstr(error.remedy, "at least one"));
    fl_video_destroy(video);
    assert_int_equal(count_files(), 0);
}

TEST(an_unfinished_video_leaves_nothing_and_keeps_the_old_file)
{
    uint8_t *bytes;
    need(false);
    FILE *old = fopen(path_of("a.mp4"), "w");
    assert_non_null(old);
    fputs("old", old);
    fclose(old);
    struct fl_video *video = begin_video(&(struct fl_video_options){.path = video_path});
    write_frames(video, 3, 64, 64);
    assert_int_equal(count_files(), 2);
    fl_video_destroy(video);
    assert_int_equal(count_files(), 1);
    assert_int_equal(read_file(video_path, &bytes), 3);
    assert_memory_equal(bytes, "old", 3);
    free(bytes);
    unlink(video_path);
}

/* The writer's process: our only child. 0: this kernel does not say. */
static pid_t find_child(void)
{
    char path[64];
    int child = 0;
    snprintf(path, sizeof(path), "/proc/self/task/%d/children", (int)getpid());
    FILE *file = fopen(path, "r");
    if (file) {
        if (fscanf(file, "%d", &child) != 1)
            child = 0;
        fclose(file);
    }
    return child;
}

TEST(a_killed_writer_is_reported_and_leaves_no_file)
{
    static const int numbers[] = {SIGTERM, SIGKILL};
    need(false);
    for (size_t i = 0; i < 2; i++) {
        struct fl_video *video = begin_video(&(struct fl_video_options){.path = path_of("a.mkv")});
        write_frames(video, 3, 64, 64);
        const pid_t child = find_child();
        if (child == 0) {
            fl_video_destroy(video);
            print_message("skipped: this kernel does not name children\n");
            skip();
        }
        kill(child, numbers[i]);
        error = (struct fl_error){0};
        assert_false(fl_video_finish(video, &error));
        assert_int_equal(error.code, FL_ERROR_SYSTEM);
        assert_non_null(strstr(error.text, "the video writer failed: farlight-video"));
        fl_video_destroy(video);
        assert_int_equal(count_files(), 0);
    }
}

TEST(a_full_disk_is_reported_and_no_file_is_left)
{
    struct rlimit saved, small;
    need(false);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &saved), 0);
    small = (struct rlimit){.rlim_cur = 4096, .rlim_max = saved.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small); /* inherited by the writer */
    struct fl_video *video =
        fl_video_start(&(struct fl_video_options){.path = path_of("a.mkv"), .lossless = true}, &error);
    setrlimit(RLIMIT_FSIZE, &saved);
    assert_non_null(video);
    struct fl_frame frame = make_frame(0, 256, 256);
    uint32_t noise = 1;
    for (size_t i = 0; i < frame.pixels_bytes; i++) { /* does not compress */
        noise = noise * 1664525u + 1013904223u;
        frame.pixels[i] = i % 4 == 3 ? 255 : (uint8_t)(noise >> 24);
    }
    bool good = true;
    for (int i = 0; i < 4 && good; i++)
        good = fl_video_write(video, &frame, &error);
    assert_false(good && fl_video_finish(video, &error));
    assert_int_equal(error.code, FL_ERROR_FILE);
    assert_string_equal(error.field, video_path);
    assert_non_null(strstr(error.text, "cannot be written: File too large"));
    assert_int_equal(count_files(), 0);
    fl_video_destroy(video);
    free(frame.pixels);
}

TEST(an_interrupted_video_can_be_finished_with_the_frames_so_far)
{
    int interrupt[2];
    uint32_t written = 0;
    need(true);
    assert_int_equal(pipe(interrupt), 0);
    struct fl_video *video = begin_video(
        &(struct fl_video_options){.path = path_of("a.mkv"), .lossless = true, .interrupt_fd = interrupt[0]});
    const struct fl_frame frame = make_frame(0, 1024, 1024); /* far more than a socket holds */
    assert_true(fl_video_write(video, &frame, &error));
    assert_int_equal(write(interrupt[1], "x", 1), 1);
    error = (struct fl_error){0};
    for (written = 1; written < 100 && fl_video_write(video, &frame, &error);)
        written++;
    assert_int_equal(error.code, FL_ERROR_INTERRUPTED);
    assert_false(fl_video_finish(video, &error));
    assert_int_equal(error.code, FL_ERROR_INTERRUPTED);
    fl_video_set_interrupt(video, 0);
    if (!fl_video_finish(video, &error))
        fail_msg("%s", error.text);
    /* The one on the way is kept where all of it was handed over already. */
    assert_in_range(fl_video_info(video)->frames, written, written + 1);
    assert_false(fl_video_finish(video, &error));
    assert_false(fl_video_write(video, &frame, &error));
    assert_int_equal(error.code, FL_ERROR_ARGUMENT);
    char line[64];
    snprintf(line, sizeof(line), "nb_read_frames=%u", fl_video_info(video)->frames);
    fl_video_destroy(video);
    probe(video_path);
    expect(line);
    free(frame.pixels);
    unlink(video_path);
    close(interrupt[0]);
    close(interrupt[1]);
}

/* ---- what no library would say to it ---- */

static void start_writer(struct fl_helper *writer)
{
    const char *const arguments[] = {"--folder", folder, NULL};
    *writer = (struct fl_helper){.program = "farlight-video", .what = "the video writer", .request = 5};
    if (!fl_helper_start(writer, arguments, &error))
        fail_msg("%s", error.text);
}

static void send(struct fl_helper *writer, const struct message *message)
{
    assert_true(fl_helper_send(writer, message, &error) && fl_helper_flush(writer, &error));
}

static void send_begin(struct fl_helper *writer, const char *path)
{
    struct message message = {.type = MESSAGE_VIDEO_BEGIN};
    message.video_begin.frames_per_second = 24;
    message.video_begin.path = path;
    message.video_begin.format = message.video_begin.codec = message.video_begin.model = "";
    send(writer, &message);
}

static void send_frame_begin(struct fl_helper *writer, uint32_t edge)
{
    struct message message = {.type = MESSAGE_FRAME_BEGIN};
    message.frame_begin.width = message.frame_begin.height = edge;
    message.frame_begin.samples = 1;
    message.frame_begin.layers = 1;
    message.frame_begin.size_bytes = (uint64_t)edge * edge * 4;
    send(writer, &message);
}

static void send_data(struct fl_helper *writer, uint64_t offset, uint32_t count)
{
    static uint8_t pixels[65536];
    struct message message = {.type = MESSAGE_FRAME_DATA};
    message.frame_data.offset_bytes = offset;
    message.frame_data.data = pixels;
    message.frame_data.data_bytes = count;
    send(writer, &message);
}

static void send_end(struct fl_helper *writer, uint32_t frames)
{
    struct message message = {.type = MESSAGE_VIDEO_END};
    message.video_end.frames = frames;
    send(writer, &message);
}

static void expect_answer(struct fl_helper *writer, enum message_type type, const char *text)
{
    struct message message;
    error = (struct fl_error){0};
    if (!fl_helper_receive(writer, &message, &error))
        fail_msg("%s", error.text);
    if (message.type != type)
        fail_msg("%s in place of %s", message_type_text(message.type), message_type_text(type));
    if (type == MESSAGE_ERROR && !strstr(message.error.text, text))
        fail_msg("'%s' in place of '%s'", message.error.text, text);
    assert_true(type != MESSAGE_ERROR || message.error.field[0] != '\0');
}

TEST(truncated_frames_and_wrong_counts_are_answered_and_the_next_video_works)
{
    struct fl_helper writer;
    const struct message frame_end = {.type = MESSAGE_FRAME_END};
    need(false);
    start_writer(&writer);
    send_begin(&writer, path_of("a.mkv"));
    expect_answer(&writer, MESSAGE_VIDEO_BEGUN, "");
    send_frame_begin(&writer, 64);
    send_data(&writer, 0, 100);
    send(&writer, &frame_end);
    expect_answer(&writer, MESSAGE_ERROR, "ended after 100 of 16384 bytes");
    assert_int_equal(count_files(), 0);
    /* Messages that were on the way are received and dropped, without another answer. */
    send_frame_begin(&writer, 64);
    send_data(&writer, 0, 16384);
    send(&writer, &frame_end);
    send_end(&writer, 1);
    writer.request++;
    send_begin(&writer, video_path);
    expect_answer(&writer, MESSAGE_VIDEO_BEGUN, "");
    send_frame_begin(&writer, 64);
    send_data(&writer, 0, 16384);
    send(&writer, &frame_end);
    send_end(&writer, 2);
    expect_answer(&writer, MESSAGE_ERROR, "2 frames were announced, but 1 came");
    assert_int_equal(count_files(), 0);
    writer.request++;
    send_begin(&writer, video_path);
    expect_answer(&writer, MESSAGE_VIDEO_BEGUN, "");
    send_frame_begin(&writer, 64);
    send_data(&writer, 0, 16384);
    send(&writer, &frame_end);
    send_end(&writer, 1);
    expect_answer(&writer, MESSAGE_VIDEO_WRITTEN, "");
    fl_helper_finish(&writer);
    unlink(video_path);
    assert_int_equal(count_files(), 0);
}

TEST(nothing_can_be_written_outside_the_folder)
{
    struct fl_helper writer;
    char path[96];
    need(false);
    snprintf(path, sizeof(path), "%s.mkv", folder);
    start_writer(&writer);
    send_begin(&writer, path);
    expect_answer(&writer, MESSAGE_ERROR, "Permission denied");
    fl_helper_finish(&writer);
}

TEST(a_client_that_breaks_the_protocol_is_left_with_a_line_and_no_file)
{
    need(false);
    for (int kind = 0; kind < 7; kind++) {
        struct fl_helper writer;
        struct message message;
        start_writer(&writer);
        if (kind != 0) {
            send_begin(&writer, path_of("a.mkv"));
            expect_answer(&writer, MESSAGE_VIDEO_BEGUN, "");
        }
        switch (kind) {
        case 0: /* a frame of no video */
        case 1: /* a frame within a frame */
            send_frame_begin(&writer, 64);
            send_frame_begin(&writer, 64);
            break;
        case 2: /* bytes beyond the frame's */
            send_frame_begin(&writer, 64);
            send_data(&writer, 0, 16385);
            break;
        case 3: /* a gap */
            send_frame_begin(&writer, 64);
            send_data(&writer, 4, 4);
            break;
        case 4: /* a second video */
            send_begin(&writer, video_path);
            break;
        case 5: /* another request's frame */
            writer.request++;
            send_frame_begin(&writer, 64);
            break;
        case 6: /* another size than that of its pixels */
            message = (struct message){.type = MESSAGE_FRAME_BEGIN};
            message.frame_begin.width = message.frame_begin.height = message.frame_begin.samples =
                message.frame_begin.layers = 1;
            message.frame_begin.size_bytes = 400000000;
            send(&writer, &message);
            break;
        default:
            break;
        }
        error = (struct fl_error){0};
        assert_false(fl_helper_receive(&writer, &message, &error));
        if (!strstr(error.text, "farlight-video ended with status 1") ||
            !strstr(error.text, "is not allowed here"))
            fail_msg("%d: %s", kind, error.text);
        fl_helper_finish(&writer);
        assert_int_equal(count_files(), 0);
    }
}
