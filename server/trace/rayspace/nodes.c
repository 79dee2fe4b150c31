// SPDX-License-Identifier: MIT
/* The hierarchy over the rays, level by level (section 3.2 of the paper). */
#include "trace/rayspace/tracer.h"

#include "gpu/program.h"
#include "shared/bindings.h"

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

bool rayspace_nodes_reserve(struct rayspace_state *state, struct gpu_device *device, struct error *error)
{
    const size_t nodes = state->levels.first[state->levels.top] + 1u;
    return gpu_buffer_reserve(device, &state->nodes, nodes * sizeof(struct rayspace_node), error);
}

bool rayspace_nodes_build(struct rayspace_state *state, struct gpu_scene *scene, struct error *error)
{
    struct gpu_device *device = scene->device;
    const struct rayspace_levels *levels = &state->levels;
    for (uint32_t level = 1; level <= levels->top; level++) {
        const struct gpu_define own[] = {{level == 1 ? "NODES_OF_RAYS" : NULL, "1"}, {0}};
        const struct gpu_program *program = rayspace_program_get(scene, state, "rayspace/nodes.comp", own, error);
        if (!program)
            return false;
        rayspace_bind_wave(scene, state, program);
        gpu_buffer_bind_texels(device, &state->nodes, UNIT_RAYSPACE_NODES, GL_RGBA32F);
        gpu_buffer_bind_storage(&state->nodes, BIND_RAYSPACE_NODES);
        gpu_uniform_uint(program, "below_first", levels->first[level - 1]);
        gpu_uniform_uint(program, "below_count", levels->count[level - 1]);
        gpu_uniform_uint(program, "own_first", levels->first[level]);
        gpu_uniform_uint(program, "own_count", levels->count[level]);
        gpu_dispatch(device, program, levels->count[level]);
    }
    return true;
}
