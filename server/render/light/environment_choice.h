/* SPDX-License-Identifier: MIT */
/* The environment's brightness by direction, from which shaders/common/environment_choice.glsl samples. */
#ifndef FARLIGHT_RENDER_LIGHT_ENVIRONMENT_CHOICE_H
#define FARLIGHT_RENDER_LIGHT_ENVIRONMENT_CHOICE_H

#include "gpu/buffer.h"
#include "gpu/program.h"
#include "render/light/environment.h"
#include "scene/scene.h"

struct environment_choice {
    bool known; /* the rest is of `revision` and `kind` */
    uint64_t revision;
    uint32_t kind;          /* ENVIRONMENT_* */
    uint32_t rows, columns; /* size of the table; 0: there is none, as all directions are alike or black */
    float extent; /* steradians over which its light is spread: the square of its sum by the sum of its squares */
    struct gpu_buffer table;
};

/* Makes the table fit the environment. */
bool environment_choice_update(struct environment_choice *choice, struct gpu_device *device,
                               const struct environment *environment, const struct scene_environment *given,
                               struct error *error);
/* Binds the table to a program in use, with HAS_ENVIRONMENT_TABLE if there is one. */
void environment_choice_bind(struct environment_choice *choice, struct gpu_device *device,
                             const struct gpu_program *program);
void environment_choice_finish(struct environment_choice *choice, struct gpu_device *device);

#endif
