/* SPDX-License-Identifier: MIT */
/* What the path integrator takes a surface to be: the directions that it chooses are as probable as it says,
 * integrate to 1, and bring back no more than arrives, with GGX and with Ward's lobe, along a grain and without
 * one. */
#include "tests/accuracy/bsdf_probe.h"

#include "render/sequence.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define PI 3.14159265358979323846
#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

enum { SCATTERED, MIRRORED, REFRACTED }; /* BSDF_* */
/* The latter: GGX, with KHR_materials_specular, KHR_materials_clearcoat and KHR_materials_iridescence. */
enum { GGX, WARD, OTHER_MIRRORS, COATED, WITH_FILM, PROBES };
enum {
    NUMBERS = 1 << 15,
    ACROSS = 768,
    ABOUT = 512,
    DIRECTIONS = ACROSS * ABOUT,
    CELLS_ACROSS = 8,
    CELLS_ABOUT = 16
};

static struct bsdf_question questions[DIRECTIONS];
static struct bsdf_answer answers[DIRECTIONS];

/* Numbers to choose by, stratified: what their means are off is at most as with independent ones. */
static void ask_numbers(struct bsdf_probe *probe)
{
    for (uint32_t i = 0; i < NUMBERS; i++) {
        sequence_pair(questions[i].v, sequence_seed(1, 0, 7), 1, i);
        questions[i].v[2] = sequence_number(sequence_seed(1, 0, 7), 2, i);
    }
    bsdf_probe_ask(probe, questions, NUMBERS);
}

/* Equal steps of the cosine and of the angle about the normal: cells of one solid angle. */
static double cosine_at(double across)
{
    return across / ACROSS;
}

static void ask_directions(struct bsdf_probe *probe)
{
    for (int a = 0; a < ACROSS; a++)
        for (int b = 0; b < ABOUT; b++) {
            double z = cosine_at(a + 0.5), sine = sqrt(1.0 - z * z), phi = (b + 0.5) * 2.0 * PI / ABOUT;
            float *v = questions[a * ABOUT + b].v;
            v[0] = (float)(sine * cos(phi));
            v[1] = (float)(sine * sin(phi));
            v[2] = (float)z;
        }
    bsdf_probe_ask(probe, questions, DIRECTIONS);
}

static const char *case_name(const struct bsdf_case *c, bool ward)
{
    static char name[200];
    snprintf(name, sizeof(name),
             "%s, roughness %g, metallic %g, transmission %g, ior %g, %s, anisotropy %g, NoV %.3g",
             ward ? "ward" : "ggx", (double)c->roughness, (double)c->metallic, (double)c->transmission,
             (double)c->ior, c->inside > 0.0f ? "inside" : "outside", (double)c->anisotropy, (double)c->view[2]);
    return name;
}

static void look_from(struct bsdf_case *c, double cosine)
{
    double sine = sqrt(1.0 - cosine * cosine);
    c->view[0] = (float)(sine * cos(0.7)); /* neither along the grain nor across it */
    c->view[1] = (float)(sine * sin(0.7));
    c->view[2] = (float)cosine;
}

