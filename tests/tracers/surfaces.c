/* SPDX-License-Identifier: MIT */
/* Rays that begin on surfaces, as integrators send them, and light that passes glass: against what is known of
 * balls, boxes, rooms and panes. Lengths are in cells of a tracer that samples; one that is exact takes the same
 * scenes. */
#include "tests/tracers/contract.h"
#include "trace/visibility.h"

#define PI 3.14159265358979
#define FAR 1e30f
#define CELLS 254.0f /* along the longest side of each scene; a margin of one on either side makes 256 */

struct mesh_builder {
    float (*vertices)[3];
    uint32_t *indices;
    uint32_t vertex_count, triangle_count;
};

static void add_triangle(struct mesh_builder *mesh, uint32_t a, uint32_t b, uint32_t c)
{
    mesh->indices = realloc(mesh->indices, (mesh->triangle_count + 1) * 3 * sizeof(*mesh->indices));
    memcpy(mesh->indices + 3 * mesh->triangle_count++, (uint32_t[3]){a, b, c}, 3 * sizeof(*mesh->indices));
}

static uint32_t add_vertices(struct mesh_builder *mesh, const float (*vertices)[3], uint32_t count)
{
    const uint32_t first = mesh->vertex_count;
    mesh->vertex_count += count;
    mesh->vertices = realloc(mesh->vertices, mesh->vertex_count * sizeof(*mesh->vertices));
    memcpy(mesh->vertices + first, vertices, count * sizeof(*vertices));
    return first;
}

static void add_quad(struct mesh_builder *mesh, const float corners[4][3])
{
    const uint32_t first = add_vertices(mesh, corners, 4);
    add_triangle(mesh, first, first + 1, first + 2);
    add_triangle(mesh, first, first + 2, first + 3);
}

/* Outside is outside. Vertices are shared, so that it is closed. */
static void add_box_between(struct mesh_builder *mesh, const float lower[3], const float upper[3])
{
    static const uint32_t sides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    float corners[8][3];
    for (uint32_t i = 0; i < 8; i++)
        for (uint32_t k = 0; k < 3; k++)
            corners[i][k] = i >> k & 1 ? upper[k] : lower[k];
    const uint32_t first = add_vertices(mesh, (const float(*)[3])corners, 8);
    for (int i = 0; i < 6; i++) {
        add_triangle(mesh, first + sides[i][0], first + sides[i][1], first + sides[i][2]);
        add_triangle(mesh, first + sides[i][0], first + sides[i][2], first + sides[i][3]);
    }
}

static void add_ball(struct mesh_builder *mesh, const float centre[3], double radius, uint32_t steps)
{
    const uint32_t around = 2 * steps, count = (steps - 1) * around + 2, low = count - 2, high = count - 1;
    float(*vertices)[3] = malloc(count * sizeof(*vertices));
    for (uint32_t i = 0; i < count; i++) {
        const double theta = i == low ? 0 : i == high ? PI : PI * (1 + i / around) / steps;
        const double phi = 2 * PI * (i % around) / around, across = i >= low ? 0 : sin(theta);
        vertices[i][0] = centre[0] + (float)(radius * across * cos(phi));
        vertices[i][1] = centre[1] + (float)(radius * cos(theta));
        vertices[i][2] = centre[2] + (float)(radius * across * sin(phi));
    }
    const uint32_t first = add_vertices(mesh, (const float(*)[3])vertices, count);
    for (uint32_t k = 0; k < around; k++) {
        const uint32_t next = (k + 1) % around, last = (steps - 2) * around;
        add_triangle(mesh, first + low, first + next, first + k);
        add_triangle(mesh, first + high, first + last + k, first + last + next);
        for (uint32_t row = 0; row + 2 < steps; row++) {
            const uint32_t a = first + row * around, b = a + around;
            add_triangle(mesh, a + k, a + next, b + next);
            add_triangle(mesh, a + k, b + next, b + k);
        }
    }
    free(vertices);
}

/* Glass whose every surface leaves half of red, a quarter of green (half of it as the body is green to a thickness
 * of two metres), all of blue. */
