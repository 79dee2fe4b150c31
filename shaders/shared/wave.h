/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_SHARED_WAVE_H
#define FARLIGHT_SHARED_WAVE_H
#include "shared/types.h"

/* The number of items of a list that the device makes, and the work groups of a dispatch with one invocation for
 * each and 64 in a group, over two axes as common/dispatch.glsl counts them. The last three words are the
 * arguments of an indirect dispatch. */
struct wave_counts {
    uint count;
    uint groups_x, groups_y, groups_z;
};
SHARED_SIZE(wave_counts, 16)
#define WAVE_GROUPS_MAX 65535u /* on x; every device has as many */

/* The lists of the wave in hand, and what became of its slice. A std140 block of the passes that read it; the
 * passes that make the lists write it. */
struct wave_state {
    SHARED(wave_counts) rays, ray_blocks; /* COMPACT_BLOCK rays each */
    SHARED(wave_counts) hits, hit_blocks; /* likewise */
    SHARED(wave_counts) shadow_rays;      /* of the batch in hand; only where the host does not know */
    uint all_secondary_rays;              /* of the slice so far */
    uint all_shadow_rays;
    uint all_sorted_waves;
    uint sorted; /* 1: the children of the wave in hand are, by the octants of their directions */
    /* Not 0: a WAVE_STOPPED_ that says why the slice must be done again. It stays until the host has seen it, and
     * keeps this slice and all that are queued behind it out of the picture. */
    uint stopped;
    uint pad0, pad1, pad2;
};
SHARED_SIZE(wave_state, 112)

#define WAVE_STOPPED_FULL 1u   /* a wave is larger than the buffers */
#define WAVE_STOPPED_QUEUED 2u /* rays are left behind the last wave that is queued */
#define WAVE_STOPPED_LONG 3u   /* a ray takes longer than a dispatch may */

#define UNIFORM_WAVE 1 /* binding of the uniform block */

#endif
