/* SPDX-License-Identifier: MIT */
/* Counts and state of a wave, kept on the device. */
#ifndef FARLIGHT_SHARED_WAVE_H
#define FARLIGHT_SHARED_WAVE_H
#include "shared/types.h"

/* Number of items of a list made on the device, and the work groups of a dispatch with one invocation for each
 * and 64 in a group, over two axes, counted as in common/dispatch.glsl. The last three words are the arguments
 * of an indirect dispatch. */
struct wave_counts {
    uint count;
    uint groups_x, groups_y, groups_z;
};
SHARED_SIZE(wave_counts, 16)
#define WAVE_GROUPS_MAX 65535u /* along x; every device allows as many */

/* Lists of the current wave, and the outcome of its slice. A std140 block of the passes that read it; the
 * passes that make the lists write it. */
struct wave_state {
    SHARED(wave_counts) rays, ray_blocks; /* COMPACT_BLOCK rays each */
    SHARED(wave_counts) hits, hit_blocks; /* hit_blocks: COMPACT_BLOCK hits each */
    SHARED(wave_counts)
    shadow_rays;             /* those of the current batch; only where the host does not know the
                                number */
    uint all_secondary_rays; /* sum over the slice so far */
    uint all_shadow_rays;
    uint all_sorted_waves;
    uint sorted; /* 1: the children of the current wave are, by the octants of their directions */
    /* A WAVE_STOPPED_ value that says why the slice must be repeated; 0: it need not. It stays until the host
     * has read it, and keeps this slice and all that are queued behind it out of the picture. */
    uint stopped;
    uint pad0, pad1, pad2;
};
SHARED_SIZE(wave_state, 112)

#define WAVE_STOPPED_FULL 1u   /* a wave is larger than the buffers */
#define WAVE_STOPPED_QUEUED 2u /* rays remain after the last queued wave */
#define WAVE_STOPPED_LONG 3u   /* a ray takes longer than a dispatch may */

#define UNIFORM_WAVE 1 /* binding of the uniform block */

#endif
