/* SPDX-License-Identifier: MIT */
/* Jobs beside the view: cameras of the scene, the point under the pointer, the comparison with the reference. */
#ifndef FARLIGHT_VIEWER_VIEW_TASKS_H
#define FARLIGHT_VIEWER_VIEW_TASKS_H

#include "viewer/overlay/heat.h"
#include "viewer/overlay/pixmap.h"

struct view;

/* Purposes of a job. */
enum view_task {
    TASK_NONE,
    TASK_HOME,      /* the initial camera, from the command line, the model or the scene's extent */
    TASK_CAMERA,    /* place of a scene's camera */
    TASK_FOCUS,     /* depth of the surface under the pointer */
    TASK_PICK,      /* object under the pointer */
    TASK_REFERENCE, /* the resting picture by the reference tracer */
    TASK_OUTLINE    /* outline of the edited object in the picture */
};

struct view_tasks {
    enum view_task current, next;
    double x, y; /* pointer position as shares of the picture */
    uint32_t camera_node;
    struct view_picked {
        bool is_new; /* until the result is consumed */
        uint32_t node, material;
    } picked;
};

/* The compared picture and its error against the reference. */
struct view_heat {
    struct pixmap compared, map; /* `map`: errors as colours */
    struct heat_figures figures;
    uint64_t command, change, revision; /* identity of the compared picture */
    bool is_there, is_refused;
};

#define HEAT_TOP 0.25 /* a quarter of white is the brightest colour of the error map */

void view_step_tasks(struct view *view);
void view_drop_tasks(struct view *view); /* drops jobs of a lost connection */
/* Returns how first hits are found, in the view and in the reference. The viewer chooses, since rasterised
 * samples lie elsewhere than traced ones and would count as errors. */
uint32_t view_primary(const struct view *view);

#endif
