/* SPDX-License-Identifier: MIT */
/* private to build*.c: what the host's fragments leave in voxels, as abuffer/build.frag has it. */
#ifndef FARLIGHT_TRACE_ABUFFER_BUILD_MARKS_H
#define FARLIGHT_TRACE_ABUFFER_BUILD_MARKS_H

#include "trace/abuffer/build_state.h"

#include <stdatomic.h>

/* Where marks go; threads share them. */
struct abuffer_marks {
    _Atomic uint32_t *sums, *subvoxels; /* abuffer/layout.h */
    int32_t along;                      /* voxels along a side of the grid */
    float voxels_per_cell;
    bool has_subvoxels, without_steep;
};

/* A triangle in an image; in cells. */
struct abuffer_surface {
    int axis;
    float slopes[2];    /* of the depth along u and v */
    float lower, upper; /* of the triangle's depths */
    uint32_t face;      /* raster/layout.h */
    bool leaves;        /* its outside faces greater depths */
};

/* Its fragments next to each other. */
struct abuffer_row {
    int32_t number, first, count; /* of the row; of the columns */
    const float *depths;
};

void abuffer_marks_init(struct abuffer_marks *marks, const struct abuffer_store *store, void *sums,
                        void *subvoxels);
void abuffer_mark_row(const struct abuffer_marks *marks, const struct abuffer_surface *surface,
                      const struct abuffer_row *row);

#endif
