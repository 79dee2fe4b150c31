/* SPDX-License-Identifier: MIT */
/* Device, buffers, textures, programs and timers on whatever OpenGL there is. */
#include "base/clock.h"
#include "base/host.h"
#include "base/log.h"
#include "gpu/buffer.h"
#include "gpu/device.h"
#include "gpu/egl.h"
#include "gpu/program.h"
#include "gpu/registry.h"
#include "gpu/texture.h"
#include "gpu/timer.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static void expect_no_error(const struct error *error)
{
    assert_string_equal(error->text, "");
}

ALL_TESTS(open_device, close_device)

TEST(listing_devices_leaves_the_current_context_alone_or_none_behind)
{
    struct gpu_device_info list[8];
    gpu_device_destroy(device);
    device = NULL;
    size_t count = gpu_device_list(list, 8);
    assert_in_range(count, 1, 8);
    for (size_t i = 0; i < count; i++) {
        assert_string_not_equal(list[i].name, "");
        assert_string_not_equal(list[i].version, "");
    }
    assert_null(eglGetCurrentContext());
    assert_int_equal(gpu_device_list(list, 0), 0);
    struct error error = {0};
    device = gpu_device_create(&(struct gpu_options){.index = list[0].index, .debug = true}, &error);
    expect_no_error(&error);
    assert_string_equal(device->info.name, list[0].name);
}

TEST(the_least_used_device_is_tried_first)
{
    struct gpu_egl_place places[4] = {{.index = 0}, {.index = 1}, {.index = 2}, {.index = 3}};
    const uint16_t used_by[GPU_EGL_PLACES_MAX] = {2, 1, 2, 0};
    static const int wanted[4] = {3, 1, 0, 2};
    gpu_egl_sort_by_use(places, 4, used_by);
    for (int i = 0; i < 4; i++)
        assert_int_equal(places[i].index, wanted[i]);
}

TEST(a_missing_device_is_an_error_with_a_remedy)
{
    struct error error = {0};
    gpu_device_destroy(device);
    device = NULL;
    assert_null(gpu_device_create(&(struct gpu_options){.index = 1000}, &error));
    assert_int_equal(error.kind, ERROR_UNSUPPORTED);
    assert_string_equal(error.field, "device");
    assert_non_null(strstr(error.text, "1000"));
    assert_non_null(strstr(error.remedy, "--list-devices"));
    assert_null(gpu_device_current());
    error = (struct error){0};
    device = gpu_device_create(&(struct gpu_options){.index = -1, .debug = true}, &error);
    expect_no_error(&error);
    assert_ptr_equal(gpu_device_current(), device);
}

TEST(the_facts_are_those_of_opengl_4_5)
{
    assert_in_range(device->facts.texture_buffer_texels_max, 65536, UINT64_MAX);
    assert_in_range(device->facts.storage_block_bytes_max, (uint64_t)1 << 24, UINT64_MAX);
    assert_in_range(device->facts.work_groups_max, 65535, UINT32_MAX);
    assert_in_range(device->facts.texture_size_max, 16384, UINT32_MAX);
}

