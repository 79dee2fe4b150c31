/* SPDX-License-Identifier: MIT */
/* The walk through A-buffers made on the CPU, against the triangles that they were made of. */
#include "tests/unit/abuffer_walk_fixture.h"

#define CELLS 240u
#define VOXELS 16u

struct outcome {
    uint32_t rays, both, only_exact, only_walk, far; /* farther than asked from where it is */
    double worst, sum;
};

static struct outcome compare(struct fixture *fixture, int form, const struct ray *rays, uint32_t count,
                              double cells_max)
{
    struct hit *hits = malloc(count * sizeof *hits);
    uint32_t *visibility = malloc(count * sizeof *visibility), any_wrong = 0;
    struct outcome o = {.rays = count};
    trace(fixture, &forms[form].options, WAVE_CLOSEST, rays, count, hits, NULL);
    trace(fixture, &forms[form].options, WAVE_ANY, rays, count, NULL, visibility);
    for (uint32_t i = 0; i < count; i++) {
        double from[3], along[3], size = 0;
        for (int k = 0; k < 3; k++) {
            from[k] = (double)rays[i].origin_t_min[k];
            along[k] = (double)rays[i].direction_t_max[k];
            size = fmax(size, fabs(along[k]));
        }
        struct exact_hit exact = abuffer_exact(&fixture->samples, from, along, (double)rays[i].origin_t_min[3],
                                               (double)rays[i].direction_t_max[3]);
        any_wrong += (visibility[i] == 0) != (exact.distance < INFINITY);
        if (hits[i].distance < 0 || exact.distance == INFINITY) {
            o.only_exact += hits[i].distance < 0 && exact.distance < INFINITY;
            o.only_walk += !(hits[i].distance < 0) && exact.distance == INFINITY;
            continue;
        }
        double off = fabs((double)hits[i].distance - exact.distance) * size;
        o.both++;
        o.far += off > cells_max;
        o.sum += off < 3 ? off : 3;
        o.worst = fmax(o.worst, off);
    }
    printf("%-8s %u rays, %u hit both, %u missed, %u where nothing is, %u farther than %g; mean %.4f; any: %u "
           "wrong\n",
           forms[form].name, o.rays, o.both, o.only_exact, o.only_walk, o.far, cells_max,
           o.both ? o.sum / o.both : 0, any_wrong);
    free(hits);
    free(visibility);
    return o;
}

static void random_rays(struct ray *rays, uint32_t count, uint64_t seed)
{
    for (uint32_t i = 0; i < count; i++) {
        double o[3], d[3];
        for (int k = 0; k < 3; k++) {
            o[k] = CELLS * (double)test_uniform(&seed, i % 2 ? 0 : -1, i % 2 ? 1 : 2);
            d[k] = CELLS * (double)test_uniform(&seed, 0.2f, 0.8f) - o[k];
        }
        rays[i] = ray_from(o, d, 0, i % 3 == 0 ? 0.7f : FAR);
    }
}


/* ---- shapes, from everywhere ---- */

static void add_one_ball(struct abuffer_samples *s)
{
    add_ball(s, (const double[3]){101.3, 120.1, 118.7}, 60.4, 40, true);
}

static void add_one_box(struct abuffer_samples *s)
{
    add_box(s, (const double[3]){61.3, 50.1, 68.7}, (const double[3]){161.3, 150.1, 128.7}, true);
}

/* A ball within a ball, which is cut by a box, beside another in one. */
static void add_nested(struct abuffer_samples *s)
{
    add_ball(s, (const double[3]){101.3, 120.1, 118.7}, 70.4, 40, true);
    add_ball(s, (const double[3]){96.3, 110.1, 121.7}, 40.2, 30, true);
    add_box(s, (const double[3]){81.3, 130.1, 28.7}, (const double[3]){221.3, 180.1, 98.7}, true);
    add_ball(s, (const double[3]){170.3, 150.1, 60.7}, 15.3, 20, true);
}

static void add_open_ball(struct abuffer_samples *s)
{
    add_ball(s, (const double[3]){101.3, 120.1, 118.7}, 60.4, 40, false);
}

/* Askew, one behind the other, without thickness. */
static void add_sheets(struct abuffer_samples *s)
{
    for (int i = 0; i < 5; i++) {
        double x = 40 + 35 * i, lean = 11.3 * (i - 2);
        const double p[4][3] = {
            {x - lean, 22.2, 31.1}, {x + lean, 201.3, 31.1}, {x + lean, 201.3, 202.2}, {x - lean, 22.2, 202.2}};
        add_quad(s, p, false);
    }
}

/* As thick as a cell and a half. */
static void add_plates(struct abuffer_samples *s)
{
    add_box(s, (const double[3]){61.3, 50.1, 68.7}, (const double[3]){62.8, 180.1, 198.7}, true);
    add_box(s, (const double[3]){81.3, 50.1, 68.7}, (const double[3]){181.3, 51.6, 198.7}, true);
    add_box(s, (const double[3]){81.3, 70.1, 100.7}, (const double[3]){181.3, 160.1, 102.2}, true);
}

/* A room: all walls are seen from within, and open. */
static void add_room(struct abuffer_samples *s)
{
    add_box(s, (const double[3]){10.3, 20.4, 15.2}, (const double[3]){230.3, 209.1, 221.7}, false);
    add_ball(s, (const double[3]){101.3, 60.1, 118.7}, 30.4, 30, true);
}

static void explore(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    static const struct {
        const char *name;
        void (*add)(struct abuffer_samples *s);
    } rows[] = {{"ball", add_one_ball}, {"box", add_one_box}, {"nested", add_nested}, {"open ball", add_open_ball},
        {"sheets", add_sheets}, {"plates", add_plates}, {"room", add_room}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct fixture fixture;
        fixture_init(&fixture, NULL, CELLS, VOXELS);
        rows[i].add(&fixture.samples);
        fixture_build(&fixture);
        random_rays(rays, RAY_COUNT, 7);
        printf("%s\n", rows[i].name);
        for (int f = 0; f < FORM_COUNT; f++)
            compare(&fixture, f, rays, RAY_COUNT, 0.5);
        fixture_finish(&fixture);
    }
    free(rays);
}

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
                    printf("body %d inwards %d way %d %s: %u wrong, any %u\n", body, inwards, way, forms[f].name,
                           wrong, stopped);
                }
            }
        }
        fixture_finish(&fixture);
    }
    free(rays);
    free(hits);
    free(visibility);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(explore),
        cmocka_unit_test(a_ray_does_not_hit_the_ball_that_it_leaves),
    };
    RUN_ON_A_DEVICE(tests);
}
