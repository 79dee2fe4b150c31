/* SPDX-License-Identifier: MIT */
/* The command line of `bench tracers`, and what it has in common with others. */
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
/* Values of options; false: the text is none. */
bool bench_parse_vector(const char *text, float v[3]);
bool bench_parse_number(const char *text, uint32_t minimum, uint32_t maximum, uint32_t *value);
bool bench_parse_real(const char *text, float *value);                      /* above 0 */
bool bench_parse_size(const char *text, uint32_t *width, uint32_t *height); /* WxH, multiples of 8 up to 4096 */
bool bench_parse_waves(const char *text, bool waves[BENCH_WAVE_KINDS]);     /* names with commas in between */
/* --model m, --family f, --eye e, --look-at l, --up u and --fov v; false for others, too. */
bool bench_parse_scene(int option, const char *text, struct bench_scene_options *scene);
/* *found: the place of the text among the words. */
bool bench_parse_word(const char *text, const char *const words[], uint32_t count, uint32_t *found);
/* Whether `name` is one of a list of names with commas in between. */
bool bench_is_named(const char *list, const char *name);

#endif
