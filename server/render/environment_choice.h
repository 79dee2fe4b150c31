/* SPDX-License-Identifier: MIT */
/* The environment's brightness by direction, from which shaders/common/environment_choice.glsl samples. */
#ifndef FARLIGHT_RENDER_ENVIRONMENT_CHOICE_H
#define FARLIGHT_RENDER_ENVIRONMENT_CHOICE_H

#include "gpu/buffer.h"
#include "render/environment.h"
#include "scene/scene.h"

struct environment_choice {
    bool known; /* the rest is of `revision` and `kind` */
    uint64_t revision;
    uint32_t kind;          /* ENVIRONMENT_* */
    uint32_t rows, columns; /* of the table; 0: there is none, as all directions are alike or black */
    struct gpu_buffer table;
};

/* Makes the table fit the environment. */
bool environment_choice_update(struct environment_choice *choice, struct gpu_device *device,
                               const struct environment *environment, const struct scene_environment *given,
                               struct error *error);
void environment_choice_finish(struct environment_choice *choice, struct gpu_device *device);

/* For tests: the table of luminances, those of each row side by side, rows of equal angles from +y down. `sums`
 * has room for rows + 1 + rows * (columns + 1). False: all are 0. */
bool environment_choice_sums(float *sums, const float *luminances, uint32_t rows, uint32_t columns);

#endif
