/* SPDX-License-Identifier: MIT */
/* The command line of bench_tracers. */
#ifndef FARLIGHT_TESTS_BENCH_OPTIONS_H
#define FARLIGHT_TESTS_BENCH_OPTIONS_H

#include "gpu/device.h"
#include "tests/bench/bench_scene.h"
#include "tests/bench/bench_waves.h"

#include <stdbool.h>
#include <stdint.h>

struct bench_options {
    struct bench_scene_options scene;
    uint32_t width, height, rays_each;
    unsigned runs;
    bool waves[BENCH_WAVE_KINDS];
    const char *tracers; /* names with commas; NULL: all but naive */
    bool quick;
};

extern const char bench_usage[];

/* False: what is wrong was said on standard error, the usage was not. Strings of argv stay in use. */
bool bench_parse(int argc, char **argv, struct bench_options *options, struct gpu_options *gpu);
/* Whether `name` is one of a list of names with commas in between. */
bool bench_is_named(const char *list, const char *name);

#endif
