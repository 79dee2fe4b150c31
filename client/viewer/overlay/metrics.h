/* SPDX-License-Identifier: MIT */
/* Costs and latencies of the last frames. Times are monotonic nanoseconds of this process, unless the daemon's
 * clock is named. Independent of window and daemon. */
#ifndef FARLIGHT_VIEWER_OVERLAY_METRICS_H
#define FARLIGHT_VIEWER_OVERLAY_METRICS_H

#include "lib/farlight.h"

#define METRICS_FRAMES 128u
#define METRICS_VIEWS 256u

/* Rows of the timeline, in the order of the data's path. */
enum lane {
    LANE_INPUT, /* the camera's transfer to the daemon, and its wait there */
    LANE_SCENE, /* apply, build, upload */
    LANE_PRIMARY,
    LANE_TRACE,
    LANE_SHADE,
    LANE_RESOLVE, /* resolve and read-back */
    LANE_ENCODE,
    LANE_RECEIVE, /* first byte to last byte */
    LANE_DECODE,
    LANE_SHOW, /* up to the display */
    LANE_COUNT
};
extern const char *const lane_names[LANE_COUNT];

/* The time of a lane: starts with its first work and lasts as long as all its work, although that may have been
 * interleaved with other lanes. Zero length: no work was done. */
struct span {
    int64_t begin_ns, end_ns; /* daemon's clock before LANE_RECEIVE */
};

struct metrics_frame {
    uint32_t frame;
    uint64_t command, command_sent_ns;
    uint64_t command_received_ns, command_applied_ns, rendered_ns; /* daemon's clock */
    uint64_t begun_ns, whole_ns, shown_ns;
    uint64_t wire_bytes;
    bool first_of_command;         /* no earlier frame shows the same camera */
    struct span spans[LANE_COUNT]; /* raw values: see metrics_span() */
};

/* A picture made in the client. */
struct metrics_view {
    uint64_t moved_ns; /* time of the camera's motion; 0: an earlier view shows this camera */
    uint64_t shown_ns;
};

struct metrics {
    struct metrics_frame frames[METRICS_FRAMES]; /* a ring */
    size_t next, count;
    size_t unshown; /* number of the last frames that are not shown yet */
    uint64_t last_command;
    struct metrics_view views[METRICS_VIEWS]; /* a ring */
    size_t next_view, view_count, unshown_views;
};

/* Adds a frame that was decoded at `decoded_ns`; it counts as shown until metrics_show() sets the time. */
void metrics_add(struct metrics *metrics, const struct fl_frame *frame, uint64_t decoded_ns);
/* Adds bytes of the last frame's attachments that arrived separately. */
void metrics_add_bytes(struct metrics *metrics, uint64_t bytes);
/* Adds a view made in the client, which counts as shown, too. */
void metrics_add_view(struct metrics *metrics, uint64_t moved_ns, uint64_t made_ns);
/* Marks the frames and views since the last call as shown now. */
void metrics_show(struct metrics *metrics, uint64_t shown_ns);
/* The frame with this number of frames after it; NULL: it is not stored any more. */
const struct metrics_frame *metrics_frame(const struct metrics *metrics, size_t back);
/* The offset from the daemon's clock to ours: the middle between two bounds, since a camera cannot arrive
 * before it was sent, nor a frame before it was rendered. */
int64_t metrics_clock_offset_ns(const struct metrics *metrics);

/* A lane of a frame, converted to our clock by the offset; false: it is empty. */
bool metrics_span(const struct metrics_frame *frame, enum lane lane, int64_t offset_ns, struct span *span);

struct metrics_summary {
    double frames_per_second, bits_per_second; /* over the last second */
    bool has_latency;
    double latency_s; /* from camera to picture: median of the last second, or the last one */
    /* Time from camera to decoded picture, for the last few first frames of a camera; 0 frames: unknown. */
    size_t round_frames;
    double round_s;
    /* Made in the client; and the time from the camera's motion to the display, over the last second .. */
    double views_per_second;
    double view_latency_s, view_latency_99_s; /* .. its median, and its 99th percentile */
};
void metrics_summarise(const struct metrics *metrics, uint64_t now_ns, struct metrics_summary *summary);

#endif
