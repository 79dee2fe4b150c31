/* SPDX-License-Identifier: MIT */
/* Numbers, vectors and patterns from text. */
#include "lib/text.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

static struct fl_error error;

TEST(a_size_is_read)
{
    uint32_t width = 0, height = 0;
    assert_true(fl_text_size("1280x720", &width, &height, &error));
    assert_int_equal(width, 1280);
    assert_int_equal(height, 720);
    assert_true(fl_text_size("8192X1", &width, &height, &error));
    assert_int_equal(width, 8192);
    assert_int_equal(height, 1);
}

TEST(impossible_sizes_are_refused_and_leave_the_result_alone)
{
    static const char *const wrong[] = {
        "",        "x",    "1280",      "1280x",      "x720", "0x5",   "5x0",  "8193x1",
        "1x8193",  "-1x5", "1280x720x", "1280 x 720", "+1x1", "1.5x2", "1x1 ", "99999999999999999999x1",
        "0x10x10", "١x١"};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        uint32_t width = 7, height = 9;
        error = (struct fl_error){0};
        if (fl_text_size(wrong[i], &width, &height, &error))
            fail_msg("'%s' was taken as %ux%u", wrong[i], width, height);
        assert_int_equal(error.code, FL_ERROR_ARGUMENT);
        assert_int_equal(width, 7);
        assert_int_equal(height, 9);
    }
}

TEST(a_vector_is_three_finite_numbers)
{
    float vector[3] = {0};
    assert_true(fl_text_vector("-1,2.5,1e3", vector, &error));
    assert_true(vector[0] == -1 && vector[1] == 2.5f && vector[2] == 1000);
    static const char *const wrong[] = {"",       "1,2",   "1,2,3,4",  "1,2,nan", "inf,0,0", "1,,3", "1,2,3 ",
                                        " 1,2,3", "1;2;3", "1,2,1e40", "0x1,0,0", "1,2,",    ",,",   "1,2,3x"};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++)
        if (fl_text_vector(wrong[i], vector, &error))
            fail_msg("'%s' was taken as %g,%g,%g", wrong[i], (double)vector[0], (double)vector[1],
                     (double)vector[2]);
    assert_true(vector[0] == -1 && vector[1] == 2.5f && vector[2] == 1000);
}

TEST(a_duration_is_seconds_minutes_or_hours)
{
    static const struct {
        const char *text;
        double seconds;
    } good[] = {{"0", 0}, {"90", 90}, {"1.5s", 1.5}, {"5m", 300}, {"2h", 7200}, {".5m", 30}};
    static const char *const wrong[] = {"",    "s",   "5d", "5 m",   "-1",   "1e3",
                                        "5mm", "nan", "3h", "10801", "1..2", "m5"};
    double seconds = -1;
    for (size_t i = 0; i < sizeof(good) / sizeof(good[0]); i++) {
        assert_true(fl_text_duration(good[i].text, 10800 - 1, &seconds, &error));
        assert_true(seconds == good[i].seconds);
    }
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++)
        if (fl_text_duration(wrong[i], 10800 - 1, &seconds, &error))
            fail_msg("'%s' was read as %g", wrong[i], seconds);
    assert_int_equal(error.code, FL_ERROR_ARGUMENT);
    assert_true(seconds == 30);
}

TEST(numbers_keep_to_their_bounds)
{
    uint64_t whole = 0;
    double real = 0;
    assert_true(fl_text_integer("18446744073709551615", 0, UINT64_MAX, &whole, &error));
    assert_true(whole == UINT64_MAX);
    assert_false(fl_text_integer("18446744073709551616", 0, UINT64_MAX, &whole, &error));
    assert_false(fl_text_integer("4", 5, 9, &whole, &error));
    assert_false(fl_text_integer("10", 5, 9, &whole, &error));
    assert_false(fl_text_integer("-5", 0, 9, &whole, &error));
    assert_false(fl_text_integer("", 0, 9, &whole, &error));
    assert_true(fl_text_real("-1.5e0", -2, 2, &real, &error));
    assert_true(real == -1.5);
    assert_false(fl_text_real("nan", -2, 2, &real, &error));
    assert_false(fl_text_real("2.1", -2, 2, &real, &error));
    assert_false(fl_text_real("1e999", 0, 1e300, &real, &error));
    assert_false(fl_text_real("1,5", -2, 2, &real, &error));
}

