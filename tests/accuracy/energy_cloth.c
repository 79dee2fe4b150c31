/* SPDX-License-Identifier: MIT */
/* Cloth, leaves, thin panes and glass that disperses keep the light that arrives: white ones are not seen in a
 * white furnace, in all integrators; and light finds the other side of a leaf. */
#include "tests/accuracy/path_fixture.h"
#include "tests/harness/test.h"

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static const struct way {
    const char *name;
    unsigned integrator, brdf;
} ways[] = {
    {"path, ggx", INTEGRATOR_PATH, BRDF_GGX},          {"path, ward", INTEGRATOR_PATH, BRDF_WARD},
    {"distributed", INTEGRATOR_DISTRIBUTED, BRDF_GGX}, {"whitted", INTEGRATOR_WHITTED, BRDF_GGX},
    {"raycast", INTEGRATOR_RAYCAST, BRDF_GGX},
};
enum { EVERY = COUNT(ways), ALL_BUT_RAYCAST = EVERY - 1, RANDOM_ONES = 3 };

static struct scene_material *white(struct fixture *fixture, float roughness, float ior)
{
    struct scene_material *material = fixture_material(fixture);
    material->roughness = roughness;
    material->ior = ior;
    return material;
}

/* The picture's mean, of each colour. */
struct colours {
    struct mean channel[3];
};

static struct colours render_by(struct fixture *fixture, const struct way *way, uint32_t samples)
{
    enum { BLOCKS = PIXELS / 16 };
    double blocks[3][BLOCKS] = {{0}};
    struct colours colours;
    fixture->request.integrator = way->integrator;
    fixture->request.brdf = way->brdf;
    fixture->request.layer_opacity = 1.0f; /* raycast shows what it meets first, as the others */
    fixture->request.samples =
        way->integrator == INTEGRATOR_WHITTED || way->integrator == INTEGRATOR_RAYCAST ? 1 : samples;
    struct frame_result result = fixture_render(fixture);
    for (int c = 0; c < 3; c++) {
        for (uint32_t i = 0; i < PIXELS; i++)
            blocks[c][i / EDGE / 4 * (EDGE / 4) + i % EDGE / 4] +=
                (double)fixture_pixel(&result, i % EDGE, i / EDGE)[c] / 16;
        colours.channel[c] = mean_of(blocks[c], BLOCKS);
    }
    frame_result_finish(&result);
    return colours;
}

/* White from all around. */
static void expect_white(struct fixture *fixture, size_t way_count, const char *what, double minimum)
{
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    for (size_t w = 0; w < way_count; w++) {
        struct colours colours = render_by(fixture, &ways[w], 8);
        const struct mean *mean = colours.channel;
        print_message("%-11s %s: %.4f %.4f %.4f (standard error %.4f)\n", ways[w].name, what, mean[0].value,
                      mean[1].value, mean[2].value, mean[0].error);
        for (int c = 0; c < 3; c++) {
            assert_true(mean[c].value < 1.0 + 5e-3 + 5.0 * mean[c].error);
            assert_true(mean[c].value > minimum - 5.0 * mean[c].error);
            assert_true(mean[c].error < 8e-3); /* else nothing is shown */
        }
    }
}

/* A ball fills the picture but for its corners. */
static void a_ball(struct fixture *fixture, const struct scene_material *material)
{
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 1.0f, material->base.id);
    fixture_look(fixture, 0.0f, 0.0f, 3.0f, 0.6f);
}

/* Fits of the fibres' light are too high by up to 0.017, so as much may be lost beneath them; those of facets by
 * 0.007. */
TEST(white_cloth_vanishes_in_a_furnace)
{
    static const struct {
        const char *name;
        float metallic, ior;
    } grounds[] = {{"on Lambert's", 0.0f, 1.0f}, {"on varnish", 0.0f, 1.5f}};
    struct fixture *fixture = *state;
    for (size_t g = 0; g < COUNT(grounds); g++)
        for (int step = 0; step < 3; step++) {
            char name[64];
            path_begin(fixture, TRACER_REFERENCE, 4);
            struct scene_material *cloth = white(fixture, 0.8f, grounds[g].ior);
            cloth->sheen[0] = cloth->sheen[1] = cloth->sheen[2] = 1.0f;
            cloth->sheen_roughness = 0.2f + 0.4f * (float)step;
            a_ball(fixture, cloth);
            snprintf(name, sizeof(name), "fibres %.1f rough %s", 0.2 + 0.4 * step, grounds[g].name);
            expect_white(fixture, EVERY, name, 0.975);
        }
}

