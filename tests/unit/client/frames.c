/* SPDX-License-Identifier: MIT */
/* Which frames of an animation are rendered, and which files are there already. */
#include "lib/frame_set.h"
#include "lib/image_size.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static struct fl_error error;

TEST(a_part_is_written_as_k_of_n)
{
    uint32_t part = 0, parts = 0;
    assert_true(fl_text_shard("3/8", &part, &parts, &error));
    assert_int_equal(part, 3);
    assert_int_equal(parts, 8);
    assert_true(fl_text_shard("1/1", &part, &parts, &error));
    static const char *const bad[] = {
        "",    "/",    "3",    "3/",   "/8",    "0/8",       "9/8",
        "3/0", "-1/8", "3/8 ", " 3/8", "3/8/1", "1/1000001", "00000000000000000001/8"};
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        if (fl_text_shard(bad[i], &part, &parts, &error))
            fail_msg("'%s' was taken", bad[i]);
        assert_true(error.text[0] != '\0' && error.remedy[0] != '\0');
    }
}

typedef bool divide(const struct fl_frame_run *range, uint32_t part, uint32_t parts, struct fl_frame_run *run);

/* Every frame falls to exactly one part, in all parts of all kinds of ranges. */
static void check_parts(divide *part_of, bool is_chunk)
{
    static uint8_t seen[400];
    for (uint32_t step = 1; step <= 5; step++)
        for (uint32_t last = 7; last < 60; last++)
            for (uint32_t parts = 1; parts <= 9; parts++) {
                const struct fl_frame_run range = {.first = 7, .last = last, .step = step};
                uint32_t empty = 0;
                memset(seen, 0, sizeof(seen));
                for (uint32_t part = 1; part <= parts; part++) {
                    struct fl_frame_run run;
                    if (!part_of(&range, part, parts, &run)) {
                        assert_true(is_chunk || part > fl_frame_run_count(&range));
                        empty++;
                        continue;
                    }
                    if (is_chunk && run.first != run.last)
                        assert_int_equal(run.step, step);
                    assert_true(run.step >= 1 && run.first <= run.last);
                    assert_int_equal((run.last - run.first) % run.step, 0);
                    for (uint32_t frame = run.first; frame <= run.last; frame += run.step)
                        seen[frame]++;
                }
                const uint32_t count = fl_frame_run_count(&range);
                assert_int_equal(empty, count < parts ? parts - count : 0);
                for (uint32_t frame = 0; frame < 100; frame++)
                    assert_int_equal(seen[frame], frame >= 7 && frame <= last && (frame - 7) % step == 0);
            }
}

TEST(the_parts_of_a_range_are_the_range)
{
    check_parts(fl_frame_run_shard, false);
    check_parts(fl_frame_run_chunk, true);
}

TEST(a_chunk_has_neighbouring_frames)
{
    const struct fl_frame_run range = {.first = 1, .last = 10, .step = 1};
    struct fl_frame_run run;
    assert_true(fl_frame_run_chunk(&range, 2, 3, &run));
    assert_int_equal(run.first, 4);
    assert_int_equal(run.last, 6);
    assert_int_equal(run.step, 1);
}

TEST(the_maximum_range_does_not_wrap)
{
    const struct fl_frame_run range = {.first = 0, .last = 10000000, .step = 10000000};
    struct fl_frame_run run;
    assert_int_equal(fl_frame_run_count(&range), 2);
    assert_true(fl_frame_run_shard(&range, 2, 1000000, &run));
    assert_int_equal(run.first, 10000000);
    assert_int_equal(run.last, 10000000);
    assert_false(fl_frame_run_shard(&range, 3, 1000000, &run));
    assert_true(fl_frame_run_chunk(&range, 1000000, 1000000, &run));
    assert_int_equal(run.first, 10000000);
}

static bool is_there(void *user, uint32_t frame)
{
    return strchr(user, (char)frame) != NULL;
}

TEST(missing_frames_are_listed_as_ranges)
{
    const struct fl_frame_run range = {.first = 'a', .last = 'k', .step = 2}; /* a c e g i k */
    static const struct {
        const char *there, *runs;
    } cases[] = {{"", "a-k"},       {"acegik", ""},        {"a", "c-k"},    {"k", "a-i"},
                 {"eg", "a-c i-k"}, {"ci", "a-a e-g k-k"}, {"bdfhj", "a-k"}};
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        char told[64] = "";
        char there[16];
        uint32_t count = 0;
        struct fl_frame_set set;
        snprintf(there, sizeof(there), "%s", cases[i].there);
        assert_true(fl_frame_set_missing(&range, is_there, there, &set, &error));
        for (size_t r = 0; r < set.run_count; r++) {
            const size_t used = strlen(told);
            snprintf(told + used, sizeof(told) - used, "%s%c-%c", r > 0 ? " " : "", (char)set.runs[r].first,
                     (char)set.runs[r].last);
            assert_int_equal(set.runs[r].step, 2);
            count += fl_frame_run_count(&set.runs[r]);
        }
        assert_string_equal(told, cases[i].runs);
        assert_int_equal(set.frame_count, count);
        fl_frame_set_finish(&set);
    }
}

/* ---- files ---- */