/* Visits white materials. */
typedef void look(struct bsdf_probe *probe, const struct bsdf_case *c, bool ward, void *seen);
static void visit_materials(struct bsdf_probe probes[2], const float *roughnesses, size_t roughness_count,
                            look *look_at, void *seen)
{
    static const struct bsdf_case kinds[] = {
        {.metallic = 1.0f, .ior = 1.5f},
        {.ior = 1.5f},
        {.ior = 1.0f},
        {.metallic = 0.5f, .ior = 1.5f},
        {.ior = 4.0f},
        {.transmission = 1.0f, .ior = 1.5f},
        {.transmission = 0.5f, .ior = 1.5f},
        {.transmission = 1.0f, .ior = 1.5f, .inside = 1.0f},
        {.transmission = 0.5f, .ior = 1.5f, .inside = 1.0f},
    };
    static const float anisotropies[] = {0.0f, 0.6f};
    static const double cosines[] = {1.0, 0.7, 0.3, 0.08};
    for (int ward = 0; ward < 2; ward++)
        for (size_t r = 0; r < roughness_count; r++)
            for (size_t k = 0; k < COUNT(kinds); k++)
                for (size_t a = 0; a < COUNT(anisotropies); a++)
                    for (size_t v = 0; v < COUNT(cosines); v++) {
                        struct bsdf_case c = kinds[k];
                        c.roughness = roughnesses[r];
                        c.anisotropy = anisotropies[a];
                        c.base = 1.0f;
                        look_from(&c, cosines[v]);
                        look_at(&probes[ward], &c, ward, seen);
                    }
}

/* ---- what is chosen ---- */

/* Of the choices that say how probable they were, how many go to each cell of the hemisphere; in all. */
static double counts_of(const struct bsdf_answer *chosen, double cells[CELLS_ACROSS * CELLS_ABOUT])
{
    double all = 0.0;
    memset(cells, 0, CELLS_ACROSS * CELLS_ABOUT * sizeof(*cells));
    for (int i = 0; i < NUMBERS; i++) {
        if (!(chosen[i].probability > 0.0f) || !(chosen[i].direction[2] > 0.0f))
            continue;
        double phi = atan2((double)chosen[i].direction[1], (double)chosen[i].direction[0]) / (2.0 * PI);
        int across = (int)((double)chosen[i].direction[2] * CELLS_ACROSS),
            about = (int)((phi < 0.0 ? phi + 1.0 : phi) * CELLS_ABOUT);
        across = across < CELLS_ACROSS ? across : CELLS_ACROSS - 1;
        about = about < CELLS_ABOUT ? about : CELLS_ABOUT - 1;
        cells[across * CELLS_ABOUT + about] += 1.0;
        all += 1.0;
    }
    return all;
}

struct densities {
    double max_z, sum_off, max_weight_off;
    size_t cases;
    char where[200];
};

static void hold_against_its_density(struct bsdf_probe *probe, const struct bsdf_case *c, bool ward, void *seen)
{
    struct densities *densities = seen;
    static struct bsdf_answer chosen[NUMBERS];
    static double counts[CELLS_ACROSS * CELLS_ABOUT], expected[CELLS_ACROSS * CELLS_ABOUT];
    memset(expected, 0, sizeof(expected));
    ask_numbers(probe);
    bsdf_probe_run(probe, c, true, NUMBERS, chosen);
    double all = counts_of(chosen, counts), sum = 0.0;
    ask_directions(probe);
    bsdf_probe_run(probe, c, false, DIRECTIONS, answers);
    for (int a = 0; a < ACROSS; a++)
        for (int b = 0; b < ABOUT; b++) {
            double share = (double)answers[a * ABOUT + b].probability * (2.0 * PI / DIRECTIONS);
            expected[a * CELLS_ACROSS / ACROSS * CELLS_ABOUT + b * CELLS_ABOUT / ABOUT] += share * NUMBERS;
            sum += share;
        }
    densities->cases++;
    /* A choice of the lobe is one number, stratified on its own; the share below the horizon is one of two more.
     */
    double off = fabs(sum - all / NUMBERS);
    densities->sum_off = fmax(densities->sum_off, off);
    if (off > 5.0 * sqrt(0.25 / NUMBERS) + 2e-3)
        fail_msg("%s: chosen %.5f, its density integrates to %.5f", case_name(c, ward), all / NUMBERS, sum);
    for (int i = 0; i < CELLS_ACROSS * CELLS_ABOUT; i++) {
        /* Poisson's deviation, and 1 % for the quadrature where a lobe is steep across a cell's edge */
        double z = fabs(counts[i] - expected[i]) / (sqrt(expected[i] + 1.0) + 0.01 * expected[i]);
        if (z > densities->max_z) {
            densities->max_z = z;
            snprintf(densities->where, sizeof(densities->where), "%s", case_name(c, ward));
        }
    }
    for (int i = 0; i < NUMBERS; i++)
        if (chosen[i].probability > 0.0f && chosen[i].sent > 0.0f)
            densities->max_weight_off =
                fmax(densities->max_weight_off,
                     fabs((double)(chosen[i].weight * chosen[i].probability / chosen[i].sent) - 1.0));
}

