/* SPDX-License-Identifier: MIT */
/* Programs that are compiled ahead are those that would be compiled anyway, each once; what goes wrong there is as
 * if nothing had been tried. */
#include "gpu/program.h"
#include "gpu/program_ahead.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char home[64];

/* A device whose caches are empty. */
static int open_cold(void **state)
{
    snprintf(home, sizeof(home), "/tmp/farlight-ahead-XXXXXX");
    assert_non_null(mkdtemp(home));
    setenv("XDG_CACHE_HOME", home, 1);
    open_device(state);
    gpu_facts_choose(&device->facts, false);
    device->facts.compiles_at_dispatch = false; /* hardware does not */
    return 0;
}

static int close_cold(void **state)
{
    char command[128];
    close_device(state);
    snprintf(command, sizeof(command), "rm -r '%s'", home);
    return system(command);
}

EACH_TEST(open_cold, close_cold)

static const struct gpu_texel_formats formats;
static const struct gpu_define naive[] = {{"TRAVERSE", "\"naive/traverse.glsl\""}, {0}};
static const struct gpu_define wrong[] = {
    {"TRAVERSE", "\"naive/traverse.glsl\""}, {"trace_ray", "no such (type"}, {0}};
static const struct gpu_program_source sources[] = {
    {.compute = "trace/wave.comp", .defines = naive},
    {.compute = "render/hit_count.comp"},
    {.compute = "render/gather.comp"},
    {.vertex = "raster/view.vert", .fragment = "raster/view.frag"},
};
#define COUNT (sizeof(sources) / sizeof(sources[0]))

static void announce_all(void)
{
    gpu_program_announce(device, &formats);
    for (size_t i = 0; i < COUNT; i++)
        assert_null(gpu_program_get(device, &sources[i], NULL));
    gpu_program_announce(device, NULL);
}

static size_t known_programs(size_t *compiled)
{
    struct gpu_program_stat stat;
    size_t count = 0;
    for (*compiled = 0; gpu_program_stat(device, count, &stat); count++)
        *compiled += stat.compiled;
    return count;
}

TEST(what_was_announced_is_got_as_ever)
{
    struct error error = {0};
    size_t compiled;
    announce_all();
    announce_all(); /* once more is no more */
    assert_int_equal(known_programs(&compiled), 0);
    for (size_t i = COUNT; i-- > 0;) {
        const struct gpu_program *program = gpu_program_get(device, &sources[i], &error);
        assert_non_null(program);
        assert_int_equal(program->group_size, sources[i].compute ? 64 : 1);
        assert_ptr_equal(gpu_program_get(device, &sources[i], &error), program);
    }
    assert_int_equal(known_programs(&compiled), COUNT);
    assert_int_equal(compiled, COUNT);
    assert_true(gpu_check(device, "programs", &error));
}

TEST(a_second_start_compiles_nothing)
{
    size_t compiled;
    announce_all();
    for (size_t i = 0; i < COUNT; i++)
        assert_non_null(gpu_program_get(device, &sources[i], NULL));
    if (!device->facts.has_program_binary)
        return;
    close_device(NULL);
    open_device(NULL);
    gpu_facts_choose(&device->facts, false);
    device->facts.compiles_at_dispatch = false;
    announce_all();
    for (size_t i = 0; i < COUNT; i++)
        assert_non_null(gpu_program_get(device, &sources[i], NULL));
    assert_int_equal(known_programs(&compiled), COUNT);
    assert_int_equal(compiled, 0);
    assert_int_equal(gpu_ahead_left(device->ahead), 0);
}

static void assert_all_compile_ahead(bool together)
{
    size_t compiled;
    device->facts.compiles_together = together;
    announce_all();
    for (size_t i = 0; i < COUNT; i++)
        assert_non_null(gpu_program_get(device, &sources[i], NULL));
    assert_int_equal(known_programs(&compiled), COUNT);
    assert_int_equal(compiled, COUNT);
}

TEST(a_driver_that_compiles_several_together_is_given_them_together)
{
    assert_all_compile_ahead(true);
}

TEST(a_driver_that_compiles_one_at_a_time_is_given_them_by_several_threads)
{
    assert_all_compile_ahead(false);
}

TEST(a_shader_that_does_not_compile_ahead_says_where_when_it_is_got)
{
    struct error error = {0};
    const struct gpu_program_source source = {.compute = "trace/wave.comp", .defines = wrong};
    gpu_program_announce(device, &formats);
    assert_null(gpu_program_get(device, &source, &error));
    assert_int_equal(error.kind, ERROR_NONE);
    gpu_program_announce(device, NULL);
    assert_null(gpu_program_get(device, &source, &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    assert_string_equal(error.field, "trace/wave.comp");
    assert_non_null(strstr(error.text, "common/candidate.glsl"));
}

TEST(a_device_that_ends_meanwhile_waits_for_no_more_than_what_has_begun)
{
    announce_all();
}

TEST(a_lost_device_is_told_of_and_ends)
{
    struct error error = {0};
    announce_all();
    device->lost = true;
    const struct gpu_program_source source = {.compute = "trace/wave.comp", .defines = wrong};
    assert_null(gpu_program_get(device, &source, &error));
    assert_int_equal(error.kind, ERROR_DEVICE_LOST);
}
