/* SPDX-License-Identifier: MIT */
/* The camera of a bench that moves as a viewer's does. */
#ifndef FARLIGHT_TESTS_BENCH_CAMERA_H
#define FARLIGHT_TESTS_BENCH_CAMERA_H

#include "tests/bench/bench_scene.h"

#include "viewer/camera.h"

#include <math.h>

/* A step of one of four parts: it orbits, moves aside, comes nearer or looks round. */
static inline void bench_camera_move(struct viewer_camera *camera, uint32_t part, double speed)
{
    const double pixel = speed / 240;
    if (part == 0)
        camera_orbit(camera, 3.5 * pixel, -3.5 * 0.2 * pixel);
    else if (part == 1)
        camera_pan(camera, pixel, 0);
    else if (part == 2)
        camera_dolly(camera, pow(0.88, 0.15 * speed), 1e-4);
    else
        camera_turn(camera, 1.6 * 2 * pixel, 0);
}

/* As the viewer takes over the daemon's camera: the target is the middle of the scene. */
static inline struct viewer_camera bench_camera_first(const struct bench_scene *scene)
{
    const float *m = scene->camera.world_from_view;
    struct viewer_camera camera = {.up = {0, 1, 0}, .fov_y = (double)scene->camera.fov_y};
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double middle = 0.5 * ((double)scene->gpu.lower_world[i] + (double)scene->gpu.upper_world[i]);
        camera.eye[i] = (double)m[4 * i + 3];
        square += (middle - camera.eye[i]) * (middle - camera.eye[i]);
    }
    for (int i = 0; i < 3; i++)
        camera.look_at[i] = camera.eye[i] - sqrt(square) * (double)m[4 * i + 2];
    return camera;
}

#endif
