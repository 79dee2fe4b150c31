/* SPDX-License-Identifier: MIT */
/* Scenes of benchmarks: a model or a member of a family of similar scenes, on the device, with a camera and a
 * light. */
#ifndef FARLIGHT_TESTS_BENCH_SCENE_H
#define FARLIGHT_TESTS_BENCH_SCENE_H

#include "render/frame/frame.h"
#include "tests/fixtures/load_model.h"
#include "gpu_scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

struct bench_scene_options {
    const char *model;         /* a file; NULL: the family */
    uint32_t family_triangles; /* about so many */
    bool has_eye;              /* else the model's first camera, or one that sees all */
    float eye[3], look_at[3], up[3], fov_y;
    float aspect;
};

struct bench_scene {
    struct loaded_model loaded;
    struct gpu_scene gpu;
    struct frame_camera camera;            /* perspective */
    float light_world[3];                  /* a point that shadow rays go to */
    uint64_t triangle_count, sphere_count; /* counted for every instance, as rays see them */
};

/* The device must be current. Zeroes *scene first, which is to be finished either way. */
bool bench_scene_init(struct bench_scene *scene, struct gpu_device *device,
                      const struct bench_scene_options *options, struct error *error);
void bench_scene_finish(struct bench_scene *scene);

#endif
