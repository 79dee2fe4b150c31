/* SPDX-License-Identifier: MIT */
/* Who waits for what shaders wrote, and for what only. */
#include "gpu/barrier.h"

#include "gpu/buffer.h"
#include "tests/fixtures/device.h"
#include "tests/fixtures/shader_probe.h"
#include "tests/harness/test.h"

static PFNGLMEMORYBARRIERPROC barrier_of_driver;
static GLbitfield waited_for;

static void noted_barrier(GLbitfield kinds)
{
    waited_for |= kinds;
    barrier_of_driver(kinds);
}

static GLbitfield take_waited_for(void)
{
    GLbitfield kinds = waited_for;
    waited_for = 0;
    return kinds;
}

static int watch_barriers(void **state)
{
    open_device(state);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT); /* epoxy finds it, and writes it where ours is to stand */
    barrier_of_driver = epoxy_glMemoryBarrier;
    epoxy_glMemoryBarrier = noted_barrier;
    return 0;
}

ALL_TESTS(watch_barriers, close_device)

static const char writes[] = "layout(local_size_x = 1) in;\n"
                             "layout(std430, binding = 0) buffer out_block { uint items[]; };\n"
                             "void main() { items[0] += 1u; }\n";
static const char fetches[] = "layout(local_size_x = 1) in;\n"
                              "layout(binding = 0) uniform usamplerBuffer items;\n"
                              "  layout(binding = 1, r32ui) writeonly uniform uimageBuffer copies;\n"
                              "void main() { imageStore(copies, 0, texelFetch(items, 0)); }\n";

TEST(each_waits_once_for_its_own_kinds_of_access)
{
    struct gpu_buffer items = {0}, copies = {0};
    const uint32_t zero = 0;
    uint32_t copy = 0;
    struct gpu_program writer = shader_probe_compile(writes, NULL), fetcher = shader_probe_compile(fetches, NULL);
    assert_true(gpu_buffer_upload(device, &items, &zero, sizeof(zero), NULL));
    assert_true(gpu_buffer_reserve(device, &copies, sizeof(copy), NULL));
    gpu_buffer_bind_storage(&items, 0);
    assert_int_equal(take_waited_for(), 0); /* no shader has written */
    gpu_dispatch(device, &writer, 1);
    assert_int_equal(take_waited_for(), 0);
    gpu_dispatch(device, &writer, 1);
    assert_int_equal(take_waited_for(), GL_SHADER_STORAGE_BARRIER_BIT);
    gpu_buffer_bind_texels(device, &items, 0, GL_R32UI);
    gpu_buffer_bind_image(device, &copies, 1, GL_R32UI);
    gpu_dispatch(device, &fetcher, 1);
    assert_int_equal(take_waited_for(), GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    gpu_buffer_read(device, &copies, 0, &copy, sizeof(copy));
    assert_int_equal(take_waited_for(), GL_BUFFER_UPDATE_BARRIER_BIT);
    gpu_buffer_read(device, &copies, 0, &copy, sizeof(copy));
    gpu_buffer_clear(device, &copies, 0);
    assert_int_equal(take_waited_for(), 0);
    assert_int_equal(copy, 2);
    gpu_dispatch_indirect(&writer, &copies, 0); /* a dispatch of no groups */
    assert_int_equal(take_waited_for(), GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
    shader_probe_finish(&writer);
    shader_probe_finish(&fetcher);
    gpu_buffer_finish(device, &items);
    gpu_buffer_finish(device, &copies);
}

TEST(passes_together_wait_for_those_before_and_are_waited_for)
{
    struct gpu_buffer items = {0};
    struct gpu_program writer = shader_probe_compile(writes, NULL);
    assert_true(gpu_buffer_reserve(device, &items, 4, NULL));
    gpu_buffer_bind_storage(&items, 0);
    gpu_dispatch(device, &writer, 1);
    take_waited_for();
    gpu_together_begin(device);
    gpu_dispatch(device, &writer, 1);
    assert_int_equal(take_waited_for(), GL_SHADER_STORAGE_BARRIER_BIT);
    gpu_dispatch(device, &writer, 1);
    assert_int_equal(take_waited_for(), 0);
    gpu_buffer_clear(device, &items, 0); /* no pass */
    assert_int_equal(take_waited_for(), GL_BUFFER_UPDATE_BARRIER_BIT);
    gpu_together_end(device);
    gpu_dispatch(device, &writer, 1);
    assert_int_equal(take_waited_for(), GL_SHADER_STORAGE_BARRIER_BIT);
    gpu_await(device, ~0u);
    shader_probe_finish(&writer);
    gpu_buffer_finish(device, &items);
}

/* Kinds that are declared where they are not looked for are found when a program is made on a device for
 * debugging. */
TEST(an_access_that_no_line_declares_is_an_error)
{
    static const char hidden[] = "layout(local_size_x = 1) in;\n"
                                 "/**/ layout(std430, binding = 0) buffer out_block { uint items[]; };\n"
                                 "/**/ layout(binding = 0) uniform usamplerBuffer texels;\n"
                                 "/**/ uniform uint value;\n"
                                 "void main() { items[0] = texelFetch(texels, 0).x VALUE; }\n";
    const struct gpu_define with_value[] = {{"VALUE", "+ value"}, {0}}, without[] = {{"VALUE", "+ 1u"}, {0}};
    struct error error = {0};
    struct gpu_program program = shader_probe_compile(hidden, without);
    assert_false(gpu_accesses_check(&program, &error));
    assert_non_null(strstr(error.text, "(0x2008, not 0x0)"));
    program.accesses = GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT;
    assert_true(gpu_accesses_check(&program, NULL));
    shader_probe_finish(&program);
    error = (struct error){0};
    program = shader_probe_compile(hidden, with_value);
    assert_false(gpu_accesses_check(&program, &error));
    assert_string_equal(error.text, "a uniform lies outside the block of its program");
    shader_probe_finish(&program);
}