TEST(a_range_of_frames_is_read)
{
    uint32_t first = 0, last = 0, step = 0;
    assert_true(fl_text_range("1-120", &first, &last, &step, &error));
    assert_true(first == 1 && last == 120 && step == 1);
    assert_true(fl_text_range("0-9:3", &first, &last, &step, &error));
    assert_true(first == 0 && last == 9 && step == 3);
    assert_true(fl_text_range("42", &first, &last, &step, &error));
    assert_true(first == 42 && last == 42 && step == 1);
    static const char *const wrong[] = {
        "",     "-",    "1-",         "-5",      "5-1", "1-5:", "1:2",  "1-5:0",
        "1-5x", "1--5", "1-10000001", "1-5:2:1", "a-b", " 1-5", "1 -5", "4294967296"};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++)
        if (fl_text_range(wrong[i], &first, &last, &step, &error))
            fail_msg("'%s' was taken as %u-%u:%u", wrong[i], first, last, step);
    assert_true(first == 42 && last == 42 && step == 1);
}

static void check_path(const char *text, uint32_t frame, const char *expected)
{
    struct fl_pattern pattern;
    char path[5000];
    error = (struct fl_error){0};
    if (!fl_pattern_parse(text, &pattern, &error))
        fail_msg("'%s' was refused: %s", text, error.text);
    assert_true(fl_pattern_path(&pattern, frame, path, sizeof(path)));
    assert_string_equal(path, expected);
}

TEST(a_pattern_places_the_frame_number)
{
    check_path("frames/%04d.exr", 7, "frames/0007.exr");
    check_path("frames/%04d.exr", 12345, "frames/12345.exr");
    check_path("a%d.png", 0, "a0.png");
    check_path("100%%/%02d%%.png", 3, "100%/03%.png");
    check_path("%09d", 1, "000000001");
}

TEST(what_printf_would_make_of_a_pattern_is_refused)
{
    static const char *const wrong[] = {"a.png",     "%s.png",   "%n",      "%4d.png",   "%00d.png",
                                        "%010d.png", "%",        "a%",      "%0d.png",   "%d%d.png",
                                        "%d/a.png",  "%-4d.png", "%ld.png", "%*d",       "%1$d.png",
                                        "%x.png",    "%05i.png", "%%.png",  "%%04d.png", ""};
    struct fl_pattern pattern;
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        error = (struct fl_error){0};
        if (fl_pattern_parse(wrong[i], &pattern, &error))
            fail_msg("'%s' was taken", wrong[i]);
        assert_int_equal(error.code, FL_ERROR_ARGUMENT);
    }
}

TEST(a_pattern_that_is_too_long_is_refused)
{
    static char text[9000];
    struct fl_pattern pattern;
    memset(text, 'a', sizeof(text) - 1);
    memcpy(text, "%d", 2);
    assert_false(fl_pattern_parse(text, &pattern, &error));
    memset(text, 'a', 8000);
    strcpy(text + 8000, "%d");
    assert_false(fl_pattern_parse(text, &pattern, &error));
    strcpy(text, "abc%04d.png");
    char path[10];
    assert_true(fl_pattern_parse(text, &pattern, &error));
    assert_false(fl_pattern_path(&pattern, 1, path, sizeof(path)));
}

TEST(names_are_made_utf8_without_cutting_a_character)
{
    char out[9];
    fl_text_utf8("plain", out, sizeof(out));
    assert_string_equal(out, "plain");
    fl_text_utf8("a\xff\xc3(\x80", out, sizeof(out));
    assert_string_equal(out, "a?"
                             "?(?");
    fl_text_utf8("1234567\xc3\xa4", out, sizeof(out));
    assert_string_equal(out, "1234567");
    fl_text_utf8("\xed\xa0\x80\xf4\x90\x80\x80", out, sizeof(out));
    assert_string_equal(out, "???????");
    fl_text_utf8("\xe2\x82", out, sizeof(out));
    assert_string_equal(out, "?"
                             "?");
}

TEST(an_error_carries_nothing_that_a_terminal_obeys)
{
    char line[64];
    fl_error_set(&error, FL_ERROR_FILE,
                 "a\xc2\x9b"
                 "2Jb",
                 "a\xe2\x80\xaegpj.exe and \xc3\xa4");
    fl_error_print(&error, line, sizeof(line));
    assert_string_equal(line, "a?2Jb: a?gpj.exe and \xc3\xa4");
}

TEST(an_error_never_carries_an_escape_sequence)
{
    char line[64];
    fl_error_set(&error, FL_ERROR_FILE, "a\033[2Jb", "bad\nthing");
    fl_error_remedy(&error, "do\tthis");
    fl_error_print(&error, line, sizeof(line));
    assert_string_equal(line, "a?[2Jb: bad?thing (do?this)");
    fl_error_print(&error, line, 8);
    assert_string_equal(line, "a?[2Jb:");
}
