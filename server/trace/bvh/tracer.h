/* SPDX-License-Identifier: MIT */
/* The tracer `bvh`: stackless traversal of bounding volume trees by baked links. Traversal:
 * shaders/bvh/traverse.glsl. */
#ifndef FARLIGHT_TRACE_BVH_TRACER_H
#define FARLIGHT_TRACE_BVH_TRACER_H

#include "trace/tracer.h"
#include "trace/tree/tree.h"

struct bvh {
    struct tracer base;
    struct scene_tree tree;
};

/* Of one wave. */
struct bvh_state {
    struct trace_state base;
    uint32_t packet_rays;
    /* Rays that a dispatch has not finished: so many from the first on that has no final answer, 0: none. Where
     * they go on, what they have found, and whether any is left. */
    uint32_t unfinished_rays;
    struct gpu_buffer places, depths, unfinished;
};

/* How far apart the origins of a packet's rays may be, in world space. Those of a lens may be all over it: its
 * rays meet again in the plane of focus. */
float bvh_packet_reach(const struct gpu_scene *scene, const struct wave *wave);

/* What bvh_packet_rays() finds of most such waves. */
uint32_t bvh_packet_rays_expected(struct bvh *bvh, const struct wave *wave);
/* The packet size for the wave: the paper's, or the faster one for the wave's coherence, which is measured on a
 * sample. 0: failed. */
uint32_t bvh_packet_rays(struct bvh *bvh, const struct gpu_scene *scene, const struct wave *wave,
                         struct error *error);
#endif
