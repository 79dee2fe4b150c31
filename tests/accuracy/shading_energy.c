/* SPDX-License-Identifier: MIT */
/* What the shaders' scattering functions may not do whatever the material: give out more light than arrives, or
 * tell the way of the light from its way back. Integrated in double over the hemisphere, from values that the
 * device computed. */
#include "tests/accuracy/scattering_probe.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdio.h>

#define PI 3.14159265358979323846

static const float roughnesses[] = {0.0f, 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.65f, 0.8f, 1.0f};
static const float metallics[] = {0.0f, 0.5f, 1.0f};
static const float transmissions[] = {0.0f, 0.5f, 1.0f};
static const float iors[] = {1.0f, 1.05f, 1.2f, 1.33f, 1.5f, 2.4f, 4.0f, 10.0f};
static const float cosines[] = {1.0f, 0.95f, 0.8f, 0.6f, 0.4f, 0.25f, 0.1f, 0.03f};
#define COUNT(array) (sizeof(array) / sizeof((array)[0]))
#define CASES_MAX (COUNT(metallics) * COUNT(transmissions) * COUNT(iors))

/* Directions of light by their half-way vectors with the view, in polar coordinates about the normal: rings, ever
 * wider with their distance from it, as a highlight is a round spot there; and sectors. Only the half on one side
 * of the plane of incidence, as the other half is its image. */
enum { RINGS = 128, SECTORS = 64, DIRECTIONS_MAX = RINGS * SECTORS };
struct quadrature {
    float directions[DIRECTIONS_MAX][4];
    double weights[DIRECTIONS_MAX]; /* solid angle, both halves, times the cosine */
    size_t count;
};

/* What the sum over the directions may be off: by the cells that the horizon cuts, which Lambert's albedo of 1
 * shows (asserted below); and in narrow highlights as the midpoint rule is, which is of second order: half as many
 * rings and sectors are off by four times as much, so the finer sum by a third of the difference. */
#define HORIZON_ERROR 1e-3
#define MIDPOINT_ERROR(fine_albedo, coarse_albedo) (fabs((fine_albedo) - (coarse_albedo)) / 3.0)
/* A light's highlight is blurred by a minimum roughness and a refracted ray is not. Where Fresnel's curve is bent
 * up, at worst about 80 degrees for an index of 10, its mean over the highlight is 4e-4 above what was kept back.
 */
#define HIGHLIGHT_BLUR 5e-4
/* Of the fits of what facets mirror (facet_albedo.glsl), which are from the side where no energy is made but
 * within a few degrees of the horizon, and for indices above 2.4. */
#define FIT_ERROR(c) ((c)->ior > 2.4f ? 0.05 : (c)->view[2] < 0.08f ? 0.02 : 0.0)
/* The least that is left of a white light. A highlight on what is smoother than ROUGHNESS_MIN_LIGHT is widened,
 * and loses as much as single facets do near the horizon. */
#define LEAST(c) ((c)->view[2] < 0.08f ? 0.95 : (c)->ior > 2.4f ? 0.97 : 0.985)

static struct quadrature fine, coarse;
static float values[CASES_MAX * DIRECTIONS_MAX];

static void quadrature_make(struct quadrature *quadrature, double cosine, double roughness, int rings, int sectors)
{
    double sine = sqrt(1.0 - cosine * cosine);
    double width = fmax(roughness * roughness, 0.0064), steps = asinh(PI / 2.0 / width);
    quadrature->count = 0;
    for (int ring = 0; ring < rings; ring++)
        for (int sector = 0; sector < sectors; sector++) {
            double t = (ring + 0.5) / rings * steps, angle = width * sinh(t);
            double about = (sector + 0.5) / sectors * PI;
            double h[3] = {sin(angle) * cos(about), sin(angle) * sin(about), cos(angle)};
            double VoH = h[0] * sine + h[2] * cosine, z = 2.0 * VoH * h[2] - cosine;
            if (VoH <= 0.0 || z <= 0.0)
                continue; /* light from below */
            double solid_angle = sin(angle) * width * cosh(t) * steps / rings * 2.0 * PI / sectors;
            float *direction = quadrature->directions[quadrature->count];
            direction[0] = (float)(2.0 * VoH * h[0] - sine);
            direction[1] = (float)(2.0 * VoH * h[1]);
            direction[2] = (float)z;
            quadrature->weights[quadrature->count++] = 4.0 * VoH * solid_angle * z;
        }
}

