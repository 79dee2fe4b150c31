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
TEST(fibres_send_out_what_their_fit_says)
{
    double low = 0.0, high = 0.0, mean_off = 0.0;
    if (!device)
        skip();
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

ALL_TESTS(open_device, close_device)