TEST(a_gl_error_is_reported_once_with_the_caller_and_is_then_gone)
{
    struct error error = {0};
    glEnable(0xdead);
    assert_false(gpu_check(device, "the test", &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    assert_string_equal(error.text, "the test: GL_INVALID_ENUM (0x0500)");
    assert_true(gpu_check(device, "the test", NULL));
}

TEST(a_lost_context_is_why_whatever_fails_after_it)
{
    struct error error = {0};
    const struct gpu_program_source none = {.compute = "there/is/none.comp"};
    gpu_note_loss(device, &error);
    expect_no_error(&error);
    device->lost = true; /* the driver reported a reset once */
    assert_false(gpu_check(device, "the test", &error));
    assert_int_equal(error.kind, ERROR_DEVICE_LOST);
    error = (struct error){0};
    gpu_note_loss(device, &error);
    error_set(&error, ERROR_OUT_OF_MEMORY, NULL, "what the caller makes of it");
    assert_int_equal(error.kind, ERROR_DEVICE_LOST);
    device->lost = false;
    error = (struct error){0};
    assert_null(gpu_program_get(device, &none, &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    assert_true(gpu_check(device, "the test", NULL));
}

TEST(a_buffer_keeps_what_is_written_and_counts_its_memory)
{
    struct error error = {0};
    struct gpu_buffer buffer = {0};
    uint64_t before = device->memory_used_bytes;
    uint32_t words[4] = {1, 2, 3, 4}, back[4] = {0}, five = 5;
    assert_true(gpu_buffer_upload(device, &buffer, words, sizeof(words), &error));
    gpu_buffer_write(device, &buffer, 8, &five, sizeof(five));
    gpu_buffer_read(device, &buffer, 0, back, sizeof(back));
    assert_int_equal(back[1], 2);
    assert_int_equal(back[2], 5);
    gpu_buffer_clear(device, &buffer, 7);
    gpu_buffer_read(device, &buffer, 0, back, sizeof(back));
    assert_int_equal(back[3], 7);
    assert_int_equal(device->memory_used_bytes - before, buffer.capacity_bytes);
    unsigned name = buffer.name;
    assert_true(gpu_buffer_reserve(device, &buffer, 100, &error)); /* fits */
    assert_int_equal(buffer.name, name);
    assert_true(gpu_buffer_reserve(device, &buffer, 1 << 20, &error));
    assert_in_range(buffer.capacity_bytes, 1 << 20, 2 << 20);
    gpu_buffer_finish(device, &buffer);
    gpu_buffer_finish(device, &buffer); /* empty already */
    assert_int_equal(device->memory_used_bytes, before);
    expect_no_error(&error);
    assert_true(gpu_check(device, "buffers", &error));
}

/* Large enough that no driver keeps it with its commands. */
TEST(what_is_written_behind_a_clear_stays)
{
    enum { WORDS = 1 << 18 };
    struct error error = {0};
    struct gpu_buffer buffer = {0};
    uint32_t *words = malloc(WORDS * sizeof(*words)), *back = malloc(WORDS * sizeof(*back));
    for (uint32_t i = 0; i < WORDS; i++)
        words[i] = i;
    assert_true(gpu_buffer_reserve(device, &buffer, WORDS * sizeof(*words), &error));
    for (int turn = 0; turn < 3; turn++) {
        gpu_buffer_clear(device, &buffer, 0xdeadbeef);
        if (turn < 2) {
            gpu_buffer_write(device, &buffer, 0, words, WORDS * sizeof(*words));
        } else {
            memcpy(gpu_buffer_map(device, &buffer, WORDS * sizeof(*words), &error), words, WORDS * sizeof(*words));
            gpu_buffer_unmap(device, &buffer);
        }
        gpu_buffer_read(device, &buffer, 0, back, WORDS * sizeof(*back));
        assert_memory_equal(back, words, WORDS * sizeof(*words));
    }
    free(words);
    free(back);
    gpu_buffer_finish(device, &buffer);
    expect_no_error(&error);
}

TEST(mapped_memory_reaches_the_buffer)
{
    struct error error = {0};
    struct gpu_buffer buffer = {0};
    uint32_t back[1000];
    uint32_t *words = gpu_buffer_map(device, &buffer, sizeof(back), &error);
    assert_non_null(words);
    for (uint32_t i = 0; i < 1000; i++)
        words[i] = i * i;
    gpu_buffer_unmap(device, &buffer);
    gpu_buffer_read(device, &buffer, 0, back, sizeof(back));
    for (uint32_t i = 0; i < 1000; i++)
        assert_int_equal(back[i], i * i);
    gpu_buffer_finish(device, &buffer);
}

/* No device is without a limit where one is known: software GL shares the host's memory with all else. */
TEST(memory_is_limited_to_what_there_is)
{
    if (device->facts.software)
        assert_int_equal(device->facts.memory.bytes, host_memory_bytes());
    assert_int_equal(device->memory_limit_bytes, device->facts.memory.bytes);
}

TEST(memory_beyond_the_limit_is_refused_before_the_driver_is_asked)
{
    struct error error = {0};
    struct gpu_buffer buffer = {0};
    struct gpu_texture texture = {0};
    uint64_t before = device->memory_used_bytes, limit = device->memory_limit_bytes;
    device->memory_limit_bytes = before + 10000;
    assert_false(gpu_buffer_reserve(device, &buffer, 20000, &error));
    assert_int_equal(error.kind, ERROR_OUT_OF_MEMORY);
    assert_non_null(strstr(error.text, "20224")); /* rounded up to 256 */
    assert_false(gpu_texture_reserve(device, &texture, GL_RGBA8, 100, 100, NULL));
    assert_true(gpu_buffer_reserve(device, &buffer, 5000, NULL));
    assert_false(gpu_buffer_reserve(device, &buffer, SIZE_MAX, NULL));
    device->memory_limit_bytes = limit;
    gpu_buffer_finish(device, &buffer);
    gpu_texture_finish(device, &texture);
    assert_int_equal(device->memory_used_bytes, before);
}

/* Software GL clears new memory at once, which is slow where each page is a fault. */
TEST(reservations_are_made_in_steps)
{
    const size_t bytes = (size_t)64 << 20;
    struct error error = {0};
    struct gpu_buffer small = {0}, large = {0};
    uint64_t before = device->memory_used_bytes;
    bool made = false;
    while (!made) {
        error = (struct error){0};
        gpu_reserve_begin(device, 1); /* no time */
        made =
            gpu_buffer_reserve(device, &small, 4096, &error) && gpu_buffer_reserve(device, &large, bytes, &error);
        assert_true(made != gpu_reserve_end(device));
        assert_int_equal(error.kind, made ? ERROR_NONE : ERROR_BUSY);
    }
    assert_int_equal(device->memory_used_bytes, before + small.capacity_bytes + large.capacity_bytes);
    device->memory_limit_bytes = device->memory_used_bytes + bytes;
    gpu_reserve_begin(device, UINT64_C(60000000000));
    error = (struct error){0};
    assert_false(gpu_buffer_reserve(device, &small, 2 * bytes, &error)); /* refused, not put off */
    assert_int_equal(error.kind, ERROR_OUT_OF_MEMORY);
    assert_false(gpu_reserve_end(device));
    device->memory_limit_bytes = device->facts.memory.bytes;
    gpu_buffer_finish(device, &small);
    gpu_buffer_finish(device, &large);
    assert_int_equal(device->memory_used_bytes, before);
}

TEST(textures_have_the_formats_of_the_table_and_no_others)
{
    struct error error = {0};
    struct gpu_texture texture = {0}, depth = {0};
    struct gpu_framebuffer framebuffer = {0};
    assert_true(gpu_texture_reserve(device, &texture, GL_RGBA32UI, 30, 20, &error));
    assert_int_equal(texture.size_bytes, 30 * 20 * 16);
    unsigned name = texture.name;
    assert_true(gpu_texture_reserve(device, &texture, GL_RGBA32UI, 30, 20, &error));
    assert_int_equal(texture.name, name);
    assert_true(gpu_texture_reserve(device, &depth, GL_DEPTH_COMPONENT32F, 30, 20, &error));
    assert_true(gpu_framebuffer_create(device, &framebuffer, &texture, 1, &depth, &error));
    gpu_framebuffer_finish(device, &framebuffer);
    expect_no_error(&error);
    assert_false(gpu_texture_reserve(device, &texture, 0x1234, 4, 4, &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    error = (struct error){0};
    assert_false(gpu_texture_reserve(device, &texture, GL_RGBA8, 1u << 30, 4, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    gpu_texture_finish(device, &texture);
    gpu_texture_finish(device, &depth);
    assert_true(gpu_check(device, "textures", NULL));
}

TEST(a_program_is_compiled_once_for_each_set_of_defines)
{
    struct error error = {0};
    const struct gpu_define closest[] = {{"TRAVERSE", "\"naive/traverse.glsl\""}, {0}};
    const struct gpu_define any[] = {{"TRAVERSE", "\"naive/traverse.glsl\""}, {"ANY_HIT", "1"}, {0}};
    struct gpu_program_source source = {.compute = "trace/wave.comp", .defines = closest};
    const struct gpu_program *first = gpu_program_get(device, &source, &error);
    expect_no_error(&error);
    assert_ptr_equal(gpu_program_get(device, &source, &error), first);
    assert_int_equal(first->group_size, 64);
    source.defines = any;
    assert_ptr_not_equal(gpu_program_get(device, &source, &error), first);
    expect_no_error(&error);
}

TEST(a_shader_that_does_not_compile_says_where)
{
    struct error error = {0};
    const struct gpu_define defines[] = {
        {"TRAVERSE", "\"naive/traverse.glsl\""}, {"trace_ray", "no such (type"}, {0}};
    const struct gpu_program_source source = {.compute = "trace/wave.comp", .defines = defines};
    assert_null(gpu_program_get(device, &source, &error));
    assert_int_equal(error.kind, ERROR_INTERNAL);
    assert_string_equal(error.field, "trace/wave.comp");
    assert_non_null(strstr(error.text, "common/candidate.glsl"));
    error = (struct error){0};
    assert_null(gpu_program_get(device, &(struct gpu_program_source){.compute = "no/such.comp"}, &error));
    assert_non_null(strstr(error.text, "no/such.comp"));
}

/* Every ray of the wave is dead, so that each invocation only writes its miss. */
TEST(more_groups_than_an_axis_takes_are_all_run)
{
    struct error error = {0};
    struct gpu_buffer visibilities = {0};
    uint32_t groups_max = device->facts.work_groups_max;
    const uint32_t count = 64 * 300 + 1;
    const struct gpu_define defines[] = {{"TRAVERSE", "\"naive/traverse.glsl\""}, {"ANY_HIT", "1"}, {0}};
    const struct gpu_program_source source = {.compute = "trace/wave.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(device, &source, &error);
    assert_non_null(program);
    assert_true(gpu_buffer_reserve(device, &visibilities, count * 4, &error));
    gpu_buffer_clear(device, &visibilities, 0);
    gpu_buffer_bind_storage(&visibilities, 0); /* BIND_VISIBILITY */
    gpu_uniform_uint(program, "ray_count", count);
    gpu_uniform_uint(program, "disc_count", 0);
    gpu_uniform_uint(program, "instance_count", 0);
    device->facts.work_groups_max = 7; /* a limit of another device */
    gpu_dispatch(device, program, count);
    gpu_dispatch(device, program, 0);
    device->facts.work_groups_max = groups_max;
    uint32_t *back = malloc(count * 4);
    gpu_buffer_read(device, &visibilities, 0, back, count * 4);
    for (uint32_t i = 0; i < count; i++)
        assert_int_equal(back[i], 0xffffffff);
    free(back);
    gpu_buffer_finish(device, &visibilities);
    assert_true(gpu_check(device, "dispatch", &error));
}

TEST(a_timer_reports_each_span_by_both_clocks)
{
    struct stage_times times;
    struct gpu_buffer buffer = {0};
    struct gpu_timer *timer = gpu_timer_create(device);
    assert_non_null(timer);
    stage_times_begin(&times);
    assert_true(gpu_buffer_reserve(device, &buffer, 1 << 20, NULL));
    uint64_t start_ns = clock_now_ns();
    for (uint32_t i = 0; i < 300; i++) { /* more than the ring has queries for */
        gpu_timer_begin(timer, i % 2 ? STAGE_SHADE : STAGE_TRACE, i);
        gpu_buffer_clear(device, &buffer, i);
        gpu_timer_end(timer);
    }
    gpu_timer_collect(timer, &times);
    uint64_t passed_ns = clock_now_ns() - start_ns, last_wave = 0;
    size_t cpu = 0, gpu = 0;
    for (uint32_t i = 0; i < times.count; i++) {
        cpu += times.spans[i].clock == CLOCK_CPU;
        gpu += times.spans[i].clock == CLOCK_GPU;
        last_wave = times.spans[i].wave > last_wave ? times.spans[i].wave : last_wave;
        assert_in_range(times.spans[i].start_ns, 0, passed_ns + 1000000000);
    }
    assert_in_range(cpu, 200, 300);
    assert_in_range(gpu, 200, 300);
    assert_in_range(last_wave, 200, 299);
    uint64_t sum_ns = stage_times_sum_ns(&times, STAGE_TRACE, CLOCK_GPU);
    assert_in_range(sum_ns, 1, passed_ns);
    stage_times_begin(&times);
    gpu_timer_collect(timer, &times); /* nothing since */
    assert_int_equal(times.count, 0);
    gpu_timer_destroy(timer);
    gpu_timer_destroy(NULL);
    gpu_buffer_finish(device, &buffer);
}

TEST(an_empty_buffer_is_bound_as_zeros)
{
    struct gpu_buffer empty = {0};
    GLint name = 0;
    size_t before = gpu_device_objects(device);
    gpu_buffer_bind_storage(&empty, 3);
    glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, 3, &name);
    assert_int_equal(name, device->empty_buffer);
    gpu_buffer_bind_texels(device, &empty, 0, GL_RGBA32F);
    assert_true(gpu_check(device, "empty buffers", NULL));
    assert_int_equal(gpu_device_objects(device), before + 1); /* a texture over the zeros */
    gpu_buffer_finish(device, &empty);
    assert_int_equal(gpu_device_objects(device), before);
}

static int64_t texture_value(unsigned texture, GLenum name)
{
    GLint value = 0;
    glGetTextureLevelParameteriv(texture, 0, name, &value);
    return value;
}

/* Expects the properties for which llvmpipe compiles a program, see gpu/buffer.c. */
static void assert_as_all_others(struct gpu_buffer *buffer)
{
    GLint64 memory = 0;
    gpu_buffer_bind_texels(device, buffer, 0, GL_R32UI);
    glGetNamedBufferParameteri64v((GLuint)texture_value(buffer->texture, GL_TEXTURE_BUFFER_DATA_STORE_BINDING),
                                  GL_BUFFER_SIZE, &memory);
    const int64_t range = texture_value(buffer->texture, GL_TEXTURE_BUFFER_SIZE);
    assert_in_range(range, buffer->size_bytes, memory);
    assert_int_not_equal(memory & (memory - 1), 0);
    if (!device->facts.software)
        return;
    assert_int_equal(range & 0xff, 0);
    assert_int_not_equal(range >> 8 & 0xff, 0);
}

TEST(software_gl_keeps_its_programs_for_texel_buffers_of_any_size)
{
    static const size_t sizes[] = {0, 256, 4096, 4097, 65280, 65281, 65536, 1000000, 1 << 24};
    struct error error = {0};
    struct gpu_buffer growing = {0};
    for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
        struct gpu_buffer exact = {0};
        assert_true(gpu_buffer_reserve(device, &exact, sizes[i], &error));
        assert_true(gpu_buffer_reserve(device, &growing, sizes[i], &error));
        assert_as_all_others(&exact);
        assert_as_all_others(&growing);
        assert_in_range(exact.capacity_bytes, sizes[i], (sizes[i] > 4096 ? sizes[i] : 4096) + 512);
        gpu_buffer_finish(device, &exact);
    }
    gpu_buffer_finish(device, &growing);
    assert_true(gpu_check(device, "texel buffers", &error));
}

TEST(destroying_a_device_takes_every_object_with_it)
{
    struct error error = {0};
    struct gpu_registry *registry = gpu_registry_create();
    unsigned buffer = gpu_object_create(registry, GPU_BUFFER),
             query = gpu_object_create(registry, GPU_TIMESTAMP_QUERY);
    unsigned gone = gpu_object_create(registry, GPU_BUFFER);
    gpu_object_destroy(registry, GPU_BUFFER, gone);
    assert_int_equal(gpu_registry_count(registry, GPU_BUFFER), 1);
    assert_true(glIsBuffer(buffer) && glIsQuery(query) && !glIsBuffer(gone));
    gpu_registry_destroy_all(registry);
    assert_false(glIsBuffer(buffer) || glIsQuery(query));
    assert_int_equal(gpu_registry_count(registry, GPU_BUFFER), 0);
    gpu_registry_destroy(registry);
    assert_true(gpu_check(device, "registry", &error));
}

static double thread_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

/* A daemon with hundreds of jobs ends like this. A search for each object would take a hundred times as long
 * as the limit allows: the time is the processor's, so other programs do not lengthen it. */
TEST(many_objects_are_destroyed_in_any_order_without_a_search_for_each)
{
    enum { COUNT = 200000 };
    struct gpu_registry *registry = gpu_registry_create();
    unsigned *names = malloc(COUNT * sizeof(*names));
    assert_non_null(names);
    for (size_t i = 0; i < COUNT; i++)
        names[i] = gpu_object_create(registry, GPU_TIMESTAMP_QUERY);
    double begin_s = thread_seconds();
    for (size_t i = 0; i < COUNT; i++)
        gpu_object_destroy(registry, GPU_TIMESTAMP_QUERY, names[i]);
    assert_in_range((uint64_t)((thread_seconds() - begin_s) * 1e3), 0, 2000);
    assert_int_equal(gpu_registry_count(registry, GPU_TIMESTAMP_QUERY), 0);
    free(names);
    gpu_registry_destroy(registry);
}

/* Compiles a program in a fresh device, with the cache at `home`. */
static uint64_t compile_with_cache_ns(const char *home)
{
    struct error error = {0};
    const struct gpu_define defines[] = {{"TRAVERSE", "\"naive/traverse.glsl\""}, {"HAS_CUTOUT", "1"}, {0}};
    const struct gpu_program_source source = {.compute = "trace/wave.comp", .defines = defines};
    gpu_device_destroy(device);
    setenv("XDG_CACHE_HOME", home, 1);
    device = gpu_device_create(&(struct gpu_options){.index = -1, .debug = true}, &error);
    expect_no_error(&error);
    uint64_t start_ns = clock_now_ns();
    assert_non_null(gpu_program_get(device, &source, &error));
    expect_no_error(&error);
    assert_true(gpu_check(device, "program", &error));
    return clock_now_ns() - start_ns;
}

static void spoil_files(const char *folder)
{
    char command[4096];
    snprintf(command, sizeof(command), "for f in '%s'/farlight/*.program; do printf rubbish >\"$f\"; done",
             folder);
    assert_int_equal(system(command), 0);
}

TEST(programs_outlive_the_process_in_a_writable_cache)
{
    char folder[1024], command[2048];
    const char *temporary = getenv("TMPDIR");
    snprintf(folder, sizeof(folder), "%s/farlight-test-XXXXXX", temporary ? temporary : P_tmpdir);
    assert_non_null(mkdtemp(folder));
    uint64_t first_ns = compile_with_cache_ns(folder), second_ns = compile_with_cache_ns(folder);
    printf("compiled in %.1f ms, from the cache in %.1f ms\n", (double)first_ns / 1e6, (double)second_ns / 1e6);
    snprintf(command, sizeof(command), "test -n \"$(ls '%s'/farlight/*.program 2>/dev/null)\"", folder);
    if (device->facts.has_program_binary)
        assert_int_equal(system(command), 0);
    spoil_files(folder); /* a file that was changed is as good as none */
    compile_with_cache_ns(folder);
    compile_with_cache_ns("/proc/self/no-such-folder");
    compile_with_cache_ns("/dev/null");
    snprintf(command, sizeof(command), "rm -r '%s'", folder);
    assert_int_equal(system(command), 0);
}