TEST(sampled_directions_follow_the_stated_density)
{
    static const float roughnesses[] = {0.45f, 0.7f, 1.0f};
    struct densities densities = {0};
    visit_materials(*state, roughnesses, COUNT(roughnesses), hold_against_its_density, &densities);
    print_message("%zu cases: of a cell's count %.1f deviations off at most (%s), of all %.1e\n", densities.cases,
                  densities.max_z, densities.where, densities.sum_off);
    /* 432 cases of 128 cells: independent counts are beyond 5.5 deviations once in 500 such tests */
    assert_true(densities.max_z < 5.5);
    assert_true(densities.max_weight_off < 1e-4); /* roundings */
}

/* ---- how much comes back ---- */

struct albedos {
    double max, max_dense, min_even[2], min_grain[2];
    char where[200];
};

static void sum_up(struct bsdf_probe *probe, const struct bsdf_case *c, bool ward, void *seen)
{
    struct albedos *albedos = seen;
    double sum = 0.0, squares = 0.0;
    ask_numbers(probe);
    bsdf_probe_run(probe, c, true, NUMBERS, answers);
    for (int i = 0; i < NUMBERS; i++) {
        double weight = (double)answers[i].weight;
        sum += weight;
        squares += weight * weight;
    }
    double albedo = sum / NUMBERS, error = sqrt(fmax(squares / NUMBERS - albedo * albedo, 0.0) / NUMBERS);
    double *max = c->ior > 2.4f ? &albedos->max_dense : &albedos->max;
    double *min = c->anisotropy > 0.0f ? albedos->min_grain : albedos->min_even;
    if (max == &albedos->max && albedo - 5.0 * error > *max)
        snprintf(albedos->where, sizeof(albedos->where), "%s", case_name(c, ward));
    *max = fmax(*max, albedo - 5.0 * error);
    min[ward] = fmin(min[ward], albedo + 5.0 * error);
}

/* What rough facets send into each other comes out again: as fits of it say, which are within 0.007 (the
 * polynomials of facet_albedo.glsl), 0.025 where the index is above 2.4. Along a grain a fit for facets without
 * one stands in: it is off by up to 0.05, and chosen so that no more comes out than went in. */
TEST(white_materials_send_on_what_arrives_and_no_more)
{
    static const float roughnesses[] = {0.0f, 0.05f, 0.15f, 0.3f, 0.5f, 0.7f, 0.85f, 1.0f};
    struct albedos albedos = {.min_even = {1, 1}, .min_grain = {1, 1}};
    visit_materials(*state, roughnesses, COUNT(roughnesses), sum_up, &albedos);
    print_message("maximum albedo, less five standard errors: %.5f (%s), of an index of 4 %.5f\n", albedos.max,
                  albedos.where, albedos.max_dense);
    for (int ward = 0; ward < 2; ward++) {
        print_message("%s, minimum albedo, and five standard errors: %.3f, with a grain %.3f\n",
                      ward ? "ward" : "ggx", albedos.min_even[ward], albedos.min_grain[ward]);
        assert_true(albedos.min_even[ward] > 0.985);
        assert_true(albedos.min_grain[ward] > 0.945);
    }
    assert_true(albedos.max <= 1.0 + 1e-3);
    assert_true(albedos.max_dense <= 1.0 + 0.025);
}

