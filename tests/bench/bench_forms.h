/* SPDX-License-Identifier: MIT */
/* What the parts of `bench forms` share: a scene, and tracers with options, its forms. */
#ifndef FARLIGHT_TESTS_BENCH_FORMS_H
#define FARLIGHT_TESTS_BENCH_FORMS_H

#include "gpu/device.h"
#include "tests/bench/bench_contest.h"
#include "tests/bench/bench_scene.h"
#include "trace/tracer.h"

#include <jansson.h>

#define BENCH_FORMS_MAX 12
#define BENCH_TRACER_RIVAL 1000u /* none of the protocol's: an impl of the benchmark's own */

struct bench_form {
    const char *name;
    unsigned tracer; /* protocol's number */
    const struct tracer_impl *rival;
    struct tracer_options options;
    uint32_t ao_rays;    /* of frames, a pixel; 0: as the benchmark has it */
    struct tracer *made; /* where a part makes one; finished with the bench */
};

struct bench_forms {
    struct gpu_device *device;
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    uint32_t width, height, depth, rays_each, ao_rays;
    enum integrator_kind integrator;
    unsigned runs;
    bool waves[BENCH_WAVE_KINDS];
    bool plays; /* the model's first clip */
    bool once;  /* frames without a warm-up: for what they show, not for their time */
    struct bench_form forms[BENCH_FORMS_MAX];
    unsigned form_count;
};

/* Each returns an array with an object a form, NULL and *error if it failed. */
json_t *bench_forms_builds(struct bench_forms *bench, struct error *error);
json_t *bench_forms_samples(struct bench_forms *bench, struct error *error);
json_t *bench_forms_waves(struct bench_forms *bench, struct error *error);
json_t *bench_forms_frames(struct bench_forms *bench, struct error *error);

/* The tracer that a form is of, NULL and *error: there is none. */
const struct tracer_impl *bench_form_impl(const struct bench_form *form, struct error *error);
json_t *bench_structure_json(const struct structure_rows *rows);
/* "NAME" or "NAME:KEY=VALUE,..": a tracer with options. `text` is changed; the form's name is to be freed. */
bool bench_form_parse(struct bench_form *form, char *text);

#endif