static void add_glass(struct test_edits *edits)
{
    struct scene_material *glass = test_material(edits, 1, 0.5f, 0.5f, 1);
    glass->value.transmission = 1;
    glass->value.attenuation_colour[1] = 0.5f;
    glass->value.attenuation_distance = 1;
    glass->value.thickness = 2;
}

/* Whether that is left of light after so many surfaces. */
static bool is_tint(uint32_t visibility, int surfaces)
{
    const float expected[3] = {powf(0.5f, (float)surfaces), powf(0.25f, (float)surfaces), 1};
    for (int k = 0; k < 3; k++)
        if (fabs(cbrt(visibility_transmittance(visibility, (unsigned)k)) - cbrt((double)expected[k])) >
            1.0 / VISIBILITY_MAX)
            return false;
    return true;
}

/* The mesh as a scene; what was built is freed. `closed`: its winding bounds a body. */
static struct scene *scene_of(struct mesh_builder *built, bool closed, bool is_glass)
{
    struct test_edits edits = {.scene = test_scene_create()};
    add_glass(&edits);
    struct scene_mesh *mesh = test_mesh(&edits, 10, (const float(*)[3])built->vertices, built->vertex_count,
                                        built->indices, built->triangle_count);
    mesh->value.closed = closed;
    if (is_glass) {
        mesh->ranges = test_ranges(&(struct record_material_range){0, built->triangle_count, 1}, 1);
        mesh->range_count = 1;
    }
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    free(built->vertices);
    free(built->indices);
    return edits.scene;
}

/* Maximum of wrong rays: with a tracer that samples, a few in a thousand may meet a gap where images or
 * texels meet. */
static uint32_t wrong_max(const struct fixture *fixture)
{
    return fixture->row->sampled.resolution || fixture->row->seen.layers ? RAY_COUNT / 500 : 0;
}

struct answered {
    struct ray rays[RAY_COUNT];
    struct hit hits[RAY_COUNT];
    uint32_t visibilities[RAY_COUNT];
    struct seen_answer seen[RAY_COUNT];
    uint32_t judged, strange; /* counts for a tracer that knows the visible surfaces only */
};

static void answer(struct fixture *fixture, struct answered *a)
{
    fixture_trace_rays(fixture, WAVE_CLOSEST, a->rays, RAY_COUNT, a->hits);
    fixture_trace_rays(fixture, WAVE_ANY, a->rays, RAY_COUNT, a->visibilities);
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        a->seen[i] = fixture_seen(fixture, &a->rays[i]);
    a->judged = a->strange = 0;
}

/* Whether all is to be known that a ray passes until it has gone so far. Then the tracer must say that it knows
 * it. */
static bool is_judged(const struct fixture *fixture, struct answered *a, uint32_t ray, double until)
{
    if (fixture->row->seen.layers == 0)
        return true;
    const enum knowledge knowledge = seen_judges(&a->seen[ray], &a->hits[ray], until);
    a->strange += knowledge == CLAIMS_TO_KNOW || knowledge == KNOWS_TOO_LITTLE;
    if (a->strange > wrong_max(fixture))
        fail_msg(
            "ray %u: after %u others it is not known what is seen, or known what is not: %g along, hidden from %g "
            "on, perhaps from %g",
            ray, a->strange - 1, until, a->seen[ray].unknown, a->seen[ray].maybe_unknown);
    a->judged += knowledge == IS_JUDGED;
    return knowledge == IS_JUDGED;
}

/* At most two surfaces hide the points that these checks use, all round an eye. */
static void expect_judged(const struct fixture *fixture, const struct answered *a, uint32_t minimum)
{
    if (fixture->row->seen.layers == 3 && !fixture->row->seen.is_one_face && fixture->row->seen.blind == 0)
        assert_in_range(a->judged, minimum, RAY_COUNT);
}

/* ---- balls ---- */

static const float ball_centre[3] = {0.3f, -0.4f, 0.2f};
#define BALL_RADIUS 127.0

/* A mesh that is round to a tracer whose cells are as large as its facets; to an exact one only a sphere is. */
enum ball { BALL_OPEN, BALL_CLOSED, BALL_SPHERE, BALL_COUNT };

