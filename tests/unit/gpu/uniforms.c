/* SPDX-License-Identifier: MIT */
/* The values of passes: where they lie, and that each pass reads its own. */
#include "gpu/uniforms.h"

#include "gpu/buffer.h"
#include "gpu/program.h"
#include "tests/fixtures/device.h"
#include "tests/fixtures/shader_probe.h"
#include "tests/harness/test.h"

ALL_TESTS(open_device, close_device)

static struct gpu_source_text text_of(const char *text)
{
    struct gpu_source_text copy = {.text = strdup(text), .length = strlen(text), .capacity = strlen(text) + 1};
    assert_non_null(copy.text);
    return copy;
}

static const char all_types[] = "layout(local_size_x = 1) in;\n"
                                "uniform uint a;\n"
                                "uniform vec3 b, c; // a vec3 and a float share four words\n"
                                "uniform float d;\n"
                                "uniform int e[ROWS], f;\n"
                                "uniform vec2 g;\n"
                                "uniform bool h;\n"
                                "uniform vec4 i;\n"
                                "uniform vec3 j[3];\n"
                                "uniform float k;\n"
                                "layout(std430, binding = 0) buffer out_block { float sum; };\n"
                                "void main()\n"
                                "{\n"
                                "    sum = float(a + uint(e[1] + f)) + b.x + c.y + d + g.x + i.w + j[2].z + k;\n"
                                "    if (h)\n"
                                "        sum = -sum;\n"
                                "}\n";

TEST(values_lie_where_the_driver_looks_for_them)
{
    static const char *const names[] = {"a", "b", "c", "d", "e[0]", "f", "g", "h", "i", "j[0]", "k"};
    const struct gpu_define defines[] = {{"ROWS", "2"}, {0}};
    struct gpu_program program = shader_probe_compile(all_types, defines);
    for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
        const GLenum properties[] = {GL_OFFSET, GL_ARRAY_STRIDE};
        GLint theirs[2] = {-1, -1};
        uint32_t ours = 0;
        GLuint index = glGetProgramResourceIndex(program.name, GL_UNIFORM, names[i]);
        glGetProgramResourceiv(program.name, GL_UNIFORM, index, 2, properties, 2, NULL, theirs);
        assert_true(gpu_uniforms_find(program.uniforms, names[i], &ours));
        if (theirs[0] != (GLint)ours)
            fail_msg("%s lies at %d, not at %u", names[i], theirs[0], ours);
        assert_true(theirs[1] == (strchr(names[i], '[') ? 16 : 0));
    }
    shader_probe_finish(&program);
}

TEST(the_stages_of_a_program_share_one_block_and_its_lines_keep_their_numbers)
{
    struct gpu_uniforms *uniforms = gpu_uniforms_create();
    struct gpu_source_text first = text_of("#version 450 core\n#extension GL_EXT_some : require\n"
                                           "#line 1 0\nuniform int a; // one\n"),
                           second =
                               text_of("#version 450 core\n#line 1 0\n  uniform uint b, c;\nuniform int a;\n");
    assert_true(gpu_uniforms_take(uniforms, &first, NULL, NULL) &&
                gpu_uniforms_take(uniforms, &second, NULL, NULL));
    assert_true(gpu_uniforms_put(uniforms, &first, false, NULL) &&
                gpu_uniforms_put(uniforms, &second, false, NULL));
    assert_string_equal(first.text,
                        "#version 450 core\n#extension GL_EXT_some : require\n"
                        "layout(std140, binding = 2) uniform pass_block {\nint a;\nuint b;\nuint c;\n};\n"
                        "#line 1 0\n               // one\n");
    assert_string_equal(second.text,
                        "#version 450 core\n"
                        "layout(std140, binding = 2) uniform pass_block {\nint a;\nuint b;\nuint c;\n};\n"
                        "#line 1 0\n                    \n              \n");
    gpu_source_finish(&first);
    gpu_source_finish(&second);
    gpu_uniforms_destroy(uniforms);
}