/* Black cloth shows its fibres alone: what they send of a white world is their albedo, by the path that samples
 * them and by the fit that the others take. */
TEST(fibres_are_as_bright_in_all_integrators)
{
    struct fixture *fixture = *state;
    for (int step = 0; step < 3; step++) {
        double means[EVERY];
        path_begin(fixture, TRACER_REFERENCE, 4);
        struct scene_material *cloth = white(fixture, 1.0f, 1.0f);
        cloth->base_colour[0] = cloth->base_colour[1] = cloth->base_colour[2] = 0.0f;
        cloth->sheen[1] = 1.0f;
        cloth->sheen_roughness = 0.2f + 0.4f * (float)step;
        fixture_square(fixture, 50.0f, cloth->base.id, NULL);
        fixture_look(fixture, 5.0f, 0.0f, 1.5f, 0.1f);
        fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
        for (size_t w = 0; w < EVERY; w++) {
            struct colours colours = render_by(fixture, &ways[w], 64);
            means[w] = colours.channel[1].value;
            assert_true(colours.channel[0].value == 0.0);
        }
        print_message("fibres %.1f rough: path %.4f, distributed %.4f, whitted %.4f, raycast %.4f\n",
                      0.2 + 0.4 * step, means[0], means[2], means[3], means[4]);
        assert_true(means[3] > 0.15);
        for (size_t w = 0; w < EVERY; w++)
            assert_near(means[w], means[3], 0.02);
    }
}

TEST(lamps_light_cloth_alike_in_all_integrators)
{
    struct fixture *fixture = *state;
    double means[EVERY];
    path_begin(fixture, TRACER_REFERENCE, 4);
    struct scene_material *cloth = white(fixture, 0.6f, 1.5f);
    cloth->base_colour[1] = 0.5f;
    cloth->sheen[0] = cloth->sheen[1] = 0.8f;
    cloth->sheen_roughness = 0.4f;
    a_ball(fixture, cloth);
    fixture_light(fixture, LIGHT_POINT, 3.0f, 1.0f, 1.0f, 50.0f);
    for (size_t w = 0; w < EVERY; w++)
        means[w] = render_by(fixture, &ways[w], 64).channel[1].value;
    print_message("path %.4f, distributed %.4f, whitted %.4f, raycast %.4f\n", means[0], means[2], means[3],
                  means[4]);
    assert_near(means[0], means[3], 0.01 * means[3]);
    assert_near(means[2], means[3], 0.01 * means[3]);
    assert_near(means[4], means[3], 0.01 * means[3]); /* no shadow falls on a ball but its own */
}

/* ---- leaves ---- */

static struct scene_material *a_leaf(struct fixture *fixture, float share, float ior)
{
    struct scene_material *leaf = white(fixture, 1.0f, ior);
    leaf->diffuse_transmission = share;
    for (int c = 0; c < 3; c++)
        leaf->diffuse_transmission_colour[c] = 1.0f;
    fixture_square(fixture, 500.0f, leaf->base.id, NULL);
    fixture_look(fixture, 3.0f, 0.0f, 4.0f, 0.1f);
    return leaf;
}

TEST(white_leaves_vanish_in_a_furnace)
{
    static const float shares[] = {0.5f, 1.0f}, iors[] = {1.0f, 1.5f};
    struct fixture *fixture = *state;
    for (size_t s = 0; s < COUNT(shares); s++)
        for (size_t i = 0; i < COUNT(iors); i++) {
            char name[64];
            path_begin(fixture, TRACER_REFERENCE, 4);
            a_leaf(fixture, shares[s], iors[i]);
            snprintf(name, sizeof(name), "leaf, share %.1f, index %.1f", (double)shares[s], (double)iors[i]);
            expect_white(fixture, EVERY, name, 0.985);
        }
}

/* Lambert's law, of the light that arrives behind: what is left of an irradiance E is share E / pi, in the colour
 * of what passes, not of the leaf. All kinds of light are found there. */