/* Result of fl_image_size for a file with these bytes, as "WxH", or "" if it is no image. */
static const char *size_of(const void *bytes, size_t count)
{
    static char told[32];
    char path[] = P_tmpdir "/farlight-size-XXXXXX";
    uint32_t width = 0, height = 0;
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, bytes, count), (ssize_t)count);
    close(fd);
    told[0] = '\0';
    if (fl_image_size(path, &width, &height))
        snprintf(told, sizeof(told), "%ux%u", width, height);
    unlink(path);
    return told;
}

/* Smallest files of each kind, 3 pixels wide and 2 high; of pixels only what is looked at. */
static const uint8_t png[] = "\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x03\0\0\0\x02\x08\x02\0\0\0\0\0\0\0"
                             "\0\0\0\0IEND\xae\x42\x60\x82";
static const uint8_t jpeg[] = "\xff\xd8\xff\xe0\0\x04xx\xff\xc0\0\x0b\x08\0\x02\0\x03\x01\x01\x11\0\xff\xd9";
static const uint8_t exr[] = "\x76\x2f\x31\x01\x02\0\0\0"
                             "compression\0compression\0\x01\0\0\0\0"
                             "dataWindow\0box2i\0\x10\0\0\0\0\0\0\0\0\0\0\0\x02\0\0\0\x01\0\0\0"
                             "\0"
                             "\x5b\0\0\0\0\0\0\0\x63\0\0\0\0\0\0\0"    /* where the two lines are */
                             "\0\0\0\0\0\0\0\0\x01\0\0\0\x02\0\0\0zz"; /* line, bytes, bytes of pixels */
static const uint8_t webp[3][30] = {"RIFF\x16\0\0\0WEBPVP8X\x0a\0\0\0\0\0\0\0\x02\0\0\x01\0\0",
                                    "RIFF\x16\0\0\0WEBPVP8L\x0a\0\0\0\x2f\x02\x40\0\0",
                                    "RIFF\x16\0\0\0WEBPVP8 \x0a\0\0\0xxx\x9d\x01\x2a\x03\0\x02\0"};
static const uint8_t gif[] = "GIF89a\x03\0\x02\0\0\0\0;";
/* Strips of 3 bytes each, which end at 14, then the directory: one of numbers of 2 bytes, and a list elsewhere. */
static const uint8_t tiff[] = "II*\0\x0e\0\0\0pixels"
                              "\x04\0"
                              "\0\x01\x03\0\x01\0\0\0\x03\0\0\0"
                              "\x01\x01\x04\0\x01\0\0\0\x02\0\0\0"
                              "\x11\x01\x04\0\x02\0\0\0\x44\0\0\0"
                              "\x17\x01\x03\0\x02\0\0\0\x03\0\x03\0"
                              "\0\0\0\0"
                              "\x08\0\0\0\x0b\0\0\0";
static const uint8_t motorola[] = "MM\0*\0\0\0\x0epixels"
                                  "\0\x04"
                                  "\x01\0\0\x03\0\0\0\x01\0\x03\0\0"
                                  "\x01\x01\0\x04\0\0\0\x01\0\0\0\x02"
                                  "\x01\x11\0\x04\0\0\0\x01\0\0\0\x08"
                                  "\x01\x17\0\x03\0\0\0\x01\0\x06\0\0";
static const char hdr[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 3\nxxxx";

static const struct {
    const void *bytes;
    size_t count;
    bool has_end; /* so that it is seen to be cut short anywhere */
} files[] = {{png, sizeof(png) - 1, true},      {jpeg, sizeof(jpeg) - 1, true},
             {exr, sizeof(exr) - 1, true},      {hdr, sizeof(hdr) - 1, false},
             {webp[0], sizeof(webp[0]), true},  {webp[1], sizeof(webp[1]), false},
             {webp[2], sizeof(webp[2]), false}, {gif, sizeof(gif) - 1, true},
             {tiff, sizeof(tiff) - 1, true},    {motorola, sizeof(motorola) - 1, false}};
#define FILES (sizeof(files) / sizeof(files[0]))

TEST(image_files_tell_their_size_unless_they_are_cut_short)
{
    for (size_t f = 0; f < FILES; f++) {
        assert_string_equal(size_of(files[f].bytes, files[f].count), "3x2");
        for (size_t count = 0; files[f].has_end && count < files[f].count; count++)
            assert_string_equal(size_of(files[f].bytes, count), "");
    }
    uint32_t width = 0, height = 0;
    assert_false(fl_image_size("/nonexistent/0001.png", &width, &height));
    assert_false(fl_image_size("/", &width, &height));
}

/* Each byte of each file changed in a few ways: nothing is read beyond what there is (sanitizers watch). */
TEST(files_of_nonsense_do_no_harm)
{
    static const uint8_t values[] = {0, 1, 0x7f, 0x80, 0xff};
    for (size_t f = 0; f < FILES; f++)
        for (size_t i = 0; i < files[f].count; i++)
            for (size_t v = 0; v < sizeof(values); v++) {
                uint8_t bytes[256];
                memcpy(bytes, files[f].bytes, files[f].count);
                bytes[i] = values[v];
                size_of(bytes, files[f].count);
            }
}