static struct scene *scene_of_ball(enum ball ball, bool is_glass)
{
    struct mesh_builder mesh = {0};
    if (ball != BALL_SPHERE) {
        add_ball(&mesh, ball_centre, BALL_RADIUS, 250);
        return scene_of(&mesh, ball == BALL_CLOSED, is_glass);
    }
    const float sphere[1][4] = {{ball_centre[0], ball_centre[1], ball_centre[2], (float)BALL_RADIUS}};
    struct test_edits edits = {.scene = test_scene_create()};
    add_glass(&edits);
    struct scene_spheres *set = test_spheres(&edits, 20, sphere, 1);
    if (is_glass) {
        set->ranges = test_ranges(&(struct record_material_range){0, 1, 1}, 1);
        set->range_count = 1;
    }
    test_node(&edits, 1, 0, NODE_SPHERES, 20, NULL);
    test_commit(&edits);
    return edits.scene;
}

/* With the eye within, beside the middle. */
static void init_in_ball(struct fixture *fixture, const struct tracer_row *row, struct scene *scene)
{
    fixture_init_seen_from(fixture, row, scene, ball_centre[0] + 7, ball_centre[1] - 5, ball_centre[2] + 11);
}

/* Ray whose origin is moved off the surface as by integrators: by 2^-16 of the coordinates, here of the size
 * of the scene. */
static struct ray ray_on_ball(bool inwards, double grazing, uint64_t *seed)
{
    double n[3], side = inwards ? -1 : 1, z = (double)test_uniform(seed, -0.999f, 0.999f),
                 phi = (double)test_uniform(seed, 0, 2 * (float)PI), cosine = 0;
    float o[3], d[3];
    n[0] = sqrt(1 - z * z) * cos(phi), n[1] = z, n[2] = sqrt(1 - z * z) * sin(phi);
    for (int k = 0; k < 3; k++) {
        o[k] = ball_centre[k] + (float)(n[k] * (BALL_RADIUS + side * (double)CELLS / 65536));
        d[k] = test_uniform(seed, -1, 1);
        cosine += (double)d[k] * n[k];
    }
    for (int k = 0; k < 3; k++) /* only size and side count of the part along the normal */
        d[k] += (float)(n[k] * (side * fabs(cosine) * grazing - cosine));
    return ray_from(o, d, 0, FAR);
}

/* How far it is to where the ray leaves the ball, and to where it comes to it, in lengths of the direction. */
static double chord_of(const struct ray *ray, double *length, double *begin)
{
    double a = 0, b = 0, c = 0;
    for (int k = 0; k < 3; k++) {
        const double from = (double)ray->origin_t_min[k] - (double)ball_centre[k],
                     d = (double)ray->direction_t_max[k];
        a += d * d, b += from * d, c += from * from;
    }
    *length = sqrt(a);
    const double half = sqrt(fmax(b * b - a * (c - BALL_RADIUS * BALL_RADIUS), 0));
    *begin = (-b - half) / a;
    return (-b + half) / a;
}

static void expect_ball_left(struct fixture *fixture, struct answered *a, bool inwards, double grazing)
{
    uint32_t wrong = 0, stopped = 0;
    uint64_t seed = 61;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        a->rays[i] = ray_on_ball(inwards, grazing, &seed);
    answer(fixture, a);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        double length, begin, chord = chord_of(&a->rays[i], &length, &begin);
        if ((inwards && chord * length <= 4) || /* a chord of a few cells says nothing */
            !is_judged(fixture, a, i, inwards ? chord : (double)FAR))
            continue;
        const bool is_left =
            inwards ? fabs((double)a->hits[i].distance - chord) * length < 0.5 : a->hits[i].distance < 0;
        wrong += !is_left;
        stopped += (a->visibilities[i] == 0) != inwards;
    }
    if (wrong > wrong_max(fixture) || stopped > wrong_max(fixture))
        fail_msg("%s, grazing %g: %u closest hits are wrong, %u any-hit rays", inwards ? "inwards" : "outwards",
                 grazing, wrong, stopped);
}

