/* SPDX-License-Identifier: MIT */
/* Jobs beside the view: the scene's cameras, the point under the pointer, the comparison with the reference. */
#ifndef FARLIGHT_VIEWER_VIEW_TASKS_H
#define FARLIGHT_VIEWER_VIEW_TASKS_H

#include "viewer/overlay/heat.h"
#include "viewer/overlay/pixmap.h"

struct view;

/* What a job is for. */
enum view_task {
    TASK_NONE,
    TASK_HOME,      /* the initial camera, from the command line, the model or the scene's extent */
    TASK_CAMERA,    /* where a camera of the scene is */
    TASK_FOCUS,     /* where what is under the pointer is */
    TASK_PICK,      /* which object it is */
    TASK_REFERENCE, /* the resting picture, by the reference */
    TASK_OUTLINE    /* where in it is what the panel changes */
};

struct view_tasks {
    enum view_task current, next;
    double x, y; /* what is pointed at; shares of the picture */
    uint32_t camera_node;
    struct view_picked {
        bool is_new; /* until its taker takes that back */
        uint32_t node, material;
    } picked;
};

/* The picture as it was, compared with the reference's. */
struct view_heat {
    struct pixmap compared, map; /* its errors */
    struct heat_figures figures;
    uint64_t command, change, revision; /* of what was compared */
    bool is_there, is_refused;
};

#define HEAT_TOP 0.25 /* a quarter of white is the brightest colour of the error map */

void view_step_tasks(struct view *view);
void view_drop_tasks(struct view *view); /* of a connection that is gone */
/* How first hits are found, in the view and in the reference that it is compared with: rasterised samples lie
 * elsewhere than traced ones, so it is not left to the daemon. */
uint32_t view_primary(const struct view *view);

#endif
