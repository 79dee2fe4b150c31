/* SPDX-License-Identifier: MIT */
/* A figure of a benchmark: several runs, told as their median and how far they lie from it. */
#ifndef FARLIGHT_TESTS_BENCH_STATS_H
#define FARLIGHT_TESTS_BENCH_STATS_H

#include <jansson.h>
#include <stdint.h>

#define BENCH_RUNS_MAX 64

struct bench_runs {
    uint64_t times_ns[BENCH_RUNS_MAX];
    unsigned count;
};

struct bench_figure {
    double median_ns, min_ns, max_ns;
    double deviation_ns; /* median of the absolute deviations from the median */
};

void bench_add(struct bench_runs *runs, uint64_t time_ns);       /* beyond BENCH_RUNS_MAX: forgotten */
struct bench_figure bench_figure(const struct bench_runs *runs); /* zeros without runs */
json_t *bench_times_json(const struct bench_runs *runs);         /* an array of them */

#endif