/* Every material of the grid, white, seen under one angle and with one roughness. */
static size_t make_cases(struct probe_case cases[CASES_MAX], float cosine, float roughness)
{
    size_t count = 0;
    for (size_t m = 0; m < COUNT(metallics); m++)
        for (size_t t = 0; t < COUNT(transmissions); t++)
            for (size_t i = 0; i < COUNT(iors); i++) {
                if (metallics[m] == 1.0f && (t > 0 || i > 0))
                    continue; /* of a metal neither counts */
                cases[count++] = (struct probe_case){.roughness = roughness,
                                                     .metallic = metallics[m],
                                                     .transmission = transmissions[t],
                                                     .ior = iors[i],
                                                     .view = {sqrtf(1.0f - cosine * cosine), 0.0f, cosine},
                                                     .base = 1.0f};
            }
    return count;
}

static void albedos(struct probe *probe, const struct probe_case *cases, size_t case_count,
                    const struct quadrature *quadrature, double *albedo, struct probe_split *splits)
{
    probe_run(probe, cases, case_count, quadrature->directions, quadrature->count, false, values, splits);
    for (size_t k = 0; k < case_count; k++) {
        albedo[k] = 0.0;
        for (size_t j = 0; j < quadrature->count; j++)
            albedo[k] += (double)values[k * quadrature->count + j] * quadrature->weights[j];
    }
}

static const char *case_name(const struct probe_case *c)
{
    static char name[160];
    snprintf(name, sizeof(name), "roughness %g, metallic %g, transmission %g, ior %g, NoV %g",
             (double)c->roughness, (double)c->metallic, (double)c->transmission, (double)c->ior,
             (double)c->view[2]);
    return name;
}

/* Fresnel's equations of a smooth boundary, index of refraction n behind it. */
static double fresnel(double cosine, double n)
{
    double sine = sqrt(1.0 - cosine * cosine), bent = sqrt(1.0 - sine * sine / (n * n));
    double s = (cosine - n * bent) / (cosine + n * bent), p = (n * cosine - bent) / (n * cosine + bent);
    return (s * s + p * p) / 2.0;
}

/* What is looked for in one pass over the grid; each is printed, so that its margin is seen. */
struct extremes {
    double max, mistake, lambert, mirror, parts;
    double min_dielectric, min_metal;
    char where[160];
};

static void look_at(const struct probe_case *c, double albedo, double mistake, const struct probe_split *split,
                    struct extremes *extremes)
{
    double total = albedo + (double)split->refracted;
    if (!(total <= 1.0 + HORIZON_ERROR + mistake + HIGHLIGHT_BLUR + FIT_ERROR(c)) ||
        !(total >= LEAST(c) - HORIZON_ERROR - mistake))
        fail_msg("%s: %.6f of the light is reflected or refracted", case_name(c), total);
    if (total > extremes->max) {
        extremes->max = total;
        snprintf(extremes->where, sizeof(extremes->where), "%s", case_name(c));
    }
    extremes->mistake = fmax(extremes->mistake, mistake);
    double parts = (double)split->mirror + (double)split->scattered + (double)split->refracted;
    extremes->parts = fmax(extremes->parts, fabs(parts - 1.0));
    if (c->metallic == 0.0f && c->transmission == 0.0f && c->ior == 1.0f)
        extremes->lambert = fmax(extremes->lambert, fabs(albedo - 1.0));
    if (c->metallic == 0.0f && c->transmission == 1.0f && c->roughness == 0.0f && c->view[2] >= 0.25f)
        extremes->mirror = fmax(extremes->mirror, fabs(albedo - fresnel((double)c->view[2], (double)c->ior)));
    if (c->metallic == 0.0f && c->transmission == 0.0f && c->ior <= 1.5f)
        extremes->min_dielectric = fmin(extremes->min_dielectric, albedo);
    if (c->metallic == 1.0f)
        extremes->min_metal = fmin(extremes->min_metal, albedo);
}

static void visit_grid(struct probe *probe, struct extremes *extremes)
{
    static struct probe_case cases[CASES_MAX];
    static struct probe_split splits[CASES_MAX];
    static double albedo[CASES_MAX], coarse_albedo[CASES_MAX];
    for (size_t r = 0; r < COUNT(roughnesses); r++)
        for (size_t v = 0; v < COUNT(cosines); v++) {
            size_t case_count = make_cases(cases, cosines[v], roughnesses[r]);
            quadrature_make(&coarse, (double)cosines[v], (double)roughnesses[r], RINGS / 2, SECTORS / 2);
            quadrature_make(&fine, (double)cosines[v], (double)roughnesses[r], RINGS, SECTORS);
            albedos(probe, cases, case_count, &coarse, coarse_albedo, NULL);
            albedos(probe, cases, case_count, &fine, albedo, splits);
            for (size_t k = 0; k < case_count; k++)
                look_at(&cases[k], albedo[k], MIDPOINT_ERROR(albedo[k], coarse_albedo[k]), &splits[k], extremes);
        }
}

