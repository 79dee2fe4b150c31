/* SPDX-License-Identifier: MIT */
/* Costs and latencies of the last frames. Monotonic nanoseconds of this process, unless the daemon's clock is
 * named. Independent of window and daemon. */
#ifndef FARLIGHT_VIEWER_OVERLAY_METRICS_H
#define FARLIGHT_VIEWER_OVERLAY_METRICS_H

#include "lib/farlight.h"

#define METRICS_FRAMES 128u
#define METRICS_VIEWS 256u

/* Rows of the timeline, in the order of the data's path. */
enum lane {
    LANE_INPUT, /* the camera's way to the daemon, and its wait there */
    LANE_SCENE, /* apply, build, upload */
    LANE_PRIMARY,
    LANE_TRACE,
    LANE_SHADE,
    LANE_RESOLVE, /* and read-back */
    LANE_ENCODE,
    LANE_RECEIVE, /* from its first byte to its last */
    LANE_DECODE,
    LANE_SHOW, /* until the window shows it */
    LANE_COUNT
};
extern const char *const lane_names[LANE_COUNT];

/* The time of one lane: from the begin of its first work, as long as all of it, even if it was interleaved with
 * others. No end: no work was done. */
struct span {
    int64_t begin_ns, end_ns; /* before LANE_RECEIVE: of the daemon's clock */
};

struct metrics_frame {
    uint32_t frame;
    uint64_t command, command_sent_ns;
    uint64_t command_received_ns, command_applied_ns, rendered_ns; /* the daemon's clock */
    uint64_t begun_ns, whole_ns, shown_ns;
    uint64_t wire_bytes;
    bool first_of_command;         /* no frame before shows the same camera */
    struct span spans[LANE_COUNT]; /* as they were measured: see metrics_span() */
};

/* A picture that was made here. */
struct metrics_view {
    uint64_t moved_ns; /* when its camera was moved there; 0: an earlier view shows that camera */
    uint64_t shown_ns;
};

struct metrics {
    struct metrics_frame frames[METRICS_FRAMES]; /* a ring */
    size_t next, count;
    size_t unshown; /* of the last ones */
    uint64_t last_command;
    struct metrics_view views[METRICS_VIEWS]; /* a ring, likewise */
    size_t next_view, view_count, unshown_views;
};

/* A frame that came and was decoded at `decoded_ns`; it counts as shown until metrics_show() says when it was. */
void metrics_add(struct metrics *metrics, const struct fl_frame *frame, uint64_t decoded_ns);
/* That have come for the last frame beside it. */
void metrics_add_bytes(struct metrics *metrics, uint64_t bytes);
/* A view that was made here, likewise. */
void metrics_add_view(struct metrics *metrics, uint64_t moved_ns, uint64_t made_ns);
/* Marks the frames and views since the last call as shown now. */
void metrics_show(struct metrics *metrics, uint64_t shown_ns);
/* The frame with this number of frames after it; NULL: it is not remembered. */
const struct metrics_frame *metrics_frame(const struct metrics *metrics, size_t back);
/* The offset from the daemon's clock to ours: as a camera cannot arrive before it was sent, nor a frame before it
 * was rendered, the middle between the two bounds. */
int64_t metrics_clock_offset_ns(const struct metrics *metrics);

/* A lane of a frame in our clock, with that offset; false: it is empty. */
bool metrics_span(const struct metrics_frame *frame, enum lane lane, int64_t offset_ns, struct span *span);

struct metrics_summary {
    double frames_per_second, bits_per_second; /* over the last second */
    bool has_latency;
    double latency_s; /* from camera to picture, median of the last second; else the last one */
    /* From camera to decoded picture, of the last few that were the first of their camera; 0 frames: unknown. */
    size_t round_frames;
    double round_s;
    double views_per_second; /* made here; and from the camera's move until they were shown, over the last second
                                .. */
    double view_latency_s, view_latency_99_s; /* .. the median, and what 99 in 100 do not exceed */
};
void metrics_summarise(const struct metrics *metrics, uint64_t now_ns, struct metrics_summary *summary);

#endif
