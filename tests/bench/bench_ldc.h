/* SPDX-License-Identifier: MIT */
/* What the parts of bench_ldc share: a scene, and tracers with options, its forms. */
#ifndef FARLIGHT_TESTS_BENCH_LDC_H
#define FARLIGHT_TESTS_BENCH_LDC_H

#include "gpu/device.h"
#include "tests/bench/bench_contest.h"
#include "tests/bench/bench_scene.h"
#include "trace/tracer.h"

#include <jansson.h>

#define BENCH_FORMS_MAX 12
#define BENCH_TRACER_REFERENCE 2u /* the protocol's numbers */
#define BENCH_TRACER_LDC 3u

struct bench_form {
    const char *name;
    unsigned tracer; /* protocol's number */
    struct tracer_options options;
    struct tracer *made; /* where a part makes one; finished with the bench */
};

struct bench_ldc {
    struct gpu_device *device;
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    uint32_t width, height, depth;
    unsigned runs;
    bool waves[BENCH_WAVE_KINDS];
    bool plays; /* the model's first clip */
    struct bench_form forms[BENCH_FORMS_MAX];
    unsigned form_count;
};

/* Each returns an array with an object a form, NULL and *error if it failed. */
json_t *bench_ldc_builds(struct bench_ldc *bench, struct error *error);
json_t *bench_ldc_samples(struct bench_ldc *bench, struct error *error);
json_t *bench_ldc_waves(struct bench_ldc *bench, struct error *error);
json_t *bench_ldc_frames(struct bench_ldc *bench, struct error *error);

json_t *bench_cubes_json(const struct tracer_cube cubes[TRACER_CUBES_MAX]); /* those that there are */
json_t *bench_times_json(const struct bench_runs *runs);
/* "NAME" or "NAME:KEY=VALUE,..": bvh, reference, or ldc with options. `text` stays in use and is changed. */
bool bench_form_parse(struct bench_form *form, char *text);

#endif
