/* SPDX-License-Identifier: MIT */
/* What is looked at: a model or one of a family of like scenes, on the device, with a camera and a light. */
#ifndef FARLIGHT_TESTS_BENCH_SCENE_H
#define FARLIGHT_TESTS_BENCH_SCENE_H

#include "render/frame.h"
#include "tests/fixtures/load_model.h"
#include "gpu_scene/scene.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

struct bench_scene_options {
    const char *model;         /* a file; NULL: the family */
    uint32_t family_triangles; /* about so many */
    uint32_t sheets;           /* bench_sheets.h, in place of either; 0: none */
    bool mirrors, glass;       /* everything is one, or of it */
    bool has_eye;              /* else the model's first camera, or one that sees all */
    float eye[3], look_at[3], up[3], fov_y;
    float aspect;
};

struct bench_scene {
    struct loaded_model loaded;
    struct gpu_scene gpu;
    struct frame_camera camera;            /* perspective */
    float light_world[3];                  /* a point that shadow rays go to */
    uint64_t triangle_count, sphere_count; /* as the rays meet them: every instance counts */
};

/* The device must be current. Zeroes *scene first, which is to be finished either way. */
bool bench_scene_init(struct bench_scene *scene, struct gpu_device *device,
                      const struct bench_scene_options *options, struct error *error);
void bench_scene_finish(struct bench_scene *scene);
/* Writes {"scene", "triangles", "device", "software"} and what is `measured`, which it takes, as an object on a
 * line of standard output. False: there is none, or it cannot be written. */
bool bench_scene_print(const struct bench_scene *scene, const struct bench_scene_options *options,
                       const struct gpu_device *device, json_t *measured);
/* The camera after it has gone so many metres right, up and ahead. */
struct frame_camera bench_moved(const struct frame_camera *camera, const float way[3]);

/* Nine bumpy spheres on a floor, one mesh: the tree is to be measured, not the number of instances. */
struct scene *bench_family_scene(uint32_t triangles);

#endif