/* A mirror weaker than Fresnel's equations have it, a stronger one, none, one that takes all, and a weaker one on
 * glass. */
TEST(other_mirrors_follow_their_density_and_keep_the_light)
{
    static const struct bsdf_case kinds[] = {
        {.ior = 1.5f, .specular = 0.5f, .specular_colour = 1.0f},
        {.ior = 1.5f, .specular = 1.0f, .specular_colour = 6.0f},
        {.ior = 1.5f, .specular = 0.0f, .specular_colour = 1.0f},
        {.ior = 1.5f, .specular = 1.0f, .specular_colour = 25.0f},
        {.ior = 1.5f, .transmission = 1.0f, .specular = 0.5f, .specular_colour = 6.0f},
    };
    static const float roughnesses[] = {0.1f, 0.5f, 0.9f};
    struct bsdf_probe *probe = &((struct bsdf_probe *)*state)[OTHER_MIRRORS];
    struct densities densities = {0};
    struct albedos albedos = {.min_even = {1, 1}, .min_grain = {1, 1}};
    for (size_t k = 0; k < COUNT(kinds); k++)
        for (size_t r = 0; r < COUNT(roughnesses); r++)
            for (int v = 0; v < 2; v++) {
                struct bsdf_case c = kinds[k];
                c.roughness = roughnesses[r];
                c.base = 1.0f;
                look_from(&c, v ? 0.3 : 1.0);
                sum_up(probe, &c, false, &albedos);
                if (r > 0) /* else a lobe is narrower than the grid of directions */
                    hold_against_its_density(probe, &c, false, &densities);
            }
    print_message("%zu cases: %.1f deviations off at most (%s); albedo %.3f to %.5f (%s)\n", densities.cases,
                  densities.max_z, densities.where, albedos.min_even[0], albedos.max, albedos.where);
    assert_true(densities.max_z < 5.5); /* as above */
    assert_true(densities.max_weight_off < 1e-4);
    assert_true(albedos.max <= 1.0 + 1e-3);
    assert_true(albedos.min_even[0] > 0.985);
}

/* White metal, plastic and glass under coats of any roughness. A rough metal's light that leaves at other angles
 * than the view is the hardest: the bounds are those of common/coat.glsl, with the fits' 0.007. */
TEST(a_coat_follows_its_density_and_keeps_the_light)
{
    static const struct bsdf_case kinds[] = {
        {.metallic = 1.0f, .ior = 1.5f},
        {.ior = 1.5f},
        {.transmission = 1.0f, .ior = 1.5f},
        {.metallic = 0.5f, .ior = 1.5f, .coat_turn = 0.3f},
    };
    static const float roughnesses[] = {0.0f, 0.4f, 0.9f};
    static const double cosines[] = {1.0, 0.6, 0.3, 0.1};
    struct bsdf_probe *probe = &((struct bsdf_probe *)*state)[COATED];
    struct densities densities = {0};
    struct albedos albedos = {.min_even = {1, 1}, .min_grain = {1, 1}};
    for (size_t k = 0; k < COUNT(kinds); k++)
        for (size_t r = 0; r < COUNT(roughnesses); r++)
            for (size_t o = 0; o < COUNT(roughnesses); o++)
                for (size_t v = 0; v < COUNT(cosines); v++) {
                    struct bsdf_case c = kinds[k];
                    c.roughness = roughnesses[r];
                    c.base = c.coat = 1.0f;
                    c.coat_roughness = roughnesses[o];
                    look_from(&c, cosines[v]);
                    if (c.coat_turn <= 0.0f) /* else some light is mirrored into the surface */
                        sum_up(probe, &c, false, &albedos);
                    if (v == 1 && r > 0 && o > 0) /* smooth lobes have no density */
                        hold_against_its_density(probe, &c, false, &densities);
                }
    print_message("%zu cases: %.1f deviations off at most (%s); albedo %.3f to %.5f (%s)\n", densities.cases,
                  densities.max_z, densities.where, albedos.min_even[0], albedos.max, albedos.where);
    assert_true(densities.max_z < 5.5); /* as above */
    assert_true(densities.max_weight_off < 1e-4);
    assert_true(albedos.max <= 1.0 + 0.012);
    assert_true(albedos.min_even[0] > 0.945);
}

