/* SPDX-License-Identifier: MIT */
/* The current camera, clip and time. */
#include "tour.h"

#include <math.h>

void tour_begin(struct tour *tour, size_t camera_count, size_t clip_count)
{
    *tour = (struct tour){.camera_count = camera_count,
                          .clip_count = clip_count,
                          .camera = TOUR_NONE,
                          .clip = TOUR_NONE,
                          .speed = 1};
}

int tour_camera(struct tour *tour, int step)
{
    const int count = (int)tour->camera_count;
    if (count == 0)
        return TOUR_NONE;
    if (tour->camera == TOUR_NONE)
        tour->camera = step > 0 ? 0 : count - 1;
    else
        tour->camera = (tour->camera + step % count + count) % count;
    return tour->camera;
}

int tour_clip(struct tour *tour, int step)
{
    const int places = (int)tour->clip_count + 1; /* plus one for no clip */
    tour->clip = ((tour->clip + 1) + step % places + places) % places - 1;
    tour->time_s = 0;
    tour->duration_s = 0;
    tour->playing = tour->clip != TOUR_NONE;
    return tour->clip;
}

void tour_stop(struct tour *tour)
{
    tour->clip = TOUR_NONE;
    tour->time_s = tour->duration_s = 0;
    tour->playing = false;
}

void tour_set_duration(struct tour *tour, double duration_s)
{
    tour->duration_s = duration_s;
}

void tour_play(struct tour *tour)
{
    if (tour->clip == TOUR_NONE && tour->clip_count > 0)
        tour_clip(tour, 1);
    else
        tour->playing = tour->clip != TOUR_NONE && !tour->playing;
}

void tour_change_speed(struct tour *tour, int doublings)
{
    tour->speed = fmax(0.125, fmin(8, tour->speed * pow(2, doublings)));
}

/* Moves the time; a clip starts again at its end. */
static bool go(struct tour *tour, double seconds)
{
    const double before = tour->time_s;
    if (tour->clip == TOUR_NONE || !(tour->duration_s > 0))
        return false;
    tour->time_s = fmod(before + seconds, tour->duration_s);
    if (tour->time_s < 0)
        tour->time_s += tour->duration_s;
    return tour->time_s != before;
}

bool tour_seek(struct tour *tour, double seconds)
{
    tour->playing = false;
    return go(tour, seconds);
}

bool tour_advance(struct tour *tour, double seconds)
{
    return tour->playing && go(tour, seconds * tour->speed);
}
