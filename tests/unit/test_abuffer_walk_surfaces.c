/* SPDX-License-Identifier: MIT */
/* The walk through A-buffers from surfaces on and through glass: against what is known of balls, boxes, panes and
 * rooms. */
#include "tests/unit/abuffer_walk_fixture.h"
#include "tests/unit/glass_scene.h"

#define CELLS 240u
#define VOXELS 16u

/* ---- rays that begin on surfaces ---- */

/* As integrators move origins off surfaces: by 2^-16 of the coordinates, here of the size of the cube. */
static void ray_on_ball(struct ray *ray, const double centre[3], double radius, bool inwards, double grazing,
                        uint64_t *seed)
{
    double n[3], o[3], d[3], side = inwards ? -1 : 1, z = (double)test_uniform(seed, -0.999f, 0.999f),
                             phi = (double)test_uniform(seed, 0, 2 * (float)PI_D), cosine = 0;
    n[0] = sqrt(1 - z * z) * cos(phi), n[1] = z, n[2] = sqrt(1 - z * z) * sin(phi);
    for (int k = 0; k < 3; k++) {
        o[k] = centre[k] + n[k] * (radius + side * CELLS / 65536);
        d[k] = (double)test_uniform(seed, -1, 1);
        cosine += d[k] * n[k];
    }
    for (int k = 0; k < 3; k++) /* of the part along the normal only its size and side */
        d[k] += n[k] * (side * fabs(cosine) * grazing - cosine);
    *ray = ray_from(o, d, 0, FAR);
}

