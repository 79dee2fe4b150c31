/* SPDX-License-Identifier: MIT */
#include "tests/bench/bench_stats.h"

#include <math.h>
#include <stdlib.h>

void bench_add(struct bench_runs *runs, uint64_t time_ns)
{
    if (runs->count < BENCH_RUNS_MAX)
        runs->times_ns[runs->count++] = time_ns;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double median(double *values, unsigned count)
{
    qsort(values, count, sizeof(*values), by_size);
    return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

struct bench_figure bench_figure(const struct bench_runs *runs)
{
    struct bench_figure figure = {0};
    double values[BENCH_RUNS_MAX];
    if (runs->count == 0)
        return figure;
    for (unsigned i = 0; i < runs->count; i++)
        values[i] = (double)runs->times_ns[i];
    figure.median_ns = median(values, runs->count);
    figure.min_ns = values[0];
    figure.max_ns = values[runs->count - 1];
    for (unsigned i = 0; i < runs->count; i++)
        values[i] = fabs(values[i] - figure.median_ns);
    figure.deviation_ns = median(values, runs->count);
    return figure;
}

json_t *bench_times_json(const struct bench_runs *runs)
{
    json_t *list = json_array();
    for (unsigned i = 0; i < runs->count; i++)
        json_array_append_new(list, json_integer((json_int_t)runs->times_ns[i]));
    return list;
}
