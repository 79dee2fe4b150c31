/* SPDX-License-Identifier: MIT */
/* Where a value stands in a JSON file. */
#include "lib/json_text.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static struct fl_error error;
static struct fl_json json;

static bool load(const char *text, size_t length, size_t max_bytes)
{
    char path[] = P_tmpdir "/farlight-json-XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, text, length), (ssize_t)length);
    close(fd);
    error = (struct fl_error){0};
    const bool loaded = fl_json_load(&json, path, max_bytes, &error);
    unlink(path);
    return loaded;
}

TEST(places_are_found_line_by_line)
{
    static const char text[] = "{\n"                                             /* 1 */
                               "  \"a\": {\"b\": [1, 2,\n"                       /* 2 */
                               "    3], \"c\\u0064\": \"} ] , \\\" \\\\\",\n"    /* 3: the key is "cd" */
                               "    \"e\":\n"                                    /* 4 */
                               "      {\"f\": null}},\n"                         /* 5 */
                               "  \"list\": [{\"x\": 1}, {\"x\": [[0], [1]]},\n" /* 6 */
                               "\n"                                              /* 7 */
                               "    {\"x\": 3}], \"b\": 4\n"                     /* 8 */
                               "}\n";
    assert_true(load(text, sizeof(text) - 1, 4096));
    const struct fl_json_place a = {.key = "a"}, b = {.outer = &a, .key = "b"}, second = {.outer = &b, .index = 1},
                               third = {.outer = &b, .index = 2}, cd = {.outer = &a, .key = "cd"},
                               e = {.outer = &a, .key = "e"}, f = {.outer = &e, .key = "f"},
                               list = {.key = "list"}, entry = {.outer = &list, .index = 2},
                               x = {.outer = &entry, .key = "x"}, outer_b = {.key = "b"};
    const struct {
        const struct fl_json_place *place;
        unsigned line;
        const char *path;
    } cases[] = {
        {NULL, 1, ""},         {&a, 2, "a"},           {&b, 2, "a.b"},       {&second, 2, "a.b[1]"},
        {&third, 3, "a.b[2]"}, {&cd, 3, "a.cd"},       {&e, 4, "a.e"},       {&f, 5, "a.e.f"},
        {&list, 6, "list"},    {&entry, 8, "list[2]"}, {&x, 8, "list[2].x"}, {&outer_b, 8, "b"},
    };
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        char path[64];
        fl_json_path(cases[i].place, path, sizeof(path));
        assert_string_equal(path, cases[i].path);
        if (fl_json_line(&json, cases[i].place) != cases[i].line)
            fail_msg("%s is said to be in line %u", cases[i].path, fl_json_line(&json, cases[i].place));
    }
    fl_json_finish(&json);
}

TEST(what_is_missing_has_the_line_of_what_is_around_it)
{
    static const char text[] = "\n[\n{\"a\": 1},\n{\"b\": []}]";
    assert_true(load(text, sizeof(text) - 1, 4096));
    const struct fl_json_place second = {.index = 1}, missing = {.outer = &second, .key = "a"},
                               b = {.outer = &second, .key = "b"}, none = {.outer = &b, .index = 0},
                               fourth = {.index = 3}, below = {.outer = &fourth, .key = "x"},
                               not_an_object = {.key = "x"};
    assert_int_equal(fl_json_line(&json, &missing), 4);
    assert_int_equal(fl_json_line(&json, &none), 4);
    assert_int_equal(fl_json_line(&json, &below), 2);
    assert_int_equal(fl_json_line(&json, &not_an_object), 2);
    char path[8];
    fl_json_path(&none, path, sizeof(path)); /* cut off, but whole in memory */
    assert_string_equal(path, "[1].b[0");
    fl_json_finish(&json);
}

TEST(invalid_json_is_reported_with_its_line)
{
    static const char *const bad[] = {"", "{\"a\": 1,\n\"a\": 2}", "{\"a\":\n tru}", "[1]]", "\"\\ud800\""};
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        if (load(bad[i], strlen(bad[i]), 4096))
            fail_msg("'%s' was taken", bad[i]);
        assert_int_equal(error.code, FL_ERROR_ARGUMENT);
        assert_non_null(strstr(error.text, "line "));
    }
    assert_false(load("[1, 2]", 6, 5));
    assert_non_null(strstr(error.text, "larger than 5 bytes"));
    assert_true(load("[1, 2]", 6, 6));
    fl_json_finish(&json);
}
