/* SPDX-License-Identifier: MIT */
/* The tracer `bvh`: stackless traversal of bounding volume trees by baked links (shaders/bvh/traverse.glsl). */
#ifndef FARLIGHT_TRACE_BVH_TRACER_H
#define FARLIGHT_TRACE_BVH_TRACER_H

#include "trace/tracer.h"
#include "trace/tree/tree.h"

struct bvh {
    struct tracer base;
    struct scene_tree tree;
};

/* State of one wave. */
struct bvh_state {
    struct trace_state base;
    uint32_t packet_rays;
    /* Rays that a dispatch has left unfinished: the number of rays from the first one without a final answer
     * (0: none), the place where each one resumes, the depths it has found, and whether any is left. */
    uint32_t unfinished_rays;
    struct gpu_buffer places, depths, unfinished;
};

/* Maximum distance of the origins of a packet's rays, in world space. Rays of a lens may start anywhere on it:
 * they meet again in the plane of focus. */
float bvh_packet_reach(const struct gpu_scene *scene, const struct wave *wave);

/* The value that bvh_packet_rays() finds for most waves of this kind. */
uint32_t bvh_packet_rays_expected(struct bvh *bvh, const struct wave *wave);
/* The packet size for the wave: the paper's, or the faster one for the wave's coherence, which is measured on a
 * sample. 0 on failure. */
uint32_t bvh_packet_rays(struct bvh *bvh, const struct gpu_scene *scene, const struct wave *wave,
                         struct error *error);
#endif
