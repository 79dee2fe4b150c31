/* SPDX-License-Identifier: MIT */
/* The tracer `rayspace`: a hierarchy over the rays of a wave descends the scene. Structs on the device:
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
    struct gpu_buffer ranks; /* rank of each instance's first primitive */
    uint32_t rank_count;
};

/* Places of the nodes of each level. The rays themselves are level 0. */
struct rayspace_levels {
    uint32_t top; /* the level with one node */
    uint32_t first[RAYSPACE_LEVELS], count[RAYSPACE_LEVELS];
};

/* When a treatment of a wave's rays is applied: where a sample of them shows that it pays, always, never. */
enum rayspace_chance { RAYSPACE_CHANCE_AUTO, RAYSPACE_CHANCE_ON, RAYSPACE_CHANCE_OFF };

/* State of one wave. */
struct rayspace_state {
    struct trace_state base;
    struct rayspace_levels levels;
    struct gpu_buffer nodes, answers, stacks[RAYSPACE_STACKS], leaves, control;
    struct gpu_buffer order, bins;     /* buffers of the sort */
    struct gpu_buffer counts;          /* counts of the frame, by kind of rays */
    struct gpu_readback copied_counts; /* on their way to the host */
    struct gpu_buffer items;           /* flat descent: items of the current batch */
    uint32_t capacity;                 /* pairs in each stack, and leaves */
    uint32_t capacity_fits;            /* maximum that memory allows; 0: no limit met yet */
    struct rayspace_reduction reduction;
    uint32_t disc_rays,
        finished_rays; /* rays of the wave that were tested with all discs, before and after the descent */
    bool has_nodes, has_descended; /* the wave's rays */
    uint32_t batch_max;            /* items in a batch */
    uint32_t next_rank;            /* the first primitive of the next batch */
    uint32_t seeds;                /* pairs pushed for the next pass */
    bool turn, last_turn; /* direction of the next pass (from the second stack to the first), and of the last
                             one */
    enum rayspace_chance sorts, turns;
    struct rayspace_control told; /* control as the host last read it */
    /* Halvings of the batch that the last waves of a family needed. */
    uint8_t halved[WAVE_FAMILIES];
};

/* Gets a program of shaders/rayspace that reads the rays of a wave, for its kind, with at most RAYSPACE_DEFINES
 * further defines, which end with {0}. */
#define RAYSPACE_DEFINES 5
const struct gpu_program *rayspace_program_get(const struct gpu_scene *scene, const struct rayspace_state *state,
                                               const char *compute, const struct gpu_define *own,
                                               struct error *error);
/* Binds the rays and their number, the control, the answers and the order. */
void rayspace_bind_wave(const struct gpu_scene *scene, struct rayspace_state *state,
                        const struct gpu_program *program);

/* The levels over `ray_count` rays. */
struct rayspace_levels rayspace_levels_over(uint32_t ray_count);
/* Reserve memory for the nodes of the levels, and for the order of the rays. */
bool rayspace_nodes_reserve(struct rayspace_state *state, struct gpu_device *device, struct error *error);
bool rayspace_order_reserve(struct rayspace_state *state, struct gpu_device *device, struct error *error);
bool rayspace_nodes_build(struct rayspace_state *state, struct gpu_scene *scene, struct error *error);
/* Decides whether to sort the rays and to reverse them, and sorts them. The control must be ready. */
bool rayspace_order_rays(struct rayspace_state *state, struct gpu_scene *scene, struct error *error);

/* Adds the cost of a traced wave to the sums of the frame; the other two implement tracer_impl's functions. */
bool rayspace_counts_add(struct rayspace_state *state, struct gpu_scene *scene, struct error *error);
bool rayspace_counts_copy(struct trace_state *state, struct error *error);
bool rayspace_counts_report(struct trace_state *state, struct structure_rows *rows, struct error *error);

/* Whether the descent is the paper's, not the joint one of both hierarchies. */
bool rayspace_is_flat(const struct tracer_options *options);
/* Whether a whole wave is queued without the host reading its progress. */
bool rayspace_is_ahead(const struct rayspace_state *state);
/* Prepare the descent; run passes until about step_end_ns, or all; write the answers to the wave's hits. */
bool rayspace_descent_begin(struct rayspace *rayspace, struct gpu_scene *scene, struct rayspace_state *state,
                            struct error *error);
enum tracer_progress rayspace_descent_step(struct rayspace *rayspace, struct gpu_scene *scene,
                                           struct rayspace_state *state, uint64_t step_end_ns,
                                           struct error *error);
enum tracer_progress rayspace_descent_finish(struct rayspace *rayspace, struct gpu_scene *scene,
                                             struct rayspace_state *state, struct error *error);

#endif
