/* SPDX-License-Identifier: MIT */
/* Shared parts of tests of the integrator `path`: its default request, and means with their standard errors. */
#ifndef FARLIGHT_TESTS_PATH_FIXTURE_H
#define FARLIGHT_TESTS_PATH_FIXTURE_H

#include "tests/accuracy/render_fixture.h"

#define PI 3.14159265358979323846
#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

enum { EDGE = 32, PIXELS = EDGE * EDGE };

static inline void path_begin(struct fixture *fixture, unsigned tracer, uint32_t depth)
{
    fixture_clear((void **)&fixture);
    fixture->request.picture.width = fixture->request.picture.height = EDGE;
    fixture->request.light.integrator = INTEGRATOR_PATH;
    fixture->request.sampling.pixel_filter = FILTER_BOX;
    fixture->request.tracing.tracer = tracer;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.light.depth = depth;
}

struct mean {
    double value, error; /* standard error */
};

/* Mean of independent numbers. */
static inline struct mean mean_of(const double *values, size_t count)
{
    double sum = 0.0, squares = 0.0;
    for (size_t i = 0; i < count; i++)
        sum += values[i];
    for (size_t i = 0; i < count; i++)
        squares += (values[i] - sum / (double)count) * (values[i] - sum / (double)count);
    return (struct mean){sum / (double)count, sqrt(squares / (double)count / (double)(count - 1))};
}

/* Green of all pixels; free(). */
static inline float *path_render_pixels(struct fixture *fixture, uint32_t samples, uint64_t seed)
{
    float *pixels = malloc(PIXELS * sizeof(*pixels));
    assert_non_null(pixels);
    fixture->request.sampling.samples = samples;
    fixture->request.sampling.seed = seed;
    struct frame_result result = fixture_render(fixture);
    for (uint32_t i = 0; i < PIXELS; i++)
        pixels[i] = fixture_pixel(&result, i % EDGE, i / EDGE)[1];
    frame_result_finish(&result);
    return pixels;
}

/* Green of all pixels, where what they show is alike. Neighbours' errors cancel each other: the mean's is no
 * larger than is said. */
static inline struct mean mean_of_picture(const struct frame_result *result)
{
    double values[PIXELS];
    for (uint32_t i = 0; i < PIXELS; i++)
        values[i] = (double)fixture_pixel(result, i % EDGE, i / EDGE)[1];
    return mean_of(values, PIXELS);
}

/* Number of seeds over which a value of a picture is measured. */
enum { SEEDS = 16 };
typedef double measure(const struct frame_result *result);
static inline struct mean mean_of_seeds(struct fixture *fixture, measure *of)
{
    double values[SEEDS];
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        fixture->request.sampling.seed = seed;
        struct frame_result result = fixture_render(fixture);
        values[seed] = of(&result);
        frame_result_finish(&result);
    }
    return mean_of(values, SEEDS);
}

/* Student's t with 15 degrees of freedom is beyond 5 once in 6000 cases; `other`: what else it may be off. */
#define assert_mean(mean_, expected, other)                                                                       \
    do {                                                                                                          \
        struct mean got = (mean_);                                                                                \
        double wanted = (expected);                                                                               \
        if (!(fabs(got.value - wanted) <= 5.0 * got.error + (other)))                                             \
            fail_msg("%s is %.6g with a standard error of %.1e, expected %.6g", #mean_, got.value, got.error,     \
                     wanted);                                                                                     \
    } while (0)

#endif
