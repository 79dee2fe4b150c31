/* SPDX-License-Identifier: MIT */
/* The walk through layered depth cubes from surfaces on and through glass: against what is known of balls, boxes,
 * panes and rooms. */
#include "tests/unit/glass_scene.h"
#include "tests/unit/ldc_walk_fixture.h"

/* ---- rays that begin on surfaces ---- */

/* As integrators move origins off surfaces: by 2^-16 of the coordinates, here of the size of the cube. */
static void ray_on_sphere(struct ray *ray, const float centre[3], float radius, float extent, bool inwards,
                          float grazing, uint64_t *seed)
{
    float n[3], o[3], d[3], side = inwards ? -1.0f : 1.0f, z = test_uniform(seed, -0.999f, 0.999f),
                            phi = test_uniform(seed, 0, 2 * PI_F), cosine = 0;
    n[0] = sqrtf(1 - z * z) * cosf(phi), n[1] = z, n[2] = sqrtf(1 - z * z) * sinf(phi);
    for (int k = 0; k < 3; k++) {
        o[k] = centre[k] + n[k] * (radius + side * extent / 65536);
        d[k] = test_uniform(seed, -1, 1);
        cosine += d[k] * n[k];
    }
    for (int k = 0; k < 3; k++) /* of the part along the normal only its size and side */
        d[k] += n[k] * (side * fabsf(cosine) * grazing - cosine);
    *ray = ray_from(o, d, 0, FAR);
}

/* No ray that goes away from a ball outside hits it; and one that goes inside meets its other side, where a chord
 * ends. */
