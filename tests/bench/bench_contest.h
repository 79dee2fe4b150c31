/* SPDX-License-Identifier: MIT */
/* Contenders take turns at the same wave of rays, run by run, so that a machine that slows down slows all of them;
 * then their answers are held against the truth, ray by ray. */
#ifndef FARLIGHT_TESTS_BENCH_CONTEST_H
#define FARLIGHT_TESTS_BENCH_CONTEST_H

#include "tests/bench/bench_stats.h"
#include "tests/bench/bench_waves.h"
#include "trace/tracer.h"

#include <stdbool.h>
#include <stdint.h>

#define BENCH_CONTENDERS_MAX 32

enum bench_way {
    BENCH_INTERFACE, /* rays on the device to hits there, or to visibilities */
    BENCH_TRAVERSAL, /* closest hits only: distance, primitive, instance, barycentrics */
};

struct bench_contender {
    const char *name;
    struct tracer *tracer;
    enum bench_way way;
    bool is_exact; /* its disagreement is a fault, not a property */
    /* runs of the last wave */
    struct bench_runs runs, device_runs; /* by the host's clock, and by the device's where it has one */
    bool is_compared;
    uint32_t differing; /* rays whose answer is not the truth's */
    uint32_t edges;     /* rays of these for which the truth gives that result when moved by a hair's breadth */
};

struct bench_contest {
    struct gpu_device *device;
    struct bench_scene *scene;
    struct bench_contender contenders[BENCH_CONTENDERS_MAX];
    unsigned contender_count, runs;
    struct gpu_buffer ray_buffer, answer_buffer;
};

/* A wave on the host. */
struct bench_wave {
    enum bench_wave_kind kind;
    const struct ray *rays;
    uint32_t ray_count;
};

/* The one that is added, zeroed but for its tracer, the tracer's name and its way; the array has room for
 * BENCH_CONTENDERS_MAX. */
struct bench_contender *bench_contest_add(struct bench_contest *contest, struct tracer *tracer,
                                          enum bench_way way);
/* A warm-up, which keeps hardware at work until its clock has risen, then the runs; fills what the contenders know
 * of the last wave. */
bool bench_contest_wave(struct bench_contest *contest, const struct bench_wave *wave, struct error *error);
/* Runs once untimed through the interface and returns the hits, for waves that are made from them. */
bool bench_contest_hits(struct bench_contest *contest, struct tracer *tracer, const struct bench_wave *wave,
                        struct hit *hits, struct error *error);
/* More than 0.01 % of the rays wrong, edges aside. */
bool bench_contender_failed(const struct bench_contender *contender, uint32_t ray_count);
void bench_contest_finish(struct bench_contest *contest); /* the buffers */

#endif
