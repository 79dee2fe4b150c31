/* SPDX-License-Identifier: MIT */
/* From shader files to one text, without a device. */
#include "gpu/program_source.h"
#include "tests/harness/test.h"

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *path, *text;
} files[] = {
    {"main.comp", "#version 330\n#include \"a.glsl\"\n#include \"b.glsl\"\nint last;\n"},
    {"a.glsl", "int a1;\n  #  include \"shared/c.h\"\nint a3;\n"},
    {"b.glsl", "#include \"shared/c.h\"\nint b2;"},
    {"shared/c.h", "#ifndef C_H\n#include <stdint.h>\nint c3;\n#endif\n"},
    {"named.comp", "int first;\n#include TRAVERSE\nint last;\n"},
    {"circle.comp", "#include \"circle.comp\"\nint once;\n"},
    {"lost.comp", "int x;\n\n#include \"nowhere.glsl\"\n"},
    {"bare.comp", "#include\n"},
    {"open.comp", "#include \"a.glsl"},
};

static bool lookup(const char *path, size_t length, const char **kept, const char **begin, const char **end)
{
    for (size_t i = 0; i < sizeof(files) / sizeof(files[0]); i++) {
        if (strlen(files[i].path) == length && memcmp(files[i].path, path, length) == 0) {
            *kept = files[i].path;
            *begin = files[i].text;
            *end = files[i].text + strlen(files[i].text);
            return true;
        }
    }
    return false;
}

static void expect_text(const char *path, const struct gpu_define *defines, const char *expected)
{
    struct gpu_source_text text;
    struct error error = {0};
    bool ok = gpu_source_expand(&text, lookup, path, defines, &error);
    assert_string_equal(error.text, "");
    assert_true(ok);
    assert_string_equal(text.text, expected);
    gpu_source_finish(&text);
}

TEST(each_file_is_included_once_and_lines_keep_their_numbers)
{
    expect_text("main.comp", NULL,
                GPU_SOURCE_HEAD "#line 1 0\n"
                                "\n"
                                "#line 1 1\nint a1;\n"
                                "#line 1 2\n#ifndef C_H\n\nint c3;\n#endif\n"
                                "#line 3 1\nint a3;\n"
                                "#line 3 0\n"
                                "#line 1 3\n\n#line 2 3\nint b2;\n"
                                "#line 4 0\nint last;\n");
}

TEST(defines_stand_in_front_and_a_path_among_them_is_not_seen_by_glsl)
{
    const struct gpu_define defines[] = {{"ANY_HIT", NULL}, {"COUNT", "3"}, {"TRAVERSE", "\"b.glsl\""}, {0}};
    expect_text("named.comp", defines,
                GPU_SOURCE_HEAD "#define ANY_HIT 1\n#define COUNT 3\n"
                                "#line 1 0\nint first;\n"
                                "#line 1 1\n#line 1 2\n#ifndef C_H\n\nint c3;\n#endif\n#line 2 1\nint b2;\n"
                                "#line 3 0\nint last;\n");
}

TEST(a_required_extension_stands_in_front)
{
    const struct gpu_define defines[] = {{"ANY_HIT", NULL}, {"EXTENSION", "GL_EXT_some"}, {0}};
    expect_text("a.glsl", defines,
                GPU_SOURCE_HEAD
                "#define ANY_HIT 1\n#extension GL_EXT_some : require\n"
                "#line 1 0\nint a1;\n#line 1 1\n#ifndef C_H\n\nint c3;\n#endif\n#line 3 0\nint a3;\n");
}

TEST(a_pragma_stands_in_front)
{
    const struct gpu_define defines[] = {{"PRAGMA", "optionNV(unroll none)"}, {0}};
    expect_text("circle.comp", defines,
                GPU_SOURCE_HEAD "#pragma optionNV(unroll none)\n#line 1 0\n\n#line 2 0\nint once;\n");
}

TEST(a_file_that_includes_itself_is_expanded_once)
{
    expect_text("circle.comp", NULL, GPU_SOURCE_HEAD "#line 1 0\n\n#line 2 0\nint once;\n");
}

static void expect_error(const char *path, const char *expected)
{
    struct gpu_source_text text;
    struct error error = {0};
    assert_false(gpu_source_expand(&text, lookup, path, NULL, &error));
    assert_string_equal(error.text, expected);
    assert_null(text.text);
}

TEST(an_error_names_the_file_the_line_and_what_is_missing)
{
    expect_error("lost.comp", "lost.comp:3: the shader file \"nowhere.glsl\" does not exist");
    expect_error("bare.comp", "bare.comp:1: #include names no file");
    expect_error("open.comp", "open.comp:1: #include names no file");
    expect_error("named.comp", "named.comp:2: #include names no file");
    expect_error("none.comp", "the shader file \"none.comp\" does not exist");
}

TEST(file_numbers_in_a_drivers_log_become_names)
{
    struct gpu_source_text text;
    char out[200], small[12];
    assert_true(gpu_source_expand(&text, lookup, "main.comp", NULL, NULL));
    gpu_source_name_files(&text, "2:17(5): error: x 1:2\n1(4) : error C0000\n9:1: beyond\n3 errors\n", out,
                          sizeof(out));
    assert_string_equal(out, "shared/c.h:17(5): error: x 1:2\na.glsl(4) : error C0000\n9:1: beyond\n3 errors\n");
    gpu_source_name_files(&text, "2:17(5): error", small, sizeof(small));
    assert_string_equal(small, "shared/c.h:");
    gpu_source_finish(&text);
}
