/* SPDX-License-Identifier: MIT */
/* A tour of a scene's cameras and clips: the current ones, and the time. Independent of the daemon. */
#ifndef FARLIGHT_VIEWER_INPUT_TOUR_H
#define FARLIGHT_VIEWER_INPUT_TOUR_H

#include <stdbool.h>
#include <stddef.h>

#define TOUR_NONE (-1)

struct tour {
    size_t camera_count, clip_count;
    int camera;        /* last chosen camera; TOUR_NONE: none */
    int clip;          /* playing or paused clip; TOUR_NONE: none */
    double duration_s; /* duration of the clip */
    double time_s;     /* position in the clip */
    double speed;      /* seconds of the clip in a second: 1/8 to 8 */
    bool playing;
};

void tour_begin(struct tour *tour, size_t camera_count, size_t clip_count);
/* Moves `step` cameras forwards or back, cyclic; TOUR_NONE: there is none. */
int tour_camera(struct tour *tour, int step);
/* Moves `step` clips forwards or back; no clip lies between the last and the first. Starts playing. */
int tour_clip(struct tour *tour, int step);
/* Chooses no clip. */
void tour_stop(struct tour *tour);
/* Sets the duration of the chosen clip. */
void tour_set_duration(struct tour *tour, double duration_s);
void tour_play(struct tour *tour); /* toggles playing */
void tour_change_speed(struct tour *tour, int doublings);
bool tour_seek(struct tour *tour, double seconds);    /* moves the time and pauses; true: the time has changed */
bool tour_advance(struct tour *tour, double seconds); /* true: the time has changed */

#endif
