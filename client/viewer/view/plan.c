/* SPDX-License-Identifier: MIT */
/* Decisions about views made in the client. */
#include "plan.h"

#include <math.h>

/* ---- decision to make views ---- */

#define FAST_SHARE 0.6 /* share of a display frame within which pictures are fast enough without views */
#define FAST_NS UINT64_C(2000000000)

bool plan_switch(struct plan_switch *plan, double round_s, uint64_t now_ns)
{
    const double frame_s = (double)PLAN_FRAME_NS * 1e-9;
    const bool before = plan->on;
    if (round_s >= FAST_SHARE * frame_s)
        plan->fast_ns = 0;
    else if (plan->fast_ns == 0)
        plan->fast_ns = now_ns;
    if (round_s > frame_s)
        plan->on = true;
    else if (plan->fast_ns != 0 && now_ns - plan->fast_ns >= FAST_NS)
        plan->on = false;
    return plan->on != before;
}

/* ---- of which camera ---- */

/* Time over which velocity is measured, since the pointer moves in uneven steps */
#define VELOCITY_NS UINT64_C(100000000)
#define AHEAD_MAX_NS UINT64_C(400000000)

/* Interval of pictures assumed before the first two: the rate requested from the daemon */
#define PACE_NS UINT64_C(66666667)
#define PACE_PAUSE_NS UINT64_C(1000000000) /* a longer pause separates two motions */

static void learn(uint64_t last_ns[2], uint64_t seen_ns)
{
    last_ns[0] = last_ns[1];
    last_ns[1] = seen_ns;
}

static uint64_t shorter_of(const uint64_t last_ns[2])
{
    const uint64_t before_ns = last_ns[0] != 0 ? last_ns[0] : PACE_NS;
    return last_ns[1] != 0 && last_ns[1] < before_ns ? last_ns[1] : before_ns;
}

void plan_pace_add(struct plan_pace *pace, uint64_t sent_ns, uint64_t came_ns)
{
    if (sent_ns != 0)
        learn(pace->rounds_ns, came_ns - sent_ns);
    if (pace->came_ns != 0 && came_ns - pace->came_ns < PACE_PAUSE_NS)
        learn(pace->intervals_ns, came_ns - pace->came_ns);
    pace->came_ns = came_ns;
}

uint64_t plan_pace_ahead_ns(const struct plan_pace *pace)
{
    return shorter_of(pace->rounds_ns) + shorter_of(pace->intervals_ns) / 2;
}

void plan_motion_add(struct plan_motion *motion, const struct viewer_camera *camera, uint64_t at_ns)
{
    motion->steps[motion->next].camera = *camera;
    motion->steps[motion->next].at_ns = at_ns;
    motion->next = (motion->next + 1) % PLAN_STEPS;
    motion->count += motion->count < PLAN_STEPS;
}

static size_t step_back(const struct plan_motion *motion, size_t back)
{
    return (motion->next + PLAN_STEPS - 1 - back) % PLAN_STEPS;
}

/* The newest step from before the measured time, which is the position at its beginning. */
static size_t first_step(const struct plan_motion *motion, uint64_t now_ns)
{
    size_t back = 0;
    while (back + 1 < motion->count && now_ns - motion->steps[step_back(motion, back)].at_ns < VELOCITY_NS)
        back++;
    return step_back(motion, back);
}

static uint64_t clamp(uint64_t value, uint64_t minimum, uint64_t maximum)
{
    return value < minimum ? minimum : value < maximum ? value : maximum;
}

static double way_of(const double from[3], const double to[3])
{
    return hypot(hypot(to[0] - from[0], to[1] - from[1]), to[2] - from[2]);
}

void plan_motion_predict(const struct plan_motion *motion, uint64_t now_ns, uint64_t ahead_ns,
                         struct viewer_camera *camera)
{
    if (motion->count == 0)
        return;
    const struct viewer_camera *newest = &motion->steps[step_back(motion, 0)].camera;
    const size_t first = first_step(motion, now_ns);
    /* The interval between two simultaneous cameras counts as a display frame. */
    const uint64_t elapsed_ns = clamp(now_ns - motion->steps[first].at_ns, PLAN_FRAME_NS, VELOCITY_NS);
    const double share = (double)clamp(ahead_ns, 0, AHEAD_MAX_NS) / (double)elapsed_ns;
    const struct viewer_camera *before = &motion->steps[first].camera;
    const bool orbits = way_of(before->look_at, newest->look_at) < way_of(before->eye, newest->eye);
    double right, up;
    camera_swing(before, newest, &right, &up);
    *camera = *newest;
    (orbits ? camera_orbit : camera_turn)(camera, right * share, up * share);
    if (orbits)
        camera_dolly(camera, pow(camera_distance(newest) / camera_distance(before), share), 0);
    for (int i = 0; i < 3; i++) {
        const double step = orbits ? newest->look_at[i] - before->look_at[i] : newest->eye[i] - before->eye[i];
        camera->eye[i] += step * share;
        camera->look_at[i] += step * share;
    }
}

/* ---- in which quality ---- */

#define SLOW_FRAMES 2 /* a single slow view is tolerated, but one as long as three frames is visible */
#define PAUSE_MIN_NS UINT64_C(1000000000)
#define PAUSE_MAX_NS UINT64_C(16000000000)

static void go_down(struct plan_rung *rung, uint64_t now_ns)
{
    const bool was_steady = now_ns - rung->steady_ns >= PAUSE_MIN_NS;
    rung->quality = FL_WARP_ITERATIVE;
    rung->pause_ns = was_steady || rung->pause_ns == 0   ? PAUSE_MIN_NS
                     : rung->pause_ns < PAUSE_MAX_NS / 2 ? rung->pause_ns * 2
                                                         : PAUSE_MAX_NS;
    rung->retry_ns = now_ns + rung->pause_ns;
}

void plan_rung(struct plan_rung *rung, uint64_t took_ns, uint64_t frame_ns, uint64_t now_ns)
{
    if (rung->quality == FL_WARP_ITERATIVE) {
        if (now_ns < rung->retry_ns)
            return;
        rung->quality = FL_WARP_TREE;
        rung->slow = 0;
        rung->steady_ns = now_ns;
        return;
    }
    const double late = (double)took_ns / (double)frame_ns - 1;
    rung->slow = late > 0 ? rung->slow + late : 0;
    if (rung->slow > SLOW_FRAMES)
        go_down(rung, now_ns);
}