TEST(white_materials_give_out_what_arrives_and_no_more)
{
    struct extremes extremes = {.min_dielectric = 1.0, .min_metal = 1.0};
    visit_grid(*state, &extremes);
    print_message("maximum albedo %.6f (%s); quadrature off by %.1e at most\n", extremes.max, extremes.where,
                  extremes.mistake);
    print_message("a light in glass is mirrored within %.1e of Fresnel; Lambert within %.1e; parts of all that "
                  "surrounds within %.1e\n",
                  extremes.mirror, extremes.lambert, extremes.parts);
    print_message(
        "of what a light sends a white dielectric reflects at least %.3f (index up to 1.5), a white metal %.3f\n",
        extremes.min_dielectric, extremes.min_metal);
    assert_true(extremes.mistake < 3e-3); /* else the tolerance above would let faults through */
    assert_true(extremes.lambert < HORIZON_ERROR);
    assert_true(extremes.mirror < 1e-3); /* the highlight is blurred: alpha^2 = 4e-5 times Fresnel's curvature */
    assert_true(extremes.parts < 1e-6);  /* three roundings */
}

/* A number in 0..1 of a fixed sequence (Steele, Lea, Flood. Fast Splittable Pseudorandom Number Generators. 2014.)
 */
static double next_random(void)
{
    static uint64_t seed = 1;
    uint64_t z = seed += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
}

/* Half of them uniform over the hemisphere, half near the horizon. */
static void random_direction(float direction[3])
{
    double cosine = next_random() < 0.5 ? next_random() : pow(next_random(), 3.0) * 0.1 + 1e-3;
    double sine = sqrt(1.0 - cosine * cosine), about = 2.0 * PI * next_random();
    direction[0] = (float)(sine * cos(about));
    direction[1] = (float)(sine * sin(about));
    direction[2] = (float)cosine;
}

static struct probe_case random_case(void)
{
    struct probe_case c = {.roughness = (float)next_random(),
                           .metallic = (float)(next_random() < 0.5 ? 0.0 : next_random()),
                           .transmission = (float)(next_random() < 0.5 ? 0.0 : next_random()),
                           .ior = (float)(1.0 + 9.0 * pow(next_random(), 3.0)),
                           .base = (float)next_random()};
    random_direction(c.view);
    return c;
}

/* Where the shading normal is the geometric one. A normal that is bent by a map or between vertices makes any
 * BRDF non-reciprocal (Veach. Robust Monte Carlo Methods. 1997. 5.3), as the cosine is then not the true one. */
TEST(the_brdf_is_the_same_with_light_and_view_in_each_others_place)
{
    enum { PAIRS = 50000 };
    static struct probe_case cases[PAIRS];
    static float lights[PAIRS][4], there[PAIRS], back[PAIRS];
    double worst = 0.0, mean = 0.0;
    for (int i = 0; i < PAIRS; i++) {
        cases[i] = random_case();
        random_direction(lights[i]);
    }
    probe_run(*state, cases, PAIRS, lights, 1, true, there, NULL);
    for (int i = 0; i < PAIRS; i++) {
        float light[3];
        memcpy(light, lights[i], sizeof(light));
        memcpy(lights[i], cases[i].view, sizeof(light));
        memcpy(cases[i].view, light, sizeof(light));
    }
    probe_run(*state, cases, PAIRS, lights, 1, true, back, NULL);
    for (int i = 0; i < PAIRS; i++) {
        double a = (double)there[i], b = (double)back[i];
        worst = fmax(worst, fabs(a - b) / fmax(fmax(a, b), 1e-6));
        mean += a / PAIRS;
    }
    print_message("f(a, b) and f(b, a) differ by %.1e at most; mean of f %.3f\n", worst, mean);
    assert_true(mean > 0.05); /* they were not all black */
    /* 1 - F near the horizon is 1e-3 and the difference of two numbers with roundings of 6e-8, some in a row */
    assert_true(worst < 1e-3);
}

TEST(mirrored_scattered_and_refracted_never_add_up_to_more_than_one)
{
    enum { CASES = 50000 };
    static struct probe_case cases[CASES];
    static struct probe_split splits[CASES];
    static float ignored[CASES];
    const float up[1][4] = {{0.0f, 0.0f, 1.0f, 0.0f}};
    double maximum = 0.0;
    for (int i = 0; i < CASES; i++) {
        cases[i] = random_case();
        cases[i].inside = next_random() < 0.5 ? 1.0f : 0.0f;
    }
    probe_run(*state, cases, CASES, up, 1, false, ignored, splits);
    for (int i = 0; i < CASES; i++) {
        const struct probe_split *split = &splits[i];
        assert_true(split->mirror >= 0.0f && split->scattered >= 0.0f && split->refracted >= 0.0f);
        assert_true(split->mirror_ray >= 0.0f && split->mirror_ray <= 1.0f);
        maximum = fmax(maximum, (double)split->mirror + (double)split->scattered + (double)split->refracted);
    }
    print_message("maximum sum of the parts %.9f\n", maximum);
    assert_true(maximum <= 1.0 + 1e-6); /* three roundings */
}