TEST(a_leaf_shines_with_the_light_behind_it)
{
    static const enum light_kind kinds[] = {LIGHT_POINT, LIGHT_RECTANGLE, LIGHT_SPHERE};
    struct fixture *fixture = *state;
    for (size_t k = 0; k < COUNT(kinds); k++) {
        double irradiance = 0.0;
        path_begin(fixture, TRACER_REFERENCE, 2);
        struct scene_material *leaf = a_leaf(fixture, 0.4f, 1.0f);
        leaf->base_colour[0] = 0.0f;
        leaf->diffuse_transmission_colour[1] = 0.5f;
        fixture_look(fixture, 0.0f, 0.0f, 4.0f, 0.01f);
        struct scene_light *light = fixture_light(fixture, kinds[k], 0.0f, 0.0f, -4.0f, 20.0f);
        if (kinds[k] == LIGHT_RECTANGLE) { /* which shines along -z of its node: turned about */
            static const float turned[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -4};
            memcpy(fixture->edits[fixture->edit_count - 1].set.node.parent_from_node, turned, sizeof(turned));
            light->size[0] = light->size[1] = 0.5f;
            irradiance = 20.0 * 0.25 / 16.0;
        } else if (kinds[k] == LIGHT_SPHERE) {
            light->size[0] = 0.5f;
            irradiance = 20.0 * PI * 0.25 / 16.0;
        } else {
            irradiance = 20.0 / 16.0;
        }
        for (size_t w = 0; w < EVERY; w++) {
            struct colours colours = render_by(fixture, &ways[w], 64);
            print_message("%-11s, light %d: %.5f %.5f, of %.5f\n", ways[w].name, (int)kinds[k],
                          colours.channel[0].value, colours.channel[1].value, 0.4 * irradiance / PI);
            assert_mean(colours.channel[0], 0.4 * irradiance / PI, 0.01 * irradiance);
            assert_mean(colours.channel[1], 0.2 * irradiance / PI, 0.01 * irradiance);
        }
    }
}

/* Between two halves of the world, one white and one black, a leaf that sends half of the light on is alike on
 * both sides; emissive triangles behind it, which are met by paths and asked for, are found once. */
TEST(a_leaf_is_lit_by_surfaces_behind_it_once)
{
    static const float behind[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1};
    struct fixture *fixture = *state;
    double means[RANDOM_ONES];
    path_begin(fixture, TRACER_REFERENCE, 2);
    struct scene_material *leaf = a_leaf(fixture, 0.5f, 1.0f);
    leaf->base_colour[0] = leaf->base_colour[1] = leaf->base_colour[2] = 0.0f;
    fixture_look(fixture, 0.0f, 0.0f, 4.0f, 0.01f);
    struct scene_material *panel = fixture_material(fixture);
    panel->base_colour[0] = panel->base_colour[1] = panel->base_colour[2] = 0.0f;
    panel->emission[0] = panel->emission[1] = panel->emission[2] = 3.0f;
    fixture_square(fixture, 1.0f, panel->base.id, behind);
    /* Of a square of half width 1 at a distance of 1, over a point of its axis: the view factor. */
    double factor = 4.0 / PI / sqrt(2.0) * atan(1.0 / sqrt(2.0));
    for (size_t w = 0; w < RANDOM_ONES; w++) {
        struct colours colours = render_by(fixture, &ways[w], 64);
        means[w] = colours.channel[1].value;
        print_message("%-11s: %.4f of %.4f\n", ways[w].name, means[w], 0.5 * 3.0 * factor);
        assert_mean(colours.channel[1], 0.5 * 3.0 * factor, 0.002);
    }
}

/* ---- thin panes ---- */

/* Whatever its roughness; what is seen through a smooth one is not displaced. */
TEST(white_thin_panes_vanish_in_a_furnace)
{
    struct fixture *fixture = *state;
    for (int step = 0; step < 3; step++) {
        char name[64];
        path_begin(fixture, TRACER_REFERENCE, 4);
        struct scene_material *pane = white(fixture, 0.4f * (float)step, 1.5f);
        pane->transmission = 1.0f;
        pane->thin_walled = true;
        fixture_square(fixture, 50.0f, pane->base.id, NULL);
        fixture_look(fixture, 3.0f, 0.0f, 2.0f, 0.3f);
        snprintf(name, sizeof(name), "thin pane, roughness %.1f", 0.4 * step);
        expect_white(fixture, ALL_BUT_RAYCAST, name, 0.98);
    }
}

