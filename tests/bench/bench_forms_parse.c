/* SPDX-License-Identifier: MIT */
/* Forms as they are given on the command line. */
#include "tests/bench/bench_forms.h"
#include "tests/bench/bench_options.h"
#include "tests/bench/plain_pass.h"
#include "tests/bench/svo.h"

#include <stdlib.h>
#include <string.h>

static bool set_ldc_key(struct tracer_options *options, const char *key, const char *value)
{
    static const char *const builds[] = {"auto", "peel", "lists"}, *const images[] = {"overlap", "one"};
    static const char *const levels[] = {"auto", "blocks", "pyramid", "cells"};
    uint32_t word = 0;
    bool known;
    if (strcmp(key, "build") == 0) {
        known = bench_parse_word(value, builds, 3, &word);
        options->ldc.build = word;
        return known;
    }
    if (strcmp(key, "levels") == 0) {
        known = bench_parse_word(value, levels, 4, &word);
        options->ldc.levels = word;
        return known;
    }
    if (strcmp(key, "images") == 0) {
        known = bench_parse_word(value, images, 2, &word);
        options->ldc.images = word;
        return known;
    }
    if (strcmp(key, "tolerance") == 0) {
        char *end;
        options->ldc.tolerance = strtof(value, &end);
        return end != value && *end == '\0' && options->ldc.tolerance >= 0;
    }
    return false;
}

static bool set_key(struct bench_form *form, const char *key, const char *value)
{
    static const char *const searches[] = {"auto",    "dda",     "linear3", "linear1",
                                           "voxels3", "voxels1", "parity3", "parity1"};
    struct tracer_options *options = &form->options;
    const bool is_ldc = form->tracer == TRACER_LDC, is_abuffer = form->tracer == TRACER_ABUFFER;
    const struct {
        const char *key;
        uint32_t *number;
        bool fits;
    } numbers[] = {{"resolution", &options->ldc.resolution, is_ldc},
                   {"block", &options->ldc.block, is_ldc},
                   {"rays", &options->ldc.rays, is_ldc},
                   {"layers", &options->bench.ldc_layers_together, is_ldc},
                   {"resolution", &options->abuffer.resolution, is_abuffer},
                   {"resolution", &options->bench.baseline_side, form->rival},
                   {"voxels", &options->abuffer.voxels, is_abuffer},
                   {"ao", &form->ao_rays, true}};
    for (size_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++)
        if (numbers[i].fits && strcmp(key, numbers[i].key) == 0)
            return bench_parse_number(value, 1, 4096, numbers[i].number);
    if (is_abuffer && strcmp(key, "search") == 0) {
        uint32_t word = 0;
        const bool known = bench_parse_word(value, searches, 8, &word);
        options->abuffer.search = word;
        return known;
    }
    return is_ldc && set_ldc_key(options, key, value);
}

static bool set_tracer(struct bench_form *form, const char *name)
{
    static const char *const tracers[] = {"bvh", "naive", "reference", "ldc", "abuffer"};
    static const struct {
        const char *name;
        const struct tracer_impl *impl;
    } rivals[] = {{"svo-cells", &svo_cells_impl},
                  {"svo-planes", &svo_planes_impl},
                  {"svo-tiles", &svo_tiles_impl},
                  {"plain", &plain_pass_impl}};
    for (size_t i = 0; i < sizeof(rivals) / sizeof(*rivals); i++) {
        if (strcmp(name, rivals[i].name) == 0) {
            form->tracer = BENCH_TRACER_RIVAL;
            form->rival = rivals[i].impl;
            return true;
        }
    }
    return bench_parse_word(name, tracers, sizeof(tracers) / sizeof(*tracers), &form->tracer);
}

bool bench_form_parse(struct bench_form *form, char *text)
{
    char *name = strdup(text);
    *form = (struct bench_form){.name = name};
    char *options = strchr(text, ':'), *rest = NULL;
    if (options)
        *options++ = '\0';
    bool good = name && set_tracer(form, text);
    for (char *pair = options ? strtok_r(options, ",", &rest) : NULL; good && pair;
         pair = strtok_r(NULL, ",", &rest)) {
        char *value = strchr(pair, '=');
        if (!value)
            return false;
        *value++ = '\0';
        good = set_key(form, pair, value);
    }
    return good;
}

const struct tracer_impl *bench_form_impl(const struct bench_form *form, struct error *error)
{
    return form->rival ? form->rival : tracer_find(form->tracer, "--form", error);
}
