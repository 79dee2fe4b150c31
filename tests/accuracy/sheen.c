/* SPDX-License-Identifier: MIT */
/* The fibres of cloth (shaders/common/sheen.glsl): what fits say of their light from all around is its integral.
 */
#include "tests/fixtures/device.h"
#include "tests/fixtures/shader_probe.h"
#include "tests/harness/test.h"

#include "gpu/buffer.h"
#include "shared/bindings.h"

#include <math.h>
#include <stdio.h>

enum { COSINES = 24, ROUGHNESSES = 12, CASES = COSINES * ROUGHNESSES };

/* The integral: cosines as squares, as the reflectance is steep at the horizon, times angles of half a turn. */
static const char text[] =
    "#define GROUP_SIZE 64\n"
    "#include \"shared/bindings.h\"\n"
    "#include \"common/dispatch.glsl\"\n"
    "#include \"common/sheen.glsl\"\n"
    "layout(std430, binding = BIND_PASS_1) readonly buffer case_block { vec4 cases[]; };\n"
    "layout(std430, binding = BIND_PASS_2) writeonly buffer answer_block { vec4 answers[]; };\n"
    "const int ACROSS = 160, ABOUT = 80;\n"
    "void main()\n"
    "{\n"
    "    uint i = item_index();\n"
    "    if (i >= 288u)\n"
    "        return;\n"
    "    float NoV = cases[i].x, roughness = cases[i].y, sum = 0.0, sine = sqrt(1.0 - NoV * NoV);\n"
    "    vec3 view = vec3(sine, 0.0, NoV);\n"
    "    for (int j = 0; j < ACROSS * ABOUT; j++) {\n"
    "        float root = (float(j % ACROSS) + 0.5) / float(ACROSS), NoL = root * root;\n"
    "        float phi = (float(j / ACROSS) + 0.5) / float(ABOUT) * PI, other = sqrt(1.0 - NoL * NoL);\n"
    "        vec3 light = vec3(other * cos(phi), other * sin(phi), NoL);\n"
    "        float NoH = normalize(view + light).z;\n"
    "        sum += sheen_reflectance(roughness, NoH, NoV, NoL) * NoL * root;\n"
    "    }\n"
    "    answers[i] = vec4(sum * 2.0 * TWO_PI / float(ACROSS * ABOUT), sheen_albedo(NoV, roughness),\n"
    "                      sheen_albedo_mean(roughness), 0.0);\n"
    "}\n";

static float cases[CASES][4], answers[CASES][4];

static void ask(void)
{
    static const struct gpu_define defines[] = {{"HAS_SHEEN", "1"}, {NULL, NULL}};
    struct gpu_program program = shader_probe_compile(text, defines);
    struct gpu_buffer from = {0}, to = {0};
    struct error error = {0};
    for (int r = 0; r < ROUGHNESSES; r++)
        for (int c = 0; c < COSINES; c++) {
            cases[r * COSINES + c][0] = ((float)c + 0.5f) / COSINES;
            cases[r * COSINES + c][1] = (float)r / (ROUGHNESSES - 1);
        }
    assert_true(gpu_buffer_upload(device, &from, cases, sizeof(cases), &error));
    assert_true(gpu_buffer_reserve(device, &to, sizeof(answers), &error));
    gpu_buffer_bind_storage(&from, BIND_PASS_1);
    gpu_buffer_bind_storage(&to, BIND_PASS_2);
    gpu_dispatch(device, &program, CASES);
    gpu_buffer_read(device, &to, 0, answers, sizeof(answers));
    if (!gpu_check(device, "sheen probe", &error))
        fail_msg("%s", error.text);
    gpu_buffer_finish(device, &from);
    gpu_buffer_finish(device, &to);
    shader_probe_finish(&program);
}

/* The fit's own bounds, and 0.002 for the quadrature; of the mean, what those of its cosines add up to. */
TEST_LONG(fibres_send_out_what_their_fit_says)
{
    double low = 0.0, high = 0.0, mean_off = 0.0;
    ask();
    for (int r = 0; r < ROUGHNESSES; r++) {
        double mean = 0.0;
        for (int c = 0; c < COSINES; c++) {
            const float *a = answers[r * COSINES + c];
            double off = (double)a[1] - (double)a[0];
            low = fmin(low, off);
            high = fmax(high, off);
            mean += 2.0 * (double)cases[r * COSINES + c][0] * (double)a[1] / COSINES;
            assert_true(a[0] <= 1.0f);
        }
        mean_off = fmax(mean_off, fabs(mean - (double)answers[r * COSINES][2]));
    }
    print_message("off by %.4f to %.4f, the mean by %.4f\n", low, high, mean_off);
    assert_true(low > -0.007);
    assert_true(high < 0.019);
    assert_true(mean_off < 0.003);
}

/* ---- light and view in each other's place ---- */