CHECK(a_ray_does_not_hit_the_ball_that_it_leaves, CHECK_FORMS | CHECK_SURFACES)
{
    const struct contract_case *of = *state;
    struct answered *a = malloc(sizeof(*a));
    const bool is_sampled = of->tracer->sampled.resolution > 0;
    for (enum ball ball = is_sampled ? BALL_OPEN : BALL_SPHERE; ball <= (is_sampled ? BALL_CLOSED : BALL_SPHERE);
         ball++) {
        struct fixture fixture;
        init_in_ball(&fixture, of->tracer, scene_of_ball(ball, false));
        expect_ball_left(&fixture, a, false, 3); /* steep; any; almost along the surface */
        expect_ball_left(&fixture, a, false, 1);
        expect_ball_left(&fixture, a, false, 0.02);
        expect_ball_left(&fixture, a, true, 3);
        expect_ball_left(&fixture, a, true, 1);
        fixture_finish(&fixture);
    }
    free(a);
}

/* Rays that begin millions of its cells away hit a small shape, as those of a large scene hit its moving
 * objects: a ball has no cracks, and is hit where it is, up to the rounding of the ray's origin. */
CHECK(rays_from_afar_meet_what_is_small, CHECK_FORMS | CHECK_SURFACES)
{
    const struct contract_case *of = *state;
    struct answered *a = malloc(sizeof(*a));
    struct fixture fixture;
    uint64_t seed = 41;
    uint32_t wrong = 0;
    init_in_ball(&fixture, of->tracer,
                 scene_of_ball(of->tracer->sampled.resolution ? BALL_CLOSED : BALL_SPHERE, false));
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float o[3], d[3], length = 0;
        for (int k = 0; k < 3; k++) {
            o[k] = test_uniform(&seed, -1, 1);
            length = fmaxf(length, fabsf(o[k]));
        }
        for (int k = 0; k < 3; k++) {
            o[k] *= 2e6f / length;
            d[k] = ball_centre[k] + (float)BALL_RADIUS * test_uniform(&seed, -0.5f, 0.5f) - o[k];
        }
        a->rays[i] = ray_from(o, d, 0, FAR);
    }
    answer(&fixture, a);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        double from_centre = 0, along = 0, length, begin;
        (void)chord_of(&a->rays[i], &length, &begin);
        if (!is_judged(&fixture, a, i, begin))
            continue;
        for (int k = 0; k < 3; k++) {
            const double off = (double)a->rays[i].origin_t_min[k] +
                               (double)a->hits[i].distance * (double)a->rays[i].direction_t_max[k] -
                               (double)ball_centre[k];
            from_centre += off * off;
            along += off * (double)a->rays[i].direction_t_max[k];
        }
        /* On the side that is turned to the ray. */
        wrong += a->hits[i].distance < 0 || fabs(sqrt(from_centre) - BALL_RADIUS) > 1 || along > 0 ||
                 a->visibilities[i] != 0;
    }
    if (wrong > RAY_COUNT / 500)
        fail_msg("%u rays do not meet it where it is", wrong);
    fixture_finish(&fixture);
    free(a);
}

/* ---- floors and walls ---- */

/* A floor with a box that stands on it in the middle of a cell: from the floor, a cell and more from the box,
 * straight and steeply towards it. And along the floor, as low as integrators begin, which the floor must not
 * stop. */
