/* SPDX-License-Identifier: MIT */
/* The four words in which a sampled tracer stores a surface: the bits are where shaders/shared/surface_sample.h
 * says, and what is read back is what was stored, to their steps. */
#include "gpu/buffer.h"
#include "shared/bindings.h"
#include "shared/surface_sample.h"
#include "tests/fixtures/device.h"
#include "tests/fixtures/shader_probe.h"
#include "tests/harness/test.h"

#include <stddef.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Layout of the shader's struct below: five uvec4. */
struct surface {
    float base_colour[4];
    float normal[3], metallic;
    float transmission, roughness, occlusion;
    uint32_t material;
    float emission[3], unused0;
    float part_alpha, part_transmission; /* written alone, by the functions for a part */
    uint32_t part_material, unused1;
};

static const char probe_text[] =
    "#include \"shared/bindings.h\"\n"
    "#include \"common/dispatch.glsl\"\n"
    "#include \"common/sampled.glsl\"\n"
    "uniform uint count;\n"
    "layout(std430, binding = BIND_PASS_0) buffer surface_block { uvec4 surfaces[]; };\n"
    "layout(std430, binding = BIND_PASS_1) buffer word_block { uvec4 words[]; };\n"
    "void main()\n"
    "{\n"
    "    uint i = item_index(), k = 5u * i;\n"
    "    if (i >= count)\n"
    "        return;\n"
    "    vec4 second = uintBitsToFloat(surfaces[k + 1u]);\n"
    "    vec3 third = uintBitsToFloat(surfaces[k + 2u].xyz);\n"
    "    surface_sample s;\n"
    "    s.base_colour = uintBitsToFloat(surfaces[k]);\n"
    "    s.normal = second.xyz;\n"
    "    s.metallic = second.w;\n"
    "    s.transmission = third.x;\n"
    "    s.roughness = third.y;\n"
    "    s.occlusion = third.z;\n"
    "    s.material = surfaces[k + 2u].w;\n"
    "    s.emission = uintBitsToFloat(surfaces[k + 3u].xyz);\n"
    "    words[i] = pack_sample(s);\n"
    "    s = unpack_sample(words[i]);\n"
    "    surfaces[k] = floatBitsToUint(s.base_colour);\n"
    "    surfaces[k + 1u] = floatBitsToUint(vec4(s.normal, s.metallic));\n"
    "    surfaces[k + 2u] = uvec4(floatBitsToUint(vec3(s.transmission, s.roughness, s.occlusion)), s.material);\n"
    "    surfaces[k + 3u] = uvec4(floatBitsToUint(s.emission), 0u);\n"
    "    vec2 parts = vec2(sample_alpha(words[i]), sample_transmission(words[i]));\n"
    "    surfaces[k + 4u] = uvec4(floatBitsToUint(parts), sample_material(words[i]), 0u);\n"
    "}\n";

/* Stores each and reads it back in its place. */
static void store(struct surface *surfaces, uint32_t (*words)[4], uint32_t count)
{
    struct error error = {0};
    struct gpu_program program = shader_probe_compile(probe_text, NULL);
    struct gpu_buffer surface_buffer = {0}, word_buffer = {0};
    assert_true(gpu_buffer_upload(device, &surface_buffer, surfaces, count * sizeof(*surfaces), &error));
    assert_true(gpu_buffer_reserve(device, &word_buffer, count * sizeof(*words), &error));
    gpu_uniform_uint(&program, "count", count);
    gpu_buffer_bind_storage(&surface_buffer, BIND_PASS_0);
    gpu_buffer_bind_storage(&word_buffer, BIND_PASS_1);
    gpu_dispatch(device, &program, count);
    gpu_buffer_read(device, &surface_buffer, 0, surfaces, count * sizeof(*surfaces));
    gpu_buffer_read(device, &word_buffer, 0, words, count * sizeof(*words));
    gpu_buffer_finish(device, &surface_buffer);
    gpu_buffer_finish(device, &word_buffer);
    shader_probe_finish(&program);
}

ALL_TESTS(open_device, close_device)