enum { VIEWS = 24, PAIRS = VIEWS * VIEWS };

/* Pairs of directions, for the light from one to the other and back. Those below the horizon see the other
 * side. */
static const char pairs_text[] =
    "#define GROUP_SIZE 64\n"
    "#include \"shared/bindings.h\"\n"
    "#include \"common/dispatch.glsl\"\n"
    "#include \"common/scattering.glsl\"\n"
    "uniform vec4 roughness_metallic_ior_sheen;\n"
    "layout(std430, binding = BIND_PASS_1) readonly buffer direction_block { vec4 directions[]; };\n"
    "layout(std430, binding = BIND_PASS_2) writeonly buffer answer_block { float answers[]; };\n"
    "void main()\n"
    "{\n"
    "    uint i = item_index();\n"
    "    if (i >= 576u)\n"
    "        return;\n"
    "    vec3 view = directions[i / 24u].xyz, light = directions[i % 24u].xyz;\n"
    "    surface s;\n"
    "    s.position = s.emission = vec3(0.0);\n"
    "    s.geometric = s.normal = vec3(0.0, 0.0, view.z > 0.0 ? 1.0 : -1.0);\n"
    "    s.base = vec3(0.6);\n"
    "    s.alpha = s.occlusion = 1.0;\n"
    "    s.unlit = false;\n"
    "    s.inside = view.z < 0.0;\n"
    "    s.transmission = 0.0;\n"
    "    s.roughness = roughness_metallic_ior_sheen.x;\n"
    "    s.metallic = roughness_metallic_ior_sheen.y;\n"
    "    s.ior = roughness_metallic_ior_sheen.z;\n"
    "    s.sheen = vec3(0.7);\n"
    "    s.sheen_roughness = roughness_metallic_ior_sheen.w;\n"
    "    s.diffuse_colour = vec3(0.5);\n"
    "    s.diffuse_transmission = 0.4;\n"
    "    float NoV = abs(view.z);\n"
    "    answers[i] = brdf(s, split_light(s, view, NoV), view, NoV, light).g;\n"
    "}\n";

static void ask_pairs(const float material[4], float there[VIEWS][VIEWS])
{
    static const struct gpu_define defines[] = {
        {"HAS_SHEEN", "1"}, {"HAS_DIFFUSE_TRANSMISSION", "1"}, {NULL, NULL}};
    static float directions[VIEWS][4];
    struct gpu_program program = shader_probe_compile(pairs_text, defines);
    struct gpu_buffer from = {0}, to = {0};
    struct error error = {0};
    for (int i = 0; i < VIEWS; i++) {
        double z = (i % 2 ? -1.0 : 1.0) * (0.05 + 0.9 * i / (VIEWS - 1)), phi = 2.4 * i;
        directions[i][0] = (float)(sqrt(1.0 - z * z) * cos(phi));
        directions[i][1] = (float)(sqrt(1.0 - z * z) * sin(phi));
        directions[i][2] = (float)z;
    }
    assert_true(gpu_buffer_upload(device, &from, directions, sizeof(directions), &error));
    assert_true(gpu_buffer_reserve(device, &to, PAIRS * sizeof(float), &error));
    gpu_uniform_vec(&program, "roughness_metallic_ior_sheen", 4, material);
    gpu_buffer_bind_storage(&from, BIND_PASS_1);
    gpu_buffer_bind_storage(&to, BIND_PASS_2);
    gpu_dispatch(device, &program, PAIRS);
    gpu_buffer_read(device, &to, 0, there, PAIRS * sizeof(float));
    if (!gpu_check(device, "pairs probe", &error))
        fail_msg("%s", error.text);
    gpu_buffer_finish(device, &from);
    gpu_buffer_finish(device, &to);
    shader_probe_finish(&program);
}

TEST_LONG(cloth_that_light_shines_through_is_reciprocal)
{
    static const float materials[][4] = {
        {0.8f, 0.0f, 1.5f, 0.3f}, {0.4f, 0.5f, 1.5f, 0.9f}, {1.0f, 0.0f, 1.0f, 0.1f}};
    static float there[VIEWS][VIEWS];
    double off = 0.0;
    int through = 0;
    for (size_t m = 0; m < sizeof(materials) / sizeof(materials[0]); m++) {
        ask_pairs(materials[m], there);
        for (int i = 0; i < VIEWS; i++)
            for (int j = 0; j < i; j++) {
                double one = (double)there[i][j], other = (double)there[j][i];
                off = fmax(off, fabs(one - other) / fmax(fmax(one, other), 1e-3));
                through += i % 2 != j % 2 && one > 0.01;
            }
    }
    print_message("off by %.1e at most; %d pairs through the cloth\n", off, through);
    assert_true(through > 100);
    assert_true(off < 1e-4); /* roundings */
}

ALL_TESTS(open_device, close_device)