CHECK(what_stands_on_a_floor_is_met_from_a_cell_on, CHECK_FORMS | CHECK_SURFACES)
{
    const struct contract_case *of = *state;
    struct answered *a = malloc(sizeof(*a));
    const float low = 40.3f, wall = 120.4f;
    for (int closed = 0; closed < 2; closed++) {
        struct mesh_builder mesh = {0};
        struct fixture fixture;
        uint64_t seed = 71;
        uint32_t wrong = 0;
        const float floor_[4][3] = {{0, low, 0}, {0, low, CELLS}, {CELLS, low, CELLS}, {CELLS, low, 0}};
        if (closed)
            add_box_between(&mesh, (const float[3]){0, 20.2f, 0}, (const float[3]){CELLS, low, CELLS});
        else
            add_quad(&mesh, floor_);
        add_box_between(&mesh, (const float[3]){wall, low, 80.2f}, (const float[3]){182.7f, 120.2f, 160.3f});
        fixture_init_seen_from(&fixture, of->tracer, scene_of(&mesh, closed, false), 70, 80, 260);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const float away = i % 2 ? test_uniform(&seed, 1, 4) : test_uniform(&seed, 4, 110);
            const float o[3] = {wall - away, low + CELLS / 65536, test_uniform(&seed, 96, 144)};
            const float rise = i % 4 == 0 ? 0 : test_uniform(&seed, 0, 1.5f);
            a->rays[i] = ray_from(
                o, (const float[3]){1, rise * 60 / (away + 60), test_uniform(&seed, -0.1f, 0.1f)}, 0, FAR);
        }
        answer(&fixture, a);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const float way = wall - a->rays[i].origin_t_min[0];
            if (way * a->rays[i].direction_t_max[1] > 78 || /* above the box, or at its edge */
                !is_judged(&fixture, a, i, (double)way))
                continue;
            wrong += !(fabsf(a->hits[i].distance - way) < 0.01f + 1e-3f * way) || a->visibilities[i] != 0;
        }
        if (wrong > (of->tracer->seen.layers ? wrong_max(&fixture) : 0))
            fail_msg("closed %d: %u rays are wrong", closed, wrong);
        expect_judged(&fixture, a, RAY_COUNT / 2);
        fixture_finish(&fixture);
    }
    free(a);
}

/* In the corner of a room: from beside a wall, nearer than a cell, into it; not from so near that it could be the
 * bent surface that the ray begins on (a quarter of a cell). What would look through it would see the sky along
 * all its corners. */
CHECK(a_wall_beside_the_origin_is_not_passed, CHECK_FORMS | CHECK_SURFACES | CHECK_BESIDE)
{
    const struct contract_case *of = *state;
    struct answered *a = malloc(sizeof(*a));
    const float low = 40.4f, wall = 80.3f;
    for (int closed = 0; closed < 2; closed++) {
        struct mesh_builder mesh = {0};
        struct fixture fixture;
        uint64_t seed = 81;
        uint32_t wrong = 0, open = 0;
        /* Bodies: a floor and a wall of some thickness, one in the other. */
        const float floor_[4][3] = {{wall, low, 0}, {wall, low, CELLS}, {CELLS, low, CELLS}, {CELLS, low, 0}};
        const float side[4][3] = {{wall, low, 0}, {wall, 200, 0}, {wall, 200, CELLS}, {wall, low, CELLS}};
        if (closed) {
            add_box_between(&mesh, (const float[3]){0, 20.1f, 0}, (const float[3]){CELLS, low, CELLS});
            add_box_between(&mesh, (const float[3]){40, 20.1f, 0}, (const float[3]){wall, 200, CELLS});
        } else {
            add_quad(&mesh, floor_);
            add_quad(&mesh, side);
        }
        fixture_init_seen_from(&fixture, of->tracer, scene_of(&mesh, closed, false), 130, 90, 260);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const float o[3] = {wall + test_uniform(&seed, 0.25f, 1), low + CELLS / 65536,
                                test_uniform(&seed, 40, 200)};
            a->rays[i] = ray_from(
                o, (const float[3]){-1, test_uniform(&seed, 0.6f, 3), test_uniform(&seed, -1, 1)}, 0, FAR);
        }
        answer(&fixture, a);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const float away = a->rays[i].origin_t_min[0] - wall, above = away * a->rays[i].direction_t_max[1];
            if (!is_judged(&fixture, a, i, (double)away))
                continue;
            /* Below, the wall may have no sample: it begins within the cell. */
            const bool is_known = above > 1 || !of->tracer->sampled.resolution;
            wrong += is_known && !(fabsf(a->hits[i].distance - away) < 0.01f);
            open += (is_known || closed) && a->visibilities[i] != 0;
        }
        const uint32_t allowed = of->tracer->seen.layers ? wrong_max(&fixture) : 0;
        if (wrong > allowed || open > allowed)
            fail_msg("closed %d: %u closest hits are wrong, %u rays pass the wall", closed, wrong, open);
        expect_judged(&fixture, a, RAY_COUNT / 4); /* many meet it within a texel of its foot */
        fixture_finish(&fixture);
    }
    free(a);
}

