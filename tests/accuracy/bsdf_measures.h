/* SPDX-License-Identifier: MIT */
/* Measures of a material with the functions of bsdf_probe.h: whether chosen directions follow the stated
 * density, and the share of light that comes back. */
#ifndef FARLIGHT_TESTS_BSDF_MEASURES_H
#define FARLIGHT_TESTS_BSDF_MEASURES_H

#include "tests/accuracy/bsdf_probe.h"

#include "render/picture/sequence.h"
#include "tests/fixtures/device.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define PI 3.14159265358979323846
#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* The latter: GGX, with KHR_materials_specular, KHR_materials_clearcoat and KHR_materials_iridescence. */
enum { GGX, WARD, OTHER_MIRRORS, COATED, WITH_FILM, PROBES };
enum {
    NUMBERS = 1 << 15,
    ACROSS = 384,
    ABOUT = 256,
    DIRECTIONS = ACROSS * ABOUT,
    CELLS_ACROSS = 8,
    CELLS_ABOUT = 16
};

static struct bsdf_question numbers[NUMBERS], rays[DIRECTIONS]; /* made once */
static struct bsdf_answer answers[DIRECTIONS];

/* Numbers to choose by, stratified: what their means are off is at most as with independent ones. */
static inline void ask_numbers(struct bsdf_probe *probe)
{
    static bool is_made;
    for (uint32_t i = 0; i < NUMBERS && !is_made; i++) {
        sequence_pair(numbers[i].v, sequence_seed(1, 0, 7), 1, i);
        numbers[i].v[2] = sequence_number(sequence_seed(1, 0, 7), 2, i);
    }
    is_made = true;
    bsdf_probe_ask(probe, numbers, NUMBERS);
}

/* Equal steps of the cosine and of the angle about the normal: cells of one solid angle. */
static inline double cosine_at(double across)
{
    return across / ACROSS;
}

static inline void ask_directions(struct bsdf_probe *probe)
{
    static bool is_made;
    for (int a = 0; a < ACROSS && !is_made; a++)
        for (int b = 0; b < ABOUT; b++) {
            double z = cosine_at(a + 0.5), sine = sqrt(1.0 - z * z), phi = (b + 0.5) * 2.0 * PI / ABOUT;
            float *v = rays[a * ABOUT + b].v;
            v[0] = (float)(sine * cos(phi));
            v[1] = (float)(sine * sin(phi));
            v[2] = (float)z;
        }
    is_made = true;
    bsdf_probe_ask(probe, rays, DIRECTIONS);
}

static inline const char *case_name(const struct bsdf_case *c, bool ward)
{
    static char name[200];
    snprintf(name, sizeof(name),
             "%s, roughness %g, metallic %g, transmission %g, ior %g, %s, anisotropy %g, NoV %.3g",
             ward ? "ward" : "ggx", (double)c->roughness, (double)c->metallic, (double)c->transmission,
             (double)c->ior, c->inside > 0.0f ? "inside" : "outside", (double)c->anisotropy, (double)c->view[2]);
    return name;
}

static inline void set_eye(struct bsdf_case *c, double cosine)
{
    double sine = sqrt(1.0 - cosine * cosine);
    c->view[0] = (float)(sine * cos(0.7)); /* neither along the grain nor across it */
    c->view[1] = (float)(sine * sin(0.7));
    c->view[2] = (float)cosine;
}

/* Counts the choices with a stated probability in each cell of the hemisphere, and returns their sum. */
static inline double counts_of(const struct bsdf_answer *chosen, double cells[CELLS_ACROSS * CELLS_ABOUT])
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

static inline void hold_against_its_density(struct bsdf_probe *probe, const struct bsdf_case *c, bool ward,
                                            void *seen)
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

struct albedos {
    double max, max_dense, min_even[2], min_grain[2];
    char where[200];
};

static inline void sum_up(struct bsdf_probe *probe, const struct bsdf_case *c, bool ward, void *seen)
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

/* ---- all probes, for ALL_TESTS ---- */

static inline int bsdf_probes_open(void **state)
{
    static struct bsdf_probe probes[PROBES];
    static const char *const defines[PROBES] = {[WARD] = "WARD",
                                                [OTHER_MIRRORS] = "HAS_SPECULAR",
                                                [COATED] = "HAS_CLEARCOAT",
                                                [WITH_FILM] = "HAS_IRIDESCENCE"};
    if (!getenv("FARLIGHT_TEST_LONG")) { /* whose tests are long, all of them: no program is compiled for them */
        test_skip_file("left to make test-all");
        return 0;
    }
    open_device(state);
    if (!device)
        return 0;
    for (int i = 0; i < PROBES; i++)
        bsdf_probe_init(&probes[i], device, defines[i]);
    *state = probes;
    return 0;
}

static inline int bsdf_probes_close(void **state)
{
    struct bsdf_probe *probes = *state;
    for (int i = 0; i < PROBES; i++)
        bsdf_probe_finish(&probes[i]);
    return close_device(state);
}

#endif
