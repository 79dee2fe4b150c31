/* SPDX-License-Identifier: MIT */
/* A tour of a scene's cameras and clips: the current one, and the time. Independent of the daemon. */
#ifndef FARLIGHT_VIEWER_INPUT_TOUR_H
#define FARLIGHT_VIEWER_INPUT_TOUR_H

#include <stdbool.h>
#include <stddef.h>

#define TOUR_NONE (-1)

struct tour {
    size_t camera_count, clip_count;
    int camera;        /* that was last gone to; TOUR_NONE: none */
    int clip;          /* that is played or paused; TOUR_NONE: none */
    double duration_s; /* of the clip */
    double time_s;     /* where in it */
    double speed;      /* seconds of the clip in a second: 1/8 to 8 */
    bool playing;
};

void tour_begin(struct tour *tour, size_t camera_count, size_t clip_count);
/* `step` cameras forwards or back, cyclic; TOUR_NONE: there is none. */
int tour_camera(struct tour *tour, int step);
/* `step` clips forwards or back; between the last and the first no clip is chosen. Starts playing. */
int tour_clip(struct tour *tour, int step);
/* Of the clip that was chosen. */
void tour_stop(struct tour *tour); /* no clip is chosen then */
void tour_set_duration(struct tour *tour, double duration_s);
void tour_play(struct tour *tour); /* or pauses */
void tour_change_speed(struct tour *tour, int doublings);
bool tour_seek(struct tour *tour, double seconds); /* forwards or back, and pauses; true: the time has changed */
bool tour_advance(struct tour *tour, double seconds); /* true: the time is another */

#endif
