/* SPDX-License-Identifier: MIT */
/* Calls the functions of shaders/common/scattering.glsl on the device, for any material and any pair of
 * directions: a test of them is a test of what the integrator uses, not of a copy. The normal is +z. */
#ifndef FARLIGHT_TESTS_SCATTERING_PROBE_H
#define FARLIGHT_TESTS_SCATTERING_PROBE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "gpu/buffer.h"
#include "gpu/device.h"
#include "shared/bindings.h"
#include "tests/fixtures/shader_probe.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

/* As the shader has it: three vec4. */
struct probe_case {
    float roughness, metallic, transmission, ior;
    float view[3], base; /* unit, towards the eye; base colour, grey */
    float inside;        /* 1: seen from behind, as glass is */
    float unused[3];
};
_Static_assert(sizeof(struct probe_case) == 48, "the shader reads three vec4 a case");

/* What split_light() says of a case. */
struct probe_split {
    float mirror, scattered, refracted, mirror_ray; /* scattered: also what is mirrored more than once */
};

struct probe {
    struct gpu_device *device;
    struct gpu_program program;
    struct gpu_buffer cases, directions, values, splits;
};

static const char probe_text[] =
    "#include \"shared/bindings.h\"\n"
    "#define GROUP_SIZE 1024\n" /* software GL allocates for each group, which is slow below a sanitizer */
    "#include \"common/dispatch.glsl\"\n"
    "#include \"common/scattering.glsl\"\n"
    "uniform uint case_count, direction_count;\n"
    "uniform uint direction_stride; // from one case's directions to the next one's\n"
    "layout(std430, binding = BIND_PASS_0) readonly buffer case_block { vec4 cases[]; };\n"
    "layout(std430, binding = BIND_PASS_1) readonly buffer direction_block { vec4 directions[]; };\n"
    "layout(std430, binding = BIND_PASS_2) writeonly buffer value_block { float values[]; };\n"
    "layout(std430, binding = BIND_PASS_3) writeonly buffer split_block { vec4 splits[]; };\n"
    "void main()\n"
    "{\n"
    "    uint i = item_index();\n"
    "    if (i >= case_count * direction_count)\n"
    "        return;\n"
    "    uint k = i / direction_count, j = i % direction_count;\n"
    "    vec4 material_ = cases[3u * k], view_base = cases[3u * k + 1u], more = cases[3u * k + 2u];\n"
    "    surface s;\n"
    "    s.position = s.emission = vec3(0.0);\n"
    "    s.geometric = s.normal = vec3(0.0, 0.0, 1.0);\n"
    "    s.base = vec3(view_base.w);\n"
    "    s.alpha = s.occlusion = 1.0;\n"
    "    s.unlit = false;\n"
    "    s.roughness = material_.x;\n"
    "    s.metallic = material_.y;\n"
    "    s.transmission = material_.z;\n"
    "    s.ior = material_.w;\n"
    "    s.inside = more.x > 0.0;\n"
    "    vec3 view = view_base.xyz;\n"
    "    vec3 light = directions[k * direction_stride + j].xyz;\n"
    "    split parts = split_light(s, view, view.z);\n"
    "    values[i] = brdf(s, parts, view, view.z, light).g;\n"
    "    if (j == 0u)\n"
    "        splits[k] = vec4(parts.mirror.g, parts.scattered.g + parts.again.g, parts.refracted.g, "
    "parts.mirror_ray);\n"
    "}\n";

static inline void probe_init(struct probe *probe, struct gpu_device *device)
{
    *probe = (struct probe){.device = device, .program = shader_probe_compile(probe_text, NULL)};
}

static inline void probe_finish(struct probe *probe)
{
    gpu_buffer_finish(probe->device, &probe->cases);
    gpu_buffer_finish(probe->device, &probe->directions);
    gpu_buffer_finish(probe->device, &probe->values);
    gpu_buffer_finish(probe->device, &probe->splits);
    shader_probe_finish(&probe->program);
}

/* values[case * direction_count + j]: the BRDF, without the cosine. The directions (x, y, z, anything) are those
 * of all cases, or each case has direction_count of its own. `splits` may be NULL. */
static inline void probe_run(struct probe *probe, const struct probe_case *cases, size_t case_count,
                             const float (*directions)[4], size_t direction_count, bool own_directions,
                             float *values, struct probe_split *splits)
{
    struct error error = {0};
    size_t item_count = case_count * direction_count;
    size_t directions_bytes = (own_directions ? item_count : direction_count) * sizeof(*directions);
    assert_true(gpu_buffer_upload(probe->device, &probe->cases, cases, case_count * sizeof(*cases), &error));
    assert_true(gpu_buffer_upload(probe->device, &probe->directions, directions, directions_bytes, &error));
    assert_true(gpu_buffer_reserve(probe->device, &probe->values, item_count * sizeof(*values), &error));
    assert_true(gpu_buffer_reserve(probe->device, &probe->splits, case_count * sizeof(*splits), &error));
    gpu_uniform_uint(&probe->program, "case_count", (uint32_t)case_count);
    gpu_uniform_uint(&probe->program, "direction_count", (uint32_t)direction_count);
    gpu_uniform_uint(&probe->program, "direction_stride", own_directions ? (uint32_t)direction_count : 0);
    gpu_buffer_bind_storage(&probe->cases, BIND_PASS_0);
    gpu_buffer_bind_storage(&probe->directions, BIND_PASS_1);
    gpu_buffer_bind_storage(&probe->values, BIND_PASS_2);
    gpu_buffer_bind_storage(&probe->splits, BIND_PASS_3);
    gpu_dispatch(probe->device, &probe->program, item_count);
    gpu_buffer_read(probe->device, &probe->values, 0, values, item_count * sizeof(*values));
    if (splits)
        gpu_buffer_read(probe->device, &probe->splits, 0, splits, case_count * sizeof(*splits));
    if (!gpu_check(probe->device, "probe", &error))
        fail_msg("%s", error.text);
}

#endif