static void a_ray_does_not_hit_the_ball_that_it_leaves(void **state)
{
    (void)state;
    const float centre[3] = {0.1f, -0.05f, 0.2f}, radius = 1.3f, extent = 4;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 150, extent, -2, -2, -2);
    add_sphere(s, centre, radius, 400, 0); /* facets smaller than cells: it is round */
    uint64_t seed = 61;
    for (int inwards = 0; inwards < 2; inwards++) {
        /* Steep; any; almost along the surface: a chord of a few cells says nothing there. */
        for (int way = 0; way < (inwards ? 2 : 3); way++) {
            for (uint32_t i = 0; i < RAY_COUNT; i++)
                ray_on_sphere(&rays[i], centre, radius, extent, inwards,
                              way == 0   ? 3.0f
                              : way == 1 ? 1.0f
                                         : 0.02f,
                              &seed);
            build(&fixture, &forms[0].options);
            trace(&fixture, &forms[0].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
            uint32_t wrong = 0;
            for (uint32_t i = 0; i < RAY_COUNT; i++) {
                double b = 0, c = 0, a = 0;
                for (int k = 0; k < 3; k++) {
                    const double f = (double)rays[i].origin_t_min[k] - centre[k], d = rays[i].direction_t_max[k];
                    a += d * d, b += f * d, c += f * f;
                }
                const double chord = (-b + sqrt(fmax(b * b - a * (c - radius * radius), 0))) / a;
                const double cells = sqrt(a) / s->cell;
                if (!inwards)
                    wrong += hits[i].distance >= 0;
                else if (chord * cells > 4)
                    wrong += (uint32_t) !(fabs(hits[i].distance - chord) * cells < 0.5);
            }
            /* Where the images of two axes meet a plane may stick out, or a gap be left. */
            if (wrong > RAY_COUNT / 500)
                fail_msg("%u of %u rays are wrong, %s, way %d", wrong, RAY_COUNT, inwards ? "inwards" : "outwards",
                         way);
        }
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

/* A floor with a box that stands on it in the middle of a cell: from the floor, a cell and more from the box,
 * straight and steeply towards it. And along the floor, as low as integrators begin, which the floor must not
 * stop. */
static void what_stands_on_a_floor_is_met_from_a_cell_on(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    struct fixture fixture;
    uint64_t seed = 71;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 60, 60, 0, 0, 0);
    const float low = 10.3f;
    add_quad(s, (const float[3]){0, low, 0}, (const float[3]){0, low, 60}, (const float[3]){60, low, 60},
             (const float[3]){60, low, 0}, 0);
    add_box(s, (const float[3]){30.4f, low, 20.2f}, (const float[3]){45.7f, 30, 40.3f}, 0);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float away = i % 2 ? test_uniform(&seed, 1, 4) : test_uniform(&seed, 4, 28);
        const float o[3] = {30.4f - away, low + 60.0f / 65536, test_uniform(&seed, 24, 36)};
        const float rise = i % 4 == 0 ? 0 : test_uniform(&seed, 0, 1.5f);
        rays[i] =
            ray_from(o, (const float[3]){1, rise * 15 / (away + 15), test_uniform(&seed, -0.1f, 0.1f)}, 0, FAR);
    }
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(&fixture, &forms[f].options);
        trace(&fixture, &forms[f].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const float wall = 30.4f - rays[i].origin_t_min[0];
            if (wall * rays[i].direction_t_max[1] > 18) /* above the box, or at its edge */
                continue;
            if (!(fabsf(hits[i].distance - wall) < 1e-3f * wall + 1e-3f))
                fail_msg("%s: ray %u, %g cells from the wall, meets something at %g", forms[f].name, i,
                         (double)wall, (double)hits[i].distance);
        }
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

/* In the corner of a room: from beside a wall, nearer than a cell, into it. What would look through it would see
 * the sky along all its corners. */
static void a_wall_beside_the_origin_is_not_passed(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    struct fixture fixture;
    uint64_t seed = 81;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 60, 60, 0, 0, 0);
    const float low = 10.4f, wall = 20.3f;
    add_quad(s, (const float[3]){wall, low, 5}, (const float[3]){wall, low, 55}, (const float[3]){55, low, 55},
             (const float[3]){55, low, 5}, 0); /* seen from above */
    add_quad(s, (const float[3]){wall, low, 5}, (const float[3]){wall, 50, 5}, (const float[3]){wall, 50, 55},
             (const float[3]){wall, low, 55}, 0); /* seen from the right */
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float o[3] = {wall + test_uniform(&seed, 0.25f, 1), low + 60.0f / 65536,
                            test_uniform(&seed, 10, 50)};
        rays[i] =
            ray_from(o, (const float[3]){-1, test_uniform(&seed, 0.6f, 3), test_uniform(&seed, -1, 1)}, 0, FAR);
    }
    build(&fixture, &forms[0].options);
    trace(&fixture, &forms[0].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float away = rays[i].origin_t_min[0] - wall, above = away * rays[i].direction_t_max[1];
        /* Below, the wall may have no sample: it begins within the texel. */
        if (above > 1 && !(fabsf(hits[i].distance - away) < 1e-3f))
            fail_msg("ray %u: a wall at %g is met at %g", i, (double)away, (double)hits[i].distance);
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

/* ---- light that passes ---- */

/* Panes across each axis and askew: neighbouring samples' texels overlap, but a pane tints once. */
static void a_pane_of_glass_tints_once(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    uint32_t *visibility = malloc(RAY_COUNT * sizeof *visibility);
    struct fixture fixture;
    uint64_t seed = 91;
    fixture_init(&fixture, scene_of_glass());
    assert_true(fixture.gpu.has_transmission);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 64, 64, 0, 0, 0);
    for (int pane = 0; pane < 3; pane++) {
        const float x = 15 + 12 * (float)pane, lean = 9 * (float)(pane - 1);
        add_quad(s, (const float[3]){x - lean, 2, 2}, (const float[3]){x - lean, 2, 62},
                 (const float[3]){x + lean, 62, 62}, (const float[3]){x + lean, 62, 2}, 1);
    }
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float o[3] = {0.5f, test_uniform(&seed, 20, 44), test_uniform(&seed, 20, 44)};
        const float d[3] = {1, test_uniform(&seed, -0.3f, 0.3f), test_uniform(&seed, -0.3f, 0.3f)};
        rays[i] = ray_from(o, d, 0, FAR);
    }
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(&fixture, &forms[f].options);
        trace(&fixture, &forms[f].options, WAVE_ANY, rays, RAY_COUNT, NULL, visibility);
        for (uint32_t i = 0; i < RAY_COUNT; i++)
            if (!is_tint(visibility[i], 3))
                fail_msg("%s: ray %u: 0x%08x", forms[f].name, i, visibility[i]);
    }
    fixture_finish(&fixture);
    free(rays);
    free(visibility);
}

