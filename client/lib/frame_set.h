/* SPDX-License-Identifier: MIT */
/* The frames of an animation to render: a part of a range, without frames that exist. Does no I/O. Any thread. */
#ifndef FARLIGHT_CLIENT_LIB_FRAME_SET_H
#define FARLIGHT_CLIENT_LIB_FRAME_SET_H

#include "lib/farlight.h"

/* first, first + step, .., last. Frames are at most 10,000,000, as in the protocol. */
struct fl_frame_run {
    uint32_t first, last, step;
};
/* Ascending; no frame is in two runs. */
struct fl_frame_set {
    struct fl_frame_run *runs;
    size_t run_count;
    uint32_t frame_count; /* sum over the runs */
};

/* Reads "K/N": part K of N, counted from 1; N at most 1,000,000. */
bool fl_text_shard(const char *text, uint32_t *part, uint32_t *parts, struct fl_error *error);

/* Number of frames of a run. The step is at least 1; `last` may lie between two frames. */
uint32_t fl_frame_run_count(const struct fl_frame_run *run);
/* Takes every `parts`-th frame of the range, beginning with the `part`-th (from 1): all parts take about
 * equally long, and together they are the range. False: this part is empty. */
bool fl_frame_run_shard(const struct fl_frame_run *range, uint32_t part, uint32_t parts, struct fl_frame_run *run);

/* Takes the `part`-th of `parts` runs of neighbouring frames, whose lengths differ by a frame at most, so that
 * caches still profit from neighbours. False: this part is empty. */
bool fl_frame_run_chunk(const struct fl_frame_run *range, uint32_t part, uint32_t parts, struct fl_frame_run *run);

/* Collects the frames of `range` for which `is_there` is false (NULL: all), in as few runs as possible. False:
 * no memory. */
bool fl_frame_set_missing(const struct fl_frame_run *range, bool (*is_there)(void *user, uint32_t frame),
                          void *user, struct fl_frame_set *set, struct fl_error *error);
void fl_frame_set_finish(struct fl_frame_set *set);

#endif