/* Films over white plastic and glass keep all light, as what they do not mirror enters; over metal what they do
 * not mirror is gone. Of rough facets three stand in for all of them, which is off by up to 0.01
 * (shaders/common/film.glsl). The film of 400 nm bends most there: by one facet for all of them 1.044 came out. */
TEST(a_film_follows_its_density_and_makes_no_light)
{
    static const struct bsdf_case kinds[] = {
        {.ior = 1.5f, .film_ior = 1.3f, .film_nm = 400.0f},
        {.ior = 1.5f, .film_ior = 2.0f, .film_nm = 150.0f},
        {.ior = 1.5f, .film_ior = 1.8f, .film_nm = 400.0f},
        {.ior = 1.5f, .film_ior = 1.8f, .film_nm = 1200.0f},
        {.ior = 1.5f, .transmission = 1.0f, .film_ior = 1.8f, .film_nm = 300.0f},
        {.ior = 1.5f, .metallic = 1.0f, .film_ior = 1.3f, .film_nm = 400.0f},
        {.ior = 1.5f, .metallic = 1.0f, .film_ior = 2.0f, .film_nm = 250.0f},
    };
    static const float roughnesses[] = {0.0f, 0.4f, 0.7f, 0.9f};
    static const double cosines[] = {1.0, 0.6, 0.2};
    struct bsdf_probe *probe = &((struct bsdf_probe *)*state)[WITH_FILM];
    struct densities densities = {0};
    struct albedos albedos = {.min_even = {1, 1}, .min_grain = {1, 1}}, metals = albedos;
    for (size_t k = 0; k < COUNT(kinds); k++)
        for (size_t r = 0; r < COUNT(roughnesses); r++)
            for (size_t v = 0; v < COUNT(cosines); v++) {
                struct bsdf_case c = kinds[k];
                c.roughness = roughnesses[r];
                c.base = c.film = 1.0f;
                look_from(&c, cosines[v]);
                sum_up(probe, &c, false, c.metallic > 0.0f ? &metals : &albedos);
                if (v == 1 && r > 0)
                    hold_against_its_density(probe, &c, false, &densities);
            }
    print_message("%zu cases: %.1f deviations off at most (%s); albedo %.3f to %.5f (%s), of metal to %.5f\n",
                  densities.cases, densities.max_z, densities.where, albedos.min_even[0], albedos.max,
                  albedos.where, metals.max);
    assert_true(densities.max_z < 5.5); /* as above */
    assert_true(densities.max_weight_off < 1e-4);
    assert_true(albedos.max <= 1.0 + 0.01);
    assert_true(albedos.min_even[0] > 0.98);
    assert_true(metals.max <= 1.0 + 1e-3);
}

/* ---- light and view in each other's place ---- */

