/* SPDX-License-Identifier: MIT */
/* The passes of a build over the scene. */
#include "trace/ldc_build_state.h"

#include <string.h>

bool ldc_draw(struct ldc_task *task, enum ldc_pass pass,
              void (*set)(const void *task, const struct gpu_program *program), struct error *error)
{
    static const char *const passes[] = {[LDC_PASS_LISTS] = "0", [LDC_PASS_COUNT] = "1", [LDC_PASS_PEEL] = "2"};
    struct gpu_define defines[1 + LDC_SAMPLE_DEFINES_MAX] = {{"BUILD_PASS", passes[pass]}};
    if (pass == LDC_PASS_PEEL)
        ldc_sample_defines(task, &defines[1]);
    struct axes_pass own = {
        .fragment = "ldc/build.frag",
        .defines = defines,
        .cell_world = task->cube->cell_world,
        .resolution = task->cube->resolution,
        .overlap = task->options->ldc_images == LDC_IMAGES_ONE ? 1.0f : AXES_OVERLAP,
        .set = set,
        .context = task,
    };
    memcpy(own.lower_world, task->cube->lower_world, sizeof(own.lower_world));
    return axes_draw(&task->builder->draw, task->scene, &own, error);
}