/* ---- light that passes ---- */

/* Rays that begin where it says so are stopped by what is translucent, all others are tinted. */
static void expect_tints(struct fixture *fixture, struct answered *a, int surfaces, uint32_t allowed)
{
    uint32_t wrong = 0, judged = 0, passed = 0;
    assert_true(fixture->gpu.has_transmission);
    fixture_trace_rays(fixture, WAVE_ANY, a->rays, RAY_COUNT, a->visibilities);
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        a->rays[i].origin_t_min[3] = RAY_STOPS_T_MIN;
    uint32_t *stopped = malloc(RAY_COUNT * sizeof(*stopped));
    fixture_trace_rays(fixture, WAVE_ANY, a->rays, RAY_COUNT, stopped);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const struct seen_answer seen = fixture_seen(fixture, &a->rays[i]);
        if (!seen_knows(&seen, (double)FAR))
            continue;
        wrong += !is_tint(a->visibilities[i], surfaces);
        passed += stopped[i] != 0;
        judged++;
    }
    free(stopped);
    a->judged = judged;
    expect_judged(fixture, a, RAY_COUNT / 2);
    if (wrong > allowed)
        fail_msg("%u rays are not tinted %d times", wrong, surfaces);
    if (passed > allowed)
        fail_msg("%u rays pass though translucent surfaces stop them", passed);
}

/* Panes across and askew: neighbouring samples' planes overlap, but a pane tints once. */
CHECK(a_pane_of_glass_tints_once, CHECK_FORMS | CHECK_SURFACES)
{
    const struct contract_case *of = *state;
    struct answered *a = malloc(sizeof(*a));
    struct mesh_builder mesh = {0};
    struct fixture fixture;
    uint64_t seed = 91;
    for (int pane = 0; pane < 3; pane++) {
        const float x = 60 + 48 * (float)pane, lean = 36 * (float)(pane - 1);
        const float p[4][3] = {
            {x - lean, 0, 0}, {x - lean, 0, CELLS}, {x + lean, CELLS, CELLS}, {x + lean, CELLS, 0}};
        add_quad(&mesh, p);
    }
    fixture_init_seen_from(&fixture, of->tracer, scene_of(&mesh, false, true), 130, 127, 120);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float o[3] = {2, test_uniform(&seed, 80, 160), test_uniform(&seed, 80, 160)};
        a->rays[i] = ray_from(
            o, (const float[3]){1, test_uniform(&seed, -0.3f, 0.3f), test_uniform(&seed, -0.3f, 0.3f)}, 0, FAR);
    }
    expect_tints(&fixture, a, 3, of->tracer->seen.layers ? wrong_max(&fixture) : 0);
    fixture_finish(&fixture);
    free(a);
}

/* A ball is two surfaces, also where the images of two axes meet. */
CHECK(a_ball_of_glass_tints_twice, CHECK_FORMS | CHECK_SURFACES)
{
    const struct contract_case *of = *state;
    struct answered *a = malloc(sizeof(*a));
    for (enum ball ball = of->tracer->sampled.resolution ? BALL_CLOSED : BALL_SPHERE; ball < BALL_COUNT; ball++) {
        struct fixture fixture;
        uint64_t seed = 95;
        init_in_ball(&fixture, of->tracer, scene_of_ball(ball, true));
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            float o[3], d[3], squared = 0;
            for (int k = 0; k < 3; k++) {
                o[k] = test_uniform(&seed, -1, 1);
                squared += o[k] * o[k];
            }
            for (int k = 0; k < 3; k++) {
                o[k] = ball_centre[k] + o[k] * 2.5f * (float)BALL_RADIUS / sqrtf(squared);
                d[k] = ball_centre[k] + (float)BALL_RADIUS * test_uniform(&seed, -0.5f, 0.5f) - o[k];
            }
            a->rays[i] = ray_from(o, d, 0, FAR);
        }
        expect_tints(&fixture, a, 2,
                     of->tracer->sampled.resolution || of->tracer->seen.layers ? RAY_COUNT / 200 : 0);
        fixture_finish(&fixture);
    }
    free(a);
}