TEST(reflectance_is_the_same_both_ways)
{
    struct bsdf_probe *probes = *state;
    static const float roughnesses[] = {0.2f, 0.5f, 0.9f}, metallics[] = {0.0f, 0.5f, 1.0f};
    enum { VIEWS = 12 };
    double off = 0.0;
    for (int p = 0; p < PROBES; p++)
        for (size_t r = 0; r < COUNT(roughnesses); r++)
            for (size_t m = 0; m < COUNT(metallics); m++) {
                struct bsdf_question directions[VIEWS] = {0};
                struct bsdf_answer there[VIEWS][VIEWS];
                for (int i = 0; i < VIEWS; i++) {
                    double z = 0.1 + 0.88 * i / (VIEWS - 1), phi = 2.4 * i;
                    directions[i].v[0] = (float)(sqrt(1.0 - z * z) * cos(phi));
                    directions[i].v[1] = (float)(sqrt(1.0 - z * z) * sin(phi));
                    directions[i].v[2] = (float)z;
                }
                bsdf_probe_ask(&probes[p], directions, VIEWS);
                for (int i = 0; i < VIEWS; i++) {
                    struct bsdf_case c = {.roughness = roughnesses[r],
                                          .metallic = metallics[m],
                                          .ior = 1.5f,
                                          .base = 0.8f,
                                          .anisotropy = 0.5f,
                                          .specular = 0.5f,
                                          .specular_colour = 6.0f,
                                          .coat = 0.8f,
                                          .coat_roughness = 0.3f,
                                          .film = 0.7f,
                                          .film_ior = 1.8f,
                                          .film_nm = 350.0f};
                    memcpy(c.view, directions[i].v, sizeof(c.view));
                    bsdf_probe_run(&probes[p], &c, false, VIEWS, there[i]);
                }
                for (int i = 0; i < VIEWS; i++)
                    for (int j = 0; j < i; j++) {
                        double one = (double)(there[i][j].sent / directions[j].v[2]);
                        double other = (double)(there[j][i].sent / directions[i].v[2]);
                        off = fmax(off, fabs(one - other) / fmax(fmax(one, other), 1e-3));
                    }
            }
    print_message("off by %.1e at most\n", off);
    assert_true(off < 1e-3); /* slopes of facets are differences of directions: their roundings by alpha of 0.04 */
}

TEST(ggx_is_that_of_the_other_integrators)
{
    struct bsdf_probe *probes = *state;
    double off = 0.0;
    static const float roughnesses[] = {0.3f, 0.6f, 1.0f};
    static const double cosines[] = {0.95, 0.5, 0.15};
    ask_directions(&probes[GGX]);
    ask_directions(&probes[COATED]);
    for (size_t r = 0; r < COUNT(roughnesses); r++)
        for (int kind = 0; kind < 5; kind++) /* plastic and metal, both along a grain; coated plastic */
            for (size_t v = 0; v < COUNT(cosines); v++) {
                struct bsdf_case c = {.roughness = roughnesses[r],
                                      .metallic = (float)(kind % 2),
                                      .ior = 1.5f,
                                      .base = 0.7f,
                                      .anisotropy = kind / 2 == 1 ? 0.6f : 0.0f,
                                      .coat = 0.5f,
                                      .coat_roughness = 0.4f,
                                      .coat_turn = 0.3f};
                look_from(&c, cosines[v]);
                struct bsdf_probe *probe = &probes[kind == 4 ? COATED : GGX];
                bsdf_probe_run(probe, &c, false, DIRECTIONS, answers);
                for (int i = 0; i < DIRECTIONS; i++)
                    off = fmax(off, fabs((double)(answers[i].sent - answers[i].of)) /
                                        fmax((double)answers[i].of, 1e-2));
            }
    print_message("off by %.1e at most\n", off);
    assert_true(off < 1e-4);
}

static int setup(void **state)
{
    static struct bsdf_probe probes[PROBES];
    static const char *const defines[PROBES] = {[WARD] = "WARD",
                                                [OTHER_MIRRORS] = "HAS_SPECULAR",
                                                [COATED] = "HAS_CLEARCOAT",
                                                [WITH_FILM] = "HAS_IRIDESCENCE"};
    open_device(state);
    if (!device)
        return 0;
    for (int i = 0; i < PROBES; i++)
        bsdf_probe_init(&probes[i], device, defines[i]);
    *state = probes;
    return 0;
}

static int teardown(void **state)
{
    struct bsdf_probe *probes = *state;
    for (int i = 0; i < PROBES; i++)
        bsdf_probe_finish(&probes[i]);
    return close_device(state);
}
ALL_TESTS(setup, teardown)