/* A ball is two crossings, also where the images of two axes meet, but where it is grazed. */
static void a_ball_of_glass_tints_twice(void **state)
{
    (void)state;
    const float centre[3] = {0, 0, 0}, radius = 1.2f;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    uint32_t *visibility = malloc(RAY_COUNT * sizeof *visibility), wrong = 0;
    struct fixture fixture;
    uint64_t seed = 95;
    fixture_init(&fixture, scene_of_glass());
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 128, 4, -2, -2, -2);
    add_sphere(s, centre, radius, 200, 1);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float o[3], d[3], length = 0;
        for (int k = 0; k < 3; k++) {
            o[k] = test_uniform(&seed, -1, 1);
            length += o[k] * o[k];
        }
        for (int k = 0; k < 3; k++) {
            o[k] *= 3 / sqrtf(length);
            d[k] = test_uniform(&seed, -0.6f, 0.6f) - o[k];
        }
        rays[i] = ray_from(o, d, 0, FAR);
    }
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(&fixture, &forms[f].options);
        trace(&fixture, &forms[f].options, WAVE_ANY, rays, RAY_COUNT, NULL, visibility);
        for (uint32_t i = 0; i < RAY_COUNT; i++)
            wrong += !is_tint(visibility[i], 2);
        /* Gaps where images meet: a few rays in a thousand pass through one. */
        if (wrong > RAY_COUNT / 200)
            fail_msg("%s: %u of %u rays are not tinted twice", forms[f].name, wrong, RAY_COUNT);
        wrong = 0;
    }
    fixture_finish(&fixture);
    free(rays);
    free(visibility);
}

/* ---- the paper's test ---- */

/* With a tolerance a hit is where the ray comes as near to a sample's depth, in its texel: rays straight down on a
 * slope meet samples' own depths; a tolerance of nearly nothing is passed by rays that are aslant. */
static void a_tolerance_takes_depths_for_planes(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    struct fixture fixture;
    uint64_t seed = 101;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 50, 50, 0, 0, 0);
    add_quad(s, (const float[3]){1, 1, 10}, (const float[3]){49, 1, 34}, (const float[3]){49, 49, 34},
             (const float[3]){1, 49, 10}, 0); /* z = 9.5 + x / 2 */
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float o[3] = {test_uniform(&seed, 5, 45), test_uniform(&seed, 5, 45), 60};
        rays[i] = ray_from(o, (const float[3]){0, 0, -1}, 0, FAR);
    }
    const struct tracer_options kinds[] = {{.ldc_tolerance = 0.01f},
                                           {.ldc_tolerance = 0.01f, .ldc_levels = LDC_LEVELS_BLOCKS},
                                           {.ldc_tolerance = 0.01f, .ldc_layers_together = 1}};
    for (size_t f = 0; f < sizeof kinds / sizeof *kinds; f++) {
        build(&fixture, &kinds[f]);
        trace(&fixture, &kinds[f], WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const float middle = floorf(rays[i].origin_t_min[0]) + 0.5f;
            if (fabsf(hits[i].distance - (60 - 9.5f - middle / 2)) > 1e-3f)
                fail_msg("kind %zu: ray %u at %g meets depth %g", f, i, (double)rays[i].origin_t_min[0],
                         60 - (double)hits[i].distance);
        }
    }
    /* Along the slope, half a cell above: within a tolerance of a cell, and not within one of a tenth. */
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        rays[i] =
            ray_from((const float[3]){2, test_uniform(&seed, 5, 45), 11.5f}, (const float[3]){1, 0, 0.5f}, 0, FAR);
    for (int wide = 0; wide < 2; wide++) {
        const struct tracer_options options = {.ldc_tolerance = wide ? 1.5f : 0.1f};
        build(&fixture, &options);
        trace(&fixture, &options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++)
            assert_true((hits[i].distance >= 0) == (wide == 1));
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ray_does_not_hit_the_ball_that_it_leaves),
        cmocka_unit_test(what_stands_on_a_floor_is_met_from_a_cell_on),
        cmocka_unit_test(a_wall_beside_the_origin_is_not_passed),
        cmocka_unit_test(a_pane_of_glass_tints_once),
        cmocka_unit_test(a_ball_of_glass_tints_twice),
        cmocka_unit_test(a_tolerance_takes_depths_for_planes),
    };
    RUN_ON_A_DEVICE(tests);
}