static double fresnel(double cosine, double n)
{
    double sine = sqrt(1.0 - cosine * cosine), bent = sqrt(1.0 - sine * sine / (n * n));
    double s = (cosine - n * bent) / (cosine + n * bent), p = (n * cosine - bent) / (n * cosine + bent);
    return (s * s + p * p) / 2.0;
}

/* A ball that only shows itself, 0.2 degrees wide, at `distance` from the origin under an angle from -z. */
static void a_mark(struct fixture *fixture, double angle, double distance)
{
    struct scene_material *mark = fixture_material(fixture);
    mark->unlit = true;
    fixture_sphere(fixture, (float)(-distance * sin(angle)), 0.0f, (float)(-distance * cos(angle)),
                   (float)(distance * 0.0017), mark->base.id);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 900.0f, 1e-9f); /* else there is a sky */
}

/* From both of its sides, at a slant, what is straight ahead is seen, less what one boundary mirrors, in its
 * colour. */
TEST(a_thin_pane_displaces_nothing)
{
    struct fixture *fixture = *state;
    const double angle = 1.1;
    for (int side = -1; side <= 1; side += 2)
        for (size_t w = 0; w < ALL_BUT_RAYCAST; w++) {
            path_begin(fixture, TRACER_REFERENCE, 4);
            struct scene_material *pane = white(fixture, 0.0f, 1.5f);
            pane->base_colour[1] = 0.5f;
            pane->transmission = 1.0f;
            pane->thin_walled = true;
            const float turned[12] = {(float)side, 0, 0, 0, 0, 1, 0, 0, 0, 0, (float)side, 0};
            fixture_square(fixture, 50.0f, pane->base.id, turned);
            a_mark(fixture, angle, 5.0);
            fixture_look(fixture, (float)(3.0 * sin(angle)), 0.0f, (float)(3.0 * cos(angle)), 0.0005f);
            struct colours colours = render_by(fixture, &ways[w], 64);
            assert_mean(colours.channel[0], 1.0 - fresnel(cos(angle), 1.5), 1e-4);
            assert_mean(colours.channel[1], 0.5 * (1.0 - fresnel(cos(angle), 1.5)), 1e-4);
        }
}

/* ---- dispersion ---- */

/* KHR_materials_dispersion: red, green and blue are bent by indices that are 0.025 (n - 1) dispersion apart. Where
 * one of them goes, there is a mark, which is seen in this colour alone. */
TEST(each_colour_is_bent_by_its_own_index)
{
    struct fixture *fixture = *state;
    const double slant = 1.0, apart = 0.025 * 0.6 * 4.0;
    for (size_t w = 0; w < RANDOM_ONES; w++)
        for (int c = 0; c < 3; c++) {
            path_begin(fixture, TRACER_REFERENCE, 2);
            struct scene_material *glass = white(fixture, 0.0f, 1.6f);
            glass->transmission = 1.0f;
            glass->dispersion = 4.0f;
            fixture_square(fixture, 50.0f, glass->base.id, NULL);
            a_mark(fixture, asin(sin(slant) / (1.6 + apart * (c - 1))), 5.0);
            fixture_look(fixture, (float)(3.0 * sin(slant)), 0.0f, (float)(3.0 * cos(slant)), 0.0005f);
            struct colours colours = render_by(fixture, &ways[w], 64);
            for (int other = 0; other < 3; other++)
                assert_mean(colours.channel[other], other == c ? 1.0 - fresnel(cos(slant), 1.6) : 0.0, 1e-4);
        }
}

TEST(white_glass_that_disperses_vanishes_in_a_furnace)
{
    struct fixture *fixture = *state;
    for (int step = 0; step < 2; step++) {
        char name[64];
        path_begin(fixture, TRACER_REFERENCE, 32);
        struct scene_material *glass = white(fixture, 0.3f * (float)step, 1.5f);
        glass->transmission = 1.0f;
        glass->dispersion = 5.0f;
        a_ball(fixture, glass);
        snprintf(name, sizeof(name), "dispersing ball, roughness %.1f", 0.3 * step);
        expect_white(fixture, RANDOM_ONES, name, 0.98);
    }
}
