/* SPDX-License-Identifier: MIT */
/* Mirrors and layers that glTF's extensions bring, as the path integrator takes them: KHR_materials_specular,
 * clearcoat and iridescence follow their density and keep the light. */
#include "tests/accuracy/bsdf_measures.h"
#include "tests/harness/test.h"

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

ALL_TESTS(bsdf_probes_open, bsdf_probes_close)
