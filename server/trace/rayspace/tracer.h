/* SPDX-License-Identifier: MIT */
/* The tracer `rayspace`: a hierarchy over the rays of a wave, which descends the scene. Structs on the device:
 * shaders/rayspace/layout.h. */
#ifndef FARLIGHT_TRACE_RAYSPACE_TRACER_H
#define FARLIGHT_TRACE_RAYSPACE_TRACER_H

#include "rayspace/layout.h"
#include "trace/tracer.h"
#include "trace/tree/tree.h"

struct rayspace {
    struct tracer base;
    struct scene_tree tree;
    struct gpu_buffer ranks; /* of each instance: its first primitive's */
};

/* Where the nodes of each level lie; those of level 0 are the rays. */
struct rayspace_levels {
    uint32_t top; /* the level of one node */
    uint32_t first[RAYSPACE_LEVELS], count[RAYSPACE_LEVELS];
};

/* Of one wave. */
struct rayspace_state {
    struct trace_state base;
    struct rayspace_levels levels;
    struct gpu_buffer nodes, answers, stacks[2], leaves, control;
    uint32_t capacity, leaves_capacity; /* pairs */
    uint32_t from;                      /* the stack that the next pass takes from */
    struct rayspace_control told;       /* as the host has last seen it */
};

/* Levels over so many rays. */
struct rayspace_levels rayspace_levels_over(uint32_t ray_count);
/* Reserves the nodes, and builds them. `ends`: only how far rays go on. */
bool rayspace_nodes_build(struct rayspace_state *state, struct gpu_scene *scene, bool ends, struct error *error);
/* Sets the descent to its beginning; passes until about that time, or all; the answers to the wave's hits. */
bool rayspace_descent_begin(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                            struct error *error);
enum tracer_progress rayspace_descent_step(struct rayspace *rayspace, struct gpu_scene *scene,
                                           struct rayspace_state *state, uint64_t step_end_ns,
                                           struct error *error);
bool rayspace_descent_finish(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                             struct error *error);

#endif
