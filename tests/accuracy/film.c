/* SPDX-License-Identifier: MIT */
/* Colours of thin films against the interference of every wavelength. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/shader_probe.h"
#include "tests/harness/test.h"

#include "shared/bindings.h"

#define PI 3.14159265358979

struct film_case {
    float cosine, ior, thickness_nm, f0;
};

static const char film_text[] =
    "#include \"shared/bindings.h\"\n"
    "layout(local_size_x = 1) in;\n"
    "#include \"common/film.glsl\"\n"
    "layout(std430, binding = BIND_PASS_0) readonly buffer case_block { vec4 cases[]; };\n"
    "layout(std430, binding = BIND_PASS_1) writeonly buffer answer_block { vec4 answers[]; };\n"
    "void main()\n"
    "{\n"
    "    uint i = gl_GlobalInvocationID.x;\n"
    "    vec4 c = cases[i];\n"
    "    answers[i] = vec4(film_reflectance(c.x, c.y, c.z, vec3(c.w)), 0.0);\n"
    "}\n";

static void ask_device(struct fixture *fixture, const struct film_case *cases, size_t count, float (*answers)[4])
{
    struct error error = {0};
    const struct gpu_define defines[] = {{"HAS_IRIDESCENCE", "1"}, {NULL, NULL}};
    struct gpu_program program = shader_probe_compile(film_text, defines);
    struct gpu_buffer in = {0}, out = {0};
    assert_true(gpu_buffer_upload(fixture->device, &in, cases, count * sizeof(*cases), &error));
    assert_true(gpu_buffer_reserve(fixture->device, &out, count * sizeof(*answers), &error));
    gpu_buffer_bind_storage(&in, BIND_PASS_0);
    gpu_buffer_bind_storage(&out, BIND_PASS_1);
    gpu_dispatch(fixture->device, &program, count);
    gpu_buffer_read(fixture->device, &out, 0, answers, count * sizeof(*answers));
    gpu_buffer_finish(fixture->device, &in);
    gpu_buffer_finish(fixture->device, &out);
    shader_probe_finish(&program);
    if (!gpu_check(fixture->device, "film probe", &error))
        fail_msg("%s", error.text);
}

/* CIE 1931, Wyman, Sloan, Shirley. Simple Analytic Approximations to the CIE XYZ Color Matching Functions. 2013.
 */
static double lobe(double nm, double height, double middle, double below, double above)
{
    double t = (nm - middle) / (nm < middle ? below : above);
    return height * exp(-0.5 * t * t);
}

static void sensitivity(double nm, double xyz[3])
{
    xyz[0] = lobe(nm, 1.056, 599.8, 37.9, 31.0) + lobe(nm, 0.362, 442.0, 16.0, 26.7) +
             lobe(nm, -0.065, 501.1, 20.4, 26.2);
    xyz[1] = lobe(nm, 0.821, 568.8, 46.9, 40.5) + lobe(nm, 0.286, 530.9, 16.3, 31.1);
    xyz[2] = lobe(nm, 1.217, 437.0, 11.8, 36.0) + lobe(nm, 0.681, 459.0, 26.0, 13.8);
}

/* Airy's sum of all orders, at normal incidence: the mean over the phases, which is white, and what a phase adds.
 */
static void film_colour(const struct film_case *c, double rgb[3])
{
    static const double rec709[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                        {-0.9692660, 1.8760108, 0.0415560},
                                        {0.0556434, -0.2040259, 1.0572252}};
    double n = (double)c->ior, root = sqrt((double)c->f0), base = (1.0 + root) / (1.0 - root);
    double first = (1.0 - n) / (1.0 + n), second = (n - base) / (n + base);
    double r12 = first * first, r23 = second * second;
    double mean = r12 + (1.0 - r12) * (1.0 - r12) * r23 / (1.0 - r12 * r23), sums[3] = {0}, white = 0.0;
    for (double nm = 360.0; nm <= 830.0; nm += 1.0) {
        double xyz[3], waves = 2.0 * first * second * cos(4.0 * PI * n * (double)c->thickness_nm / nm);
        sensitivity(nm, xyz);
        double mirrored = (r12 + r23 + waves) / (1.0 + r12 * r23 + waves);
        for (int i = 0; i < 3; i++)
            sums[i] += (mirrored - mean) * xyz[i];
        white += xyz[1];
    }
    for (int i = 0; i < 3; i++) {
        rgb[i] = mean;
        for (int j = 0; j < 3; j++)
            rgb[i] += rec709[i][j] * sums[j] / white;
        rgb[i] = fmin(fmax(rgb[i], 0.0), 1.0);
    }
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* Gaussians, one for each of CIE's curves and one more for red, are off by at most a fifth of a wave's
 * amplitude: 0.095 for a film of index 2 on glass, 0.05 on metal. */
TEST(colours_are_those_of_all_wavelengths)
{
    static const float f0s[] = {0.04f, 0.2f, 0.7f}, iors[] = {1.1f, 1.3f, 2.0f};
    enum { THICKNESSES = 14, CASES = 9 * THICKNESSES };
    static struct film_case cases[CASES];
    static float answers[CASES][4];
    for (int i = 0; i < CASES; i++)
        cases[i] = (struct film_case){1.0f, iors[i / THICKNESSES % 3], 50.0f + 90.0f * (float)(i % THICKNESSES),
                                      f0s[i / THICKNESSES / 3]};
    ask_device(*state, cases, CASES, answers);
    double off = 0.0, off_dielectric = 0.0;
    for (int i = 0; i < CASES; i++) {
        double rgb[3];
        film_colour(&cases[i], rgb);
        for (int c = 0; c < 3; c++) {
            double one = fabs((double)answers[i][c] - rgb[c]);
            if (cases[i].f0 < 0.1f)
                off_dielectric = fmax(off_dielectric, one);
            if (one > off)
                print_message("ior %.1f, %4.0f nm over %.2f: channel %d is %.4f, not %.4f\n", (double)cases[i].ior,
                              (double)cases[i].thickness_nm, (double)cases[i].f0, c, (double)answers[i][c],
                              rgb[c]);
            off = fmax(off, one);
        }
    }
    assert_true(off < 0.05);
    assert_true(off_dielectric < 0.2 * 0.095);
}

/* A film of no thickness, and one that is as dense as what is below it, is none: Schlick's curve is left. */
TEST_LONG(no_film_is_no_film)
{
    enum { CASES = 8 };
    struct film_case cases[CASES];
    float answers[CASES][4];
    for (int i = 0; i < CASES; i++)
        cases[i] = i % 2 ? (struct film_case){0.25f * (float)(i / 2 + 1), 1.5f, 400.0f, 0.04f}
                         : (struct film_case){0.25f * (float)(i / 2 + 1), 1.8f, 0.0f, 0.3f};
    ask_device(*state, cases, CASES, answers);
    for (int i = 0; i < CASES; i++) {
        double f0 = (double)cases[i].f0, wanted = f0 + (1.0 - f0) * pow(1.0 - (double)cases[i].cosine, 5.0);
        /* The upper side obeys Fresnel's equations, of which Schlick's curve is up to 0.037 off here; the wave of
         * no film has the least amplitude that there is, 0.003. */
        for (int c = 0; c < 3; c++)
            assert_near(answers[i][c], wanted, i % 2 ? 0.04 : 0.006);
    }
}
