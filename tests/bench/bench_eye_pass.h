/* SPDX-License-Identifier: MIT */
/* A whole eye without its shading: from the camera to where its rays hit. Of a tracer that finds eyes by a shorter
 * way (tracer_finds_eyes) that way; of the others rays, as frames make them, and their intersections. */
#ifndef FARLIGHT_TESTS_BENCH_EYE_PASS_H
#define FARLIGHT_TESTS_BENCH_EYE_PASS_H

#include "tests/bench/bench_scene.h"

#include "shared/frame.h"
#include "shared/hit.h"
#include "trace/tracer.h"

/* All-zero is empty. */
struct bench_eye_pass {
    struct gpu_device *device;
    struct gpu_scene *scene;
    struct frame_uniforms uniforms;
    struct gpu_buffer uniform_buffer, rays, paths, sums, hits;
    float key_eye[3], towards[3]; /* of the view that is seen from, and where that looks */
};

/* `camera`: the eye's; multiples of 8 pixels; `key`: of the structure's view, of the same size. */
bool bench_eye_pass_init(struct bench_eye_pass *pass, struct gpu_device *device, struct bench_scene *scene,
                         const struct frame_camera *camera, const struct trace_view *key, struct error *error);
void bench_eye_pass_finish(struct bench_eye_pass *pass);
/* Is done when it returns. */
bool bench_eye_pass_run(struct bench_eye_pass *pass, struct tracer *tracer, struct error *error);
bool bench_eye_pass_is_short(const struct bench_eye_pass *pass, const struct tracer *tracer);
/* After a short one: the distances along rays[], and HIT_UNKNOWN and HIT_LAYER bits, of the last run. */
bool bench_eye_pass_read(struct bench_eye_pass *pass, const struct ray *rays, struct hit *answers,
                         struct error *error);

#endif