TEST(software_gl_reads_what_asks_for_it_when_main_begins)
{
    static const char asks[] =
        "#version 450 core\n#line 1 0\n#ifdef UNIFORMS_AT_START\n#endif\nuniform uint a, b[2];\n";
    for (unsigned software = 0; software < 2; software++) {
        struct gpu_uniforms *uniforms = gpu_uniforms_create();
        struct gpu_source_text text = text_of(asks);
        assert_true(gpu_uniforms_take(uniforms, &text, NULL, NULL));
        assert_true(gpu_uniforms_put(uniforms, &text, software != 0, NULL));
        assert_true(
            (strstr(text.text, "{\nuint a_in_block;\nuint b[2];\n};\nuint a = at_start(a_in_block);\n#line 1 0") !=
             NULL) == (software != 0));
        assert_true((strstr(text.text, "{\nuint a;\nuint b[2];\n};\n#line 1 0") != NULL) == (software == 0));
        gpu_source_finish(&text);
        gpu_uniforms_destroy(uniforms);
    }
}

TEST(a_declaration_that_is_not_understood_is_an_error)
{
    static const char *const texts[] = {
        "uniform mat4 a;",
        "uniform uint a",
        "uniform uint a\n;",
        "uniform int a[ROWS];",
        "uniform int a[];",
        "uniform int a[2][2];",
        "uniform int;",
        "uniform int a[1000];",
        "uniform uint a_name_that_is_longer_than_any_of_ours_;",
        "uniform int a;\nuniform uint a;",
    };
    for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++) {
        struct error error = {0};
        struct gpu_uniforms *uniforms = gpu_uniforms_create();
        struct gpu_source_text text = text_of(texts[i]);
        if (gpu_uniforms_take(uniforms, &text, NULL, &error))
            fail_msg("%s", texts[i]);
        assert_int_equal(error.kind, ERROR_INTERNAL);
        gpu_source_finish(&text);
        gpu_uniforms_destroy(uniforms);
    }
}

static const char writer[] = "layout(local_size_x = 1) in;\n"
                             "uniform uint place, value;\n"
                             "uniform float half_value;\n"
                             "layout(std430, binding = 0) buffer out_block { uint items[]; };\n"
                             "void main() { items[place] = value + uint(2.0 * half_value); }\n";

/* More passes than the buffer has ranges for. */
TEST(each_of_many_queued_passes_reads_its_own_values)
{
    enum { PASSES = 20000 };
    static uint32_t items[PASSES];
    struct gpu_buffer buffer = {0};
    struct gpu_program program = shader_probe_compile(writer, NULL);
    assert_true(gpu_buffer_reserve(device, &buffer, sizeof(items), NULL));
    gpu_buffer_bind_storage(&buffer, 0);
    gpu_uniform_float(&program, "half_value", 500); /* stays */
    for (uint32_t i = 0; i < PASSES; i++) {
        gpu_uniform_uint(&program, "place", i);
        gpu_uniform_uint(&program, "value", i / 3);
        gpu_uniform_uint(&program, "no_such_value", i);
        gpu_dispatch(device, &program, 1);
    }
    gpu_buffer_read(device, &buffer, 0, items, sizeof(items));
    for (uint32_t i = 0; i < PASSES; i++)
        assert_int_equal(items[i], i / 3 + 1000);
    assert_true(device->uniform_ring.turn > 1);
    assert_true(gpu_check(device, "many passes", NULL));
    gpu_buffer_finish(device, &buffer);
    shader_probe_finish(&program);
}

TEST(a_value_of_another_type_is_told_of_once)
{
    struct error error = {0};
    struct gpu_program program = shader_probe_compile(writer, NULL);
    gpu_uniform_float(&program, "place", 1);
    assert_false(gpu_check(device, "the test", &error));
    assert_string_equal(error.text, "the test: the uniform \"place\" is of another type");
    assert_true(gpu_check(device, "the test", NULL));
    gpu_uniform_vec(&program, "half_value", 2, (const float[]){1, 2});
    assert_false(gpu_check(device, "the test", NULL));
    gpu_uniform_int(&program, "place", 1);
    assert_false(gpu_check(device, "the test", NULL));
    shader_probe_finish(&program);
}
