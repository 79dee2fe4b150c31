/* SPDX-License-Identifier: MIT */
/* The tracer `rayspace`: a hierarchy over the rays of a wave, which descends the scene. Structs on the device:
 * shaders/rayspace/layout.h. */
#ifndef FARLIGHT_TRACE_RAYSPACE_TRACER_H
#define FARLIGHT_TRACE_RAYSPACE_TRACER_H

#include "gpu/program.h"
#include "gpu/readback.h"
#include "rayspace/layout.h"
#include "trace/rayspace/reduce.h"
#include "trace/tracer.h"
#include "trace/tree/tree.h"

struct rayspace {
    struct tracer base;
    struct scene_tree tree;  /* empty in the flat mode */
    struct gpu_buffer ranks; /* of each instance: its first primitive's */
    uint32_t rank_count;
};

/* Where the nodes of each level lie; those of level 0 are the rays. */
struct rayspace_levels {
    uint32_t top; /* the level of one node */
    uint32_t first[RAYSPACE_LEVELS], count[RAYSPACE_LEVELS];
};

/* Whether something is done to the rays of a wave: where a sample of them says that it pays, always, never. */
enum rayspace_chance { RAYSPACE_CHANCE_AUTO, RAYSPACE_CHANCE_ON, RAYSPACE_CHANCE_OFF };

/* Of one wave. */
struct rayspace_state {
    struct trace_state base;
    struct rayspace_levels levels;
    struct gpu_buffer nodes, answers, stacks[RAYSPACE_STACKS], leaves, control;
    struct gpu_buffer order, bins;     /* of the sort */
    struct gpu_buffer counts;          /* of the frame, by kinds of rays */
    struct gpu_readback copied_counts; /* on their way to the host */
    struct gpu_buffer items;           /* of the flat descent: of the batch in hand */
    uint32_t capacity;                 /* pairs, of each stack and of the leaves */
    uint32_t capacity_fits;            /* at most so many, as memory was short; 0: it was not */
    struct rayspace_reduction reduction;
    uint32_t batch_max;   /* items */
    uint32_t next_rank;   /* the first primitive of the next batch */
    uint32_t seeds;       /* pairs that were put onto the stack of the next pass */
    bool turn, last_turn; /* from the second stack onto the first; of the last pass */
    enum rayspace_chance sorts, turns;
    struct rayspace_control told; /* as the host has last seen it */
    /* Halvings of the batch that the last waves of a family needed. */
    uint8_t halved[WAVE_FAMILIES];
};

/* A program of shaders/rayspace that looks at the rays of a wave, for its kind, with defines of its own, at most
 * RAYSPACE_DEFINES; they end with {0}. */
#define RAYSPACE_DEFINES 5
const struct gpu_program *rayspace_program_get(const struct gpu_scene *scene, const struct rayspace_state *state,
                                               const char *compute, const struct gpu_define *own,
                                               struct error *error);
/* Binds the rays, how many they are, the control, the answers and the order. */
void rayspace_bind_wave(const struct gpu_scene *scene, struct rayspace_state *state,
                        const struct gpu_program *program);

/* Levels over so many rays. */
struct rayspace_levels rayspace_levels_over(uint32_t ray_count);
/* Memory for the nodes of the levels, and for the order of the rays. */
bool rayspace_nodes_reserve(struct rayspace_state *state, struct gpu_device *device, struct error *error);
bool rayspace_order_reserve(struct rayspace_state *state, struct gpu_device *device, struct error *error);
bool rayspace_nodes_build(struct rayspace_state *state, struct gpu_scene *scene, struct error *error);
/* Decides whether the rays are sorted and turned round, and sorts them. The control is there. */
bool rayspace_order_rays(struct rayspace_state *state, struct gpu_scene *scene, struct error *error);

/* Adds what the wave that was traced has cost to the sums of the frame; the other two are as tracer_impl says. */
bool rayspace_counts_add(struct rayspace_state *state, struct gpu_scene *scene, struct error *error);
bool rayspace_counts_copy(struct trace_state *state, struct error *error);
bool rayspace_counts_tell(struct trace_state *state, struct structure_rows *rows, struct error *error);

/* The paper's descent; else that of both hierarchies. */
bool rayspace_is_flat(const struct tracer_options *options);
/* Whether all of a wave is queued without the host seeing how far it has come. */
bool rayspace_is_ahead(const struct rayspace_state *state);
/* Sets the descent to its beginning; passes until about that time, or all; the answers to the wave's hits. */
bool rayspace_descent_begin(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                            struct error *error);
enum tracer_progress rayspace_descent_step(struct rayspace *rayspace, struct gpu_scene *scene,
                                           struct rayspace_state *state, uint64_t step_end_ns,
                                           struct error *error);
bool rayspace_descent_finish(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                             struct error *error);

#endif
