// SPDX-License-Identifier: MIT
/* The hierarchy over the rays, level by level (section 3.2 of the paper). */
#include "trace/rayspace/tracer.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "trace/program.h"

#include <epoxy/gl.h>

struct rayspace_levels rayspace_levels_over(uint32_t ray_count)
{
    struct rayspace_levels levels = {.count[0] = ray_count};
    uint32_t nodes = 0;
    while (levels.count[levels.top] > 1) {
        const uint32_t below = levels.count[levels.top++];
        levels.first[levels.top] = nodes;
        levels.count[levels.top] = (below - 1) / RAYSPACE_NODE_CHILDREN + 1;
        nodes += levels.count[levels.top];
    }
    return levels;
}

static const struct gpu_program *program_of(const struct gpu_scene *scene, const struct wave *wave, bool of_rays,
                                            bool ends, struct error *error)
{
    struct gpu_define defines[TRACE_WAVE_DEFINES + 3] = {0};
    size_t n = trace_wave_defines(scene, wave, defines);
    if (of_rays)
        defines[n++] = (struct gpu_define){"NODES_OF_RAYS", "1"};
    if (ends)
        defines[n++] = (struct gpu_define){"NODES_ENDS", "1"};
    const struct gpu_program_source source = {.compute = "rayspace/nodes.comp", .defines = defines};
    return gpu_program_get(scene->device, &source, error);
}

bool rayspace_nodes_build(struct rayspace_state *state, struct gpu_scene *scene, bool ends, struct error *error)
{
    struct gpu_device *device = scene->device;
    const struct rayspace_levels *levels = &state->levels;
    const struct wave *wave = &state->base.wave;
    const size_t nodes = levels->first[levels->top] + 1u;
    if (!gpu_buffer_reserve(device, &state->nodes, nodes * sizeof(struct rayspace_node), error))
        return false;
    for (uint32_t level = 1; level <= levels->top; level++) {
        const struct gpu_program *program = program_of(scene, wave, level == 1, ends, error);
        if (!program)
            return false;
        trace_bind_rays(scene, wave);
        gpu_buffer_bind_texels(device, &state->nodes, UNIT_RAYSPACE_NODES, GL_RGBA32F);
        gpu_buffer_bind_storage(&state->nodes, BIND_RAYSPACE_NODES);
        gpu_buffer_bind_texels(device, &state->order, UNIT_RAYSPACE_ORDER, GL_R32UI);
        gpu_buffer_bind_storage(&state->answers, BIND_RAYSPACE_ANSWERS);
        gpu_buffer_bind_storage(&state->control, BIND_RAYSPACE_CONTROL);
        if (wave->counts)
            gpu_buffer_bind_storage(wave->counts, BIND_WAVE);
        gpu_uniform_uint(program, "counts_index", wave->counts_index);
        gpu_uniform_uint(program, "ray_count", wave->ray_count);
        gpu_uniform_uint(program, "below_first", levels->first[level - 1]);
        gpu_uniform_uint(program, "below_count", levels->count[level - 1]);
        gpu_uniform_uint(program, "own_first", levels->first[level]);
        gpu_uniform_uint(program, "own_count", levels->count[level]);
        gpu_dispatch(device, program, levels->count[level]);
    }
    return true;
}