static void a_ray_does_not_hit_the_ball_that_it_leaves(void **state)
{
    (void)state;
    const double centre[3] = {121.3, 118.1, 122.7}, radius = 80.2;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    uint32_t *visibility = malloc(RAY_COUNT * sizeof *visibility);
    for (int body = 0; body < 2; body++) {
        struct fixture fixture;
        uint64_t seed = 61;
        fixture_init(&fixture, NULL, CELLS, VOXELS);
        add_ball(&fixture.samples, centre, radius, 250, body == 1); /* facets as small as cells: it is round */
        fixture_build(&fixture);
        for (int inwards = 0; inwards < 2; inwards++) {
            /* Steep; any; almost along the surface: a chord of a few cells says nothing there. */
            for (int way = 0; way < (inwards ? 2 : 3); way++) {
                for (uint32_t i = 0; i < RAY_COUNT; i++)
                    ray_on_ball(&rays[i], centre, radius, inwards, way == 0 ? 3 : way == 1 ? 1 : 0.02, &seed);
                for (int f = 0; f < FORM_COUNT; f++) {
                    trace(&fixture, &forms[f].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
                    trace(&fixture, &forms[f].options, WAVE_ANY, rays, RAY_COUNT, NULL, visibility);
                    uint32_t wrong = 0, stopped = 0;
                    for (uint32_t i = 0; i < RAY_COUNT; i++) {
                        double b = 0, c = 0, a = 0;
                        for (int k = 0; k < 3; k++) {
                            const double from = (double)rays[i].origin_t_min[k] - centre[k],
                                         d = (double)rays[i].direction_t_max[k];
                            a += d * d, b += from * d, c += from * from;
                        }
                        const double chord = (-b + sqrt(fmax(b * b - a * (c - radius * radius), 0))) / a;
                        stopped += (visibility[i] == 0) != (inwards == 1) && (!inwards || chord * sqrt(a) > 4);
                        if (!inwards)
                            wrong += hits[i].distance >= 0;
                        else if (chord * sqrt(a) > 4)
                            wrong += (uint32_t) !(fabs((double)hits[i].distance - chord) * sqrt(a) < 0.5);
                    }
                    const uint32_t most = RAY_COUNT / 500;
                    if (wrong > most || stopped > most)
                        fail_msg("%s: %u of %u rays are wrong, %u any-hit ones, %s, %s, way %d", forms[f].name,
                                 wrong, RAY_COUNT, stopped, body ? "body" : "open",
                                 inwards ? "inwards" : "outwards", way);
                }
            }
        }
        fixture_finish(&fixture);
    }
    free(rays);
    free(hits);
    free(visibility);
}

/* A floor with a box that stands on it in the middle of a cell: from the floor, a cell and more from the box,
 * straight and steeply towards it. And along the floor, as low as integrators begin, which the floor must not
 * stop. */
static void what_stands_on_a_floor_is_met_from_a_cell_on(void **state)
{
    (void)state;
    const double low = 40.3, wall = 120.4;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    for (int body = 0; body < 2; body++) {
        struct fixture fixture;
        uint64_t seed = 71;
        fixture_init(&fixture, NULL, CELLS, VOXELS);
        const double floor_[4][3] = {{2, low, 2}, {2, low, 238}, {238, low, 238}, {238, low, 2}};
        if (body)
            add_box(&fixture.samples, (const double[3]){2, 20.2, 2}, (const double[3]){238, low, 238}, true);
        else
            add_quad(&fixture.samples, floor_, false);
        add_box(&fixture.samples, (const double[3]){wall, low, 80.2}, (const double[3]){182.7, 120.2, 160.3},
                body);
        fixture_build(&fixture);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const double away = (double)(i % 2 ? test_uniform(&seed, 1, 4) : test_uniform(&seed, 4, 110));
            const double o[3] = {wall - away, low + (double)CELLS / 65536, (double)test_uniform(&seed, 96, 144)};
            const double rise = i % 4 == 0 ? 0 : (double)test_uniform(&seed, 0, 1.5f);
            const double d[3] = {1, rise * 60 / (away + 60), (double)test_uniform(&seed, -0.1f, 0.1f)};
            rays[i] = ray_from(o, d, 0, FAR);
        }
        for (int f = 0; f < FORM_COUNT; f++) {
            uint32_t wrong = 0, first = 0;
            trace(&fixture, &forms[f].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
            for (uint32_t i = 0; i < RAY_COUNT; i++) {
                const double way = wall - (double)rays[i].origin_t_min[0];
                if (way * (double)rays[i].direction_t_max[1] > 78) /* above the box, or at its edge */
                    continue;
                if (!(fabs((double)hits[i].distance - way) < 0.01 + 1e-3 * way)) {
                    wrong++;
                    first = i;
                }
            }
            if (wrong > 0)
                fail_msg("%s, body %d: %u rays are wrong; one, %g from the wall, meets something at %g",
                         forms[f].name, body, wrong, wall - (double)rays[first].origin_t_min[0],
                         (double)hits[first].distance);
        }
        fixture_finish(&fixture);
    }
    free(rays);
    free(hits);
}

/* In the corner of a room: from beside a wall, nearer than a cell, into it; not from so near that it could be the
 * bent surface that the ray begins on (OWN_BEFORE in abuffer/planes.glsl). What would look through it would see
 * the sky along all its corners. */
static void a_wall_beside_the_origin_is_not_passed(void **state)
{
    (void)state;
    const double low = 40.4, wall = 80.3;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    uint32_t *visibility = malloc(RAY_COUNT * sizeof *visibility);
    for (int body = 0; body < 2; body++) {
        struct fixture fixture;
        uint64_t seed = 81;
        fixture_init(&fixture, NULL, CELLS, VOXELS);
        /* Of bodies: a floor and a wall of some thickness, one in the other. Where each begins is before the
         * middle of a texel, so that it has samples up to there. */
        const double floor_[4][3] = {{wall, low, 20}, {wall, low, 220}, {220, low, 220}, {220, low, 20}};
        const double side[4][3] = {{wall, low, 20}, {wall, 200, 20}, {wall, 200, 220}, {wall, low, 220}};
        if (body) {
            add_box(&fixture.samples, (const double[3]){20, 20.1, 20}, (const double[3]){220, low, 220}, true);
            add_box(&fixture.samples, (const double[3]){40, 20.1, 20}, (const double[3]){wall, 200, 220}, true);
        } else {
            add_quad(&fixture.samples, floor_, false);
            add_quad(&fixture.samples, side, false);
        }
        fixture_build(&fixture);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const double o[3] = {wall + (double)test_uniform(&seed, 0.15f, 1), low + (double)CELLS / 65536,
                                 (double)test_uniform(&seed, 40, 200)};
            const double d[3] = {-1, (double)test_uniform(&seed, 0.6f, 3), (double)test_uniform(&seed, -1, 1)};
            rays[i] = ray_from(o, d, 0, FAR);
        }
        for (int f = 0; f < FORM_COUNT; f++) {
            uint32_t wrong = 0, open = 0;
            trace(&fixture, &forms[f].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
            trace(&fixture, &forms[f].options, WAVE_ANY, rays, RAY_COUNT, NULL, visibility);
            for (uint32_t i = 0; i < RAY_COUNT; i++) {
                const double away = (double)rays[i].origin_t_min[0] - wall,
                             above = away * (double)rays[i].direction_t_max[1];
                /* So near the origin steps do not ask of windings: what begins in a wall is met where it leaves.
                 */
                const bool looks = f == DDA || !body || above > 1;
                wrong += (uint32_t)(looks && !(fabs((double)hits[i].distance - away) < 0.01));
                open += visibility[i] != 0;
            }
            if (wrong > 0 || open > 0)
                fail_msg("%s, body %d: %u closest hits are wrong, %u rays pass the wall", forms[f].name, body,
                         wrong, open);
        }
        fixture_finish(&fixture);
    }
    free(rays);
    free(hits);
    free(visibility);
}

/* ---- light that passes ---- */

/* Panes across and askew: neighbouring samples' planes overlap, but a pane tints once. A ball, which a ray enters
 * and leaves, does it twice. */
static void glass_tints_once_for_each_crossing(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    uint32_t *visibility = malloc(RAY_COUNT * sizeof *visibility);
    for (int shape = 0; shape < 3; shape++) { /* panes, an open ball, a body */
        struct fixture fixture;
        uint64_t seed = 91;
        fixture_init(&fixture, scene_of_glass(), CELLS, VOXELS);
        assert_true(fixture.gpu.has_transmission);
        for (int pane = 0; pane < 3 && shape == 0; pane++) {
            const double x = 60 + 48 * pane, lean = 36 * (pane - 1);
            const double p[4][3] = {
                {x - lean, 8, 8}, {x - lean, 8, 232}, {x + lean, 232, 232}, {x + lean, 232, 8}};
            add_quad(&fixture.samples, p, false);
        }
        if (shape > 0)
            add_ball(&fixture.samples, (const double[3]){120.1, 119.3, 121.2}, 90.2, 200, shape == 2);
        fixture.samples.all_of_one = true;
        fixture_build(&fixture);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const double o[3] = {2, (double)test_uniform(&seed, 80, 160), (double)test_uniform(&seed, 80, 160)};
            const double d[3] = {1, (double)test_uniform(&seed, -0.3f, 0.3f),
                                 (double)test_uniform(&seed, -0.3f, 0.3f)};
            rays[i] = ray_from(o, d, 0, FAR);
        }
        for (int f = 0; f < FORM_COUNT; f++) {
            uint32_t wrong = 0;
            trace(&fixture, &forms[f].options, WAVE_ANY, rays, RAY_COUNT, NULL, visibility);
            for (uint32_t i = 0; i < RAY_COUNT; i++)
                wrong += !is_tint(visibility[i], shape == 0 ? 3 : 2);
            /* Where it is grazed, and in cracks where images meet: a few rays in a thousand. */
            if (wrong > (shape == 0 ? 0 : RAY_COUNT / 500))
                fail_msg("%s, shape %d: %u of %u rays are not tinted once for each crossing", forms[f].name, shape,
                         wrong, RAY_COUNT);
        }
        fixture_finish(&fixture);
    }
    free(rays);
    free(visibility);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ray_does_not_hit_the_ball_that_it_leaves),
        cmocka_unit_test(what_stands_on_a_floor_is_met_from_a_cell_on),
        cmocka_unit_test(a_wall_beside_the_origin_is_not_passed),
        cmocka_unit_test(glass_tints_once_for_each_crossing),
    };
    RUN_ON_A_DEVICE(tests);
}
