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

static void explore(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    for (int shape = 0; shape < 4; shape++) {
        struct fixture fixture;
        fixture_init(&fixture, NULL, CELLS, VOXELS);
        struct abuffer_samples *s = &fixture.samples;
        if (shape == 0 || shape == 3)
            add_ball(s, (const double[3]){101.3, 120.1, 118.7}, 60.4, 40, shape == 0);
        if (shape == 1 || shape == 2)
            add_box(s, (const double[3]){61.3, 50.1, 68.7}, (const double[3]){161.3, 150.1, 128.7}, shape == 1);
        fixture_build(&fixture);
        random_rays(rays, RAY_COUNT, 7);
        printf("shape %d\n", shape);
        for (int f = 0; f < FORM_COUNT; f++)
            compare(&fixture, f, rays, RAY_COUNT, 0.5);
        fixture_finish(&fixture);
    }
    free(rays);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(explore),
    };
    RUN_ON_A_DEVICE(tests);
}