TEST(the_bits_are_where_the_layout_has_them)
{
    struct surface surfaces[] = {
        {.base_colour = {1, 0, 0, 0.2f}, .normal = {0, 0, 1}, .metallic = 1, .material = 5, .emission = {1, 0, 0}},
        {.base_colour = {0, 1, 0, 1},
         .normal = {1, 0, 0},
         .transmission = 1,
         .roughness = 1,
         .emission = {0, 1, 0}},
        {.base_colour = {0, 0, 0.21586f, 0},
         .normal = {0, -1, 0},
         .occlusion = 1,
         .material = 0xffffff,
         .emission = {0, 0, 1}},
    };
    static const uint32_t expected[][4] = {
        {0x330000ff, 0x00000000, 0x0f000005, 0x001f0000},
        {0xff00ff00, 0x00007fff, 0xf0000000, 0x07e000ff},
        {0x00800000, 0x80010000, 0x00ffffff, 0xf800ff00}, /* 0.21586 is 128 of 255 in sRGB */
    };
    uint32_t words[3][4];
    store(surfaces, words, 3);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++)
            assert_int_equal(words[i][k], expected[i][k]);
}

static float decode_step(float value) /* Step of an sRGB byte at a linear value: its slope times 1 / 255 */
{
    return value <= 0.0031308f ? 1.0f / 12.92f / 255 : 2.4f / 1.055f * powf(value, 1 - 1 / 2.4f) / 255;
}

TEST(what_is_read_back_is_what_was_stored)
{
    enum { COUNT = 1000 };
    static struct surface surfaces[COUNT], stored[COUNT];
    static uint32_t words[COUNT][4];
    for (int i = 0; i < COUNT; i++) {
        float t = (float)i / (COUNT - 1), height = 2 * t - 1, across = sqrtf(1 - height * height);
        surfaces[i] = (struct surface){
            .base_colour = {t, 1 - t, t * t, 0.5f * t},
            .normal = {across * cosf(40 * t), across * sinf(40 * t), height},
            .metallic = t,
            .transmission = 1 - t,
            .roughness = t * t,
            .occlusion = 0.25f + 0.5f * t,
            .material = (uint32_t)i * 16777,
            .emission = {t, t * t, 1 - t},
        };
        stored[i] = surfaces[i];
    }
    store(stored, words, COUNT);
    for (int i = 0; i < COUNT; i++) {
        const struct surface *in = &surfaces[i], *out = &stored[i];
        float cosine = 0;
        for (int k = 0; k < 3; k++) {
            /* half a step, and a little for the driver's pow() */
            assert_float_equal(out->base_colour[k], in->base_colour[k],
                               0.5f * decode_step(in->base_colour[k]) + 1e-4f);
            float maximum = k == 1 ? 63 : 31; /* square roots are stored: the slope is twice the root */
            assert_float_equal(out->emission[k], in->emission[k],
                               sqrtf(in->emission[k]) / maximum + 0.25f / (maximum * maximum) + 1e-6f);
            cosine += out->normal[k] * in->normal[k];
        }
        assert_true(cosine > 0.999999f);
        assert_float_equal(out->base_colour[3], in->base_colour[3], 0.5f / 255 + 1e-6f);
        assert_float_equal(out->metallic, in->metallic, 0.5f / 15 + 1e-6f);
        assert_float_equal(out->transmission, in->transmission, 0.5f / 15 + 1e-6f);
        assert_float_equal(out->roughness, in->roughness, 0.5f / 255 + 1e-6f);
        assert_float_equal(out->occlusion, in->occlusion, 0.5f / 255 + 1e-6f);
        assert_int_equal(out->material, in->material & SAMPLE_MATERIAL_MASK);
        assert_float_equal(out->part_alpha, out->base_colour[3], 1e-6f);
        assert_float_equal(out->part_transmission, out->transmission, 0);
        assert_int_equal(out->part_material, out->material);
    }
}

/* Shares are 1: a material without textures is stored unchanged, up to rounding. */
TEST(a_surface_without_textures_is_what_its_material_says)
{
    struct surface surface = {.base_colour = {1, 1, 1, 1},
                              .normal = {0, 1, 0},
                              .metallic = 1,
                              .transmission = 1,
                              .roughness = 1,
                              .occlusion = 1,
                              .emission = {1, 1, 1}};
    uint32_t words[1][4];
    store(&surface, words, 1);
    for (int k = 0; k < 4; k++)
        assert_float_equal(surface.base_colour[k], 1.0f, 1e-6f);
    for (int k = 0; k < 3; k++)
        assert_float_equal(surface.emission[k], 1.0f, 1e-6f);
    assert_float_equal(surface.metallic, 1.0f, 1e-6f);
    assert_float_equal(surface.transmission, 1.0f, 1e-6f);
    assert_float_equal(surface.roughness, 1.0f, 1e-6f);
    assert_float_equal(surface.occlusion, 1.0f, 1e-6f);
}
