/* SPDX-License-Identifier: MIT */
/* Passes of a build over the scene. */
#include "trace/ldc/build_state.h"

#include <epoxy/gl.h>
#include <string.h>

/* Primitives drawn by the very first unit. */
#define PRIMITIVES_FIRST 2048u

/* Draws the next primitives and learns from their time how many the next unit draws. The first ones of a pass
 * do not count: a program may have been compiled for them. */
static bool draw_some(struct ldc_task *task, const struct axes_pass *pass, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    const uint32_t left = builder->draw.primitive_count - task->drawn;
    if (builder->primitives_a_unit == 0)
        builder->primitives_a_unit = PRIMITIVES_FIRST;
    const uint32_t count = builder->primitives_a_unit < left ? builder->primitives_a_unit : left;
    const uint64_t start_ns = clock_now_ns();
    if (!axes_draw_range(&builder->draw, task->scene, pass, task->drawn, task->drawn + count, error))
        return false;
    gpu_finish(builder->device);
    if (task->drawn > 0 && count == builder->primitives_a_unit)
        builder->primitives_a_unit = step_batch_items(count, clock_now_ns() - start_ns);
    task->drawn += count;
    return true;
}

bool ldc_draw(struct ldc_task *task, enum ldc_pass pass,
              void (*set)(const void *task, const struct gpu_program *program), ldc_unit *then,
              struct error *error)
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
        .overlap = task->options->ldc.form == TRACER_FORM_PAPER ? 1.0f : AXES_OVERLAP,
        .set = set,
        .context = task,
    };
    memcpy(own.lower_world, task->cube->lower_world, sizeof(own.lower_world));
    bool good =
        task->at_once ? axes_draw(&task->builder->draw, task->scene, &own, error) : draw_some(task, &own, error);
    if (good && (task->at_once || task->drawn == task->builder->draw.primitive_count)) {
        task->drawn = 0;
        task->next = then;
    }
    return good;
}
