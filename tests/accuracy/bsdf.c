/* SPDX-License-Identifier: MIT */
/* The path integrator's model of a surface: chosen directions have the stated probabilities, which integrate
 * to 1, and bring back no more light than arrives, with GGX and with Ward's lobe, along a grain and without
 * one. */
#include "tests/accuracy/bsdf_measures.h"
#include "tests/harness/test.h"

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
                        set_eye(&c, cosines[v]);
                        look_at(&probes[ward], &c, ward, seen);
                    }
}

/* ---- what is chosen ---- */

TEST_LONG(sampled_directions_follow_the_stated_density)
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

/* Light between rough facets leaves the surface again, by fits that are within 0.007 (the polynomials of
 * facet_albedo.glsl), or 0.025 above an index of 2.4. Along a grain a fit for facets without grain stands in:
 * it is off by up to 0.05, and chosen so that no more light leaves than arrives. */
TEST_LONG(white_materials_send_on_what_arrives_and_no_more)
{
    static const float roughnesses[] = {0.0f, 0.15f, 0.5f, 1.0f, 0.05f, 0.3f, 0.7f, 0.85f};
    struct albedos albedos = {.min_even = {1, 1}, .min_grain = {1, 1}};
    visit_materials(*state, roughnesses, COUNT(roughnesses), sum_up, &albedos);
    print_message("maximum albedo, less five standard errors: %.5f (%s), of an index of 4 %.5f\n", albedos.max,
                  albedos.where, albedos.max_dense);
    for (int ward = 0; ward < 2; ward++) {
        print_message("%s, minimum albedo, and five standard errors: %.3f, with a grain %.3f\n",
                      ward ? "ward" : "ggx", albedos.min_even[ward], albedos.min_grain[ward]);
        assert_true(albedos.min_even[ward] > 0.985);
        assert_true(albedos.min_grain[ward] > 0.965);
    }
    assert_true(albedos.max <= 1.0 + 1e-3);
    assert_true(albedos.max_dense <= 1.0 + 0.025);
}

/* ---- light and view in each other's place ---- */

TEST_LONG(reflectance_is_the_same_both_ways)
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

TEST_LONG(ggx_is_that_of_the_other_integrators)
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
                set_eye(&c, cosines[v]);
                struct bsdf_probe *probe = &probes[kind == 4 ? COATED : GGX];
                bsdf_probe_run(probe, &c, false, DIRECTIONS, answers);
                for (int i = 0; i < DIRECTIONS; i++)
                    off = fmax(off, fabs((double)(answers[i].sent - answers[i].of)) /
                                        fmax((double)answers[i].of, 1e-2));
            }
    print_message("off by %.1e at most\n", off);
    assert_true(off < 1e-4);
}

/* ---- mirrors and layers of glTF's extensions ---- */

/* KHR_materials_specular, clearcoat and iridescence: mirrors weaker than Fresnel's equations have it, stronger,
 * none, and one that takes all; coats; films, of which those of 400 nm bend most. Bounds of albedos: fits' 0.007,
 * and of coats over rough metal those of common/coat.glsl; of rough facets under films three stand in for all,
 * which is off by up to 0.01 (common/film.glsl); over metal what a film does not mirror is gone. */
static const struct layered {
    struct bsdf_case c;
    int probe;
    double albedo_min, albedo_max;
} layered[] = {
    {{.ior = 1.5f, .specular = 0.5f, .specular_colour = 1.0f}, OTHER_MIRRORS, 0.985, 1.001},
    {{.ior = 1.5f, .specular = 1.0f, .specular_colour = 6.0f}, OTHER_MIRRORS, 0.985, 1.001},
    {{.ior = 1.5f, .specular = 0.0f, .specular_colour = 1.0f}, OTHER_MIRRORS, 0.985, 1.001},
    {{.ior = 1.5f, .specular = 1.0f, .specular_colour = 25.0f}, OTHER_MIRRORS, 0.985, 1.001},
    {{.ior = 1.5f, .transmission = 1.0f, .specular = 0.5f, .specular_colour = 6.0f}, OTHER_MIRRORS, 0.985, 1.001},
    {{.metallic = 1.0f, .ior = 1.5f, .coat = 1.0f, .coat_roughness = 0.0f}, COATED, 0.945, 1.012},
    {{.metallic = 1.0f, .ior = 1.5f, .coat = 1.0f, .coat_roughness = 0.9f}, COATED, 0.945, 1.012},
    {{.ior = 1.5f, .coat = 1.0f, .coat_roughness = 0.4f}, COATED, 0.945, 1.012},
    {{.transmission = 1.0f, .ior = 1.5f, .coat = 1.0f, .coat_roughness = 0.4f}, COATED, 0.945, 1.012},
    /* A turned coat mirrors some light into the surface: its density alone is asked for. */
    {{.metallic = 0.5f, .ior = 1.5f, .coat = 1.0f, .coat_roughness = 0.4f, .coat_turn = 0.3f}, COATED, 0.0, 1.012},
    {{.ior = 1.5f, .film = 1.0f, .film_ior = 1.3f, .film_nm = 400.0f}, WITH_FILM, 0.98, 1.01},
    {{.ior = 1.5f, .film = 1.0f, .film_ior = 1.8f, .film_nm = 400.0f}, WITH_FILM, 0.98, 1.01},
    {{.ior = 1.5f, .film = 1.0f, .film_ior = 1.8f, .film_nm = 1200.0f}, WITH_FILM, 0.98, 1.01},
    {{.ior = 1.5f, .transmission = 1.0f, .film = 1.0f, .film_ior = 1.8f, .film_nm = 300.0f},
     WITH_FILM,
     0.98,
     1.01},
    {{.ior = 1.5f, .metallic = 1.0f, .film = 1.0f, .film_ior = 2.0f, .film_nm = 250.0f}, WITH_FILM, 0.0, 1.001},
};

TEST_LONG(layers_follow_their_density_and_keep_the_light)
{
    static const float roughnesses[] = {0.1f, 0.4f, 0.9f};
    static const double cosines[] = {1.0, 0.6, 0.2};
    struct bsdf_probe *probes = *state;
    for (size_t k = 0; k < COUNT(layered); k++) {
        struct densities densities = {0};
        struct albedos albedos = {.min_even = {1, 1}, .min_grain = {1, 1}};
        for (size_t r = 0; r < COUNT(roughnesses); r++)
            for (size_t v = 0; v < COUNT(cosines); v++) {
                struct bsdf_case c = layered[k].c;
                c.roughness = roughnesses[r];
                c.base = 1.0f;
                set_eye(&c, cosines[v]);
                sum_up(&probes[layered[k].probe], &c, false, &albedos);
                if (v == 1 && r > 0 &&
                    (c.coat <= 0.0f || c.coat_roughness > 0.0f)) /* smooth lobes have no density */
                    hold_against_its_density(&probes[layered[k].probe], &c, false, &densities);
            }
        print_message("row %zu: %.1f deviations off at most; albedo %.3f to %.5f (%s)\n", k, densities.max_z,
                      albedos.min_even[0], albedos.max, albedos.where);
        assert_true(densities.max_z < 5.5); /* the bound from above */
        assert_true(densities.max_weight_off < 1e-4);
        assert_true(albedos.max <= layered[k].albedo_max);
        assert_true(albedos.min_even[0] > layered[k].albedo_min);
    }
}

ALL_TESTS(bsdf_probes_open, bsdf_probes_close)