/* One smooth boundary under one angle, from outside or (inside = 1) from the dense side; what it mirrors. */
static double mirrored(struct probe *probe, double cosine, double ior, float inside, double *refracted)
{
    const struct probe_case c = {.transmission = 1.0f,
                                 .ior = (float)ior,
                                 .view = {(float)sqrt(1.0 - cosine * cosine), 0.0f, (float)cosine},
                                 .base = 1.0f,
                                 .inside = inside};
    const float up[1][4] = {{0.0f, 0.0f, 1.0f, 0.0f}};
    struct probe_split split;
    float ignored;
    probe_run(probe, &c, 1, up, 1, false, &ignored, &split);
    *refracted = (double)split.refracted;
    return (double)split.mirror;
}

TEST(a_smooth_boundary_obeys_fresnels_equations)
{
    struct probe *probe = *state;
    double refracted, off = 0.0;
    for (double n = 1.0; n < 4.0; n += 0.23) {
        double normal = (n - 1.0) / (n + 1.0), brewster = (n * n - 1.0) / (n * n + 1.0);
        off = fmax(off, fabs(mirrored(probe, 1.0, n, 0.0f, &refracted) - normal * normal));
        off = fmax(off, fabs(refracted - (1.0 - normal * normal)));
        off = fmax(off, fabs(mirrored(probe, 1.0, n, 1.0f, &refracted) - normal * normal)); /* both ways alike */
        /* at tan = n nothing of the parallel half is mirrored, and (n^2-1)^2/(n^2+1)^2 of the other half */
        off = fmax(
            off, fabs(mirrored(probe, 1.0 / sqrt(1.0 + n * n), n, 0.0f, &refracted) - brewster * brewster / 2.0));
        for (double cosine = 0.05; cosine < 1.0; cosine += 0.05)
            off = fmax(off, fabs(mirrored(probe, cosine, n, 0.0f, &refracted) - fresnel(cosine, n)));
    }
    print_message("Fresnel's equations, at normal incidence, Brewster's angle and between: off by %.1e\n", off);
    assert_true(off < 3e-6); /* some ten roundings; towards the horizon the slope, here up to 10, is theirs too */
    /* at the horizon all is mirrored, and on the way there the loss falls in proportion to the cosine: 4 c (n^2+1)
     * / (2 sqrt(n^2-1)) */
    for (double cosine = 1e-3; cosine > 1e-4; cosine /= 2.0) {
        double loss = 1.0 - mirrored(probe, cosine, 1.5, 0.0f, &refracted);
        double expected = 2.0 * cosine * (1.5 * 1.5 + 1.0) / sqrt(1.5 * 1.5 - 1.0);
        assert_true(fabs(loss - expected) < expected * 10.0 * cosine + 1e-6); /* the next term; roundings */
    }
}

TEST(beyond_the_critical_angle_all_is_mirrored_and_before_it_what_fresnel_says)
{
    struct probe *probe = *state;
    double refracted, off = 0.0;
    for (double n = 1.1; n < 3.0; n += 0.2) {
        double critical = asin(1.0 / n);
        for (double step = 1e-3; step < 0.3; step *= 3.0) {
            assert_true(mirrored(probe, cos(critical + step), n, 1.0f, &refracted) == 1.0);
            assert_true(refracted == 0.0);
            double outside = asin(n * sin(critical - step)); /* the same boundary from the other side */
            double inner = mirrored(probe, cos(critical - step), n, 1.0f, &refracted);
            off = fmax(off, fabs(inner - fresnel(cos(outside), n)) * step);
            assert_true(refracted > 0.0);
        }
    }
    print_message("before the critical angle off by %.1e over the way to it\n", off);
    assert_true(off < 1e-6); /* the curve ends in a vertical tangent: a rounding grows as 1 / sqrt(step) */
}

static int setup(void **state)
{
    static struct probe probe;
    open_device(state);
    if (!device)
        return 0;
    probe_init(&probe, device);
    *state = &probe;
    return 0;
}

static int teardown(void **state)
{
    struct probe *probe = *state;
    probe_finish(probe);
    return close_device(state);
}
ALL_TESTS(setup, teardown)
