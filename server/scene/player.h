/* SPDX-License-Identifier: MIT */
/* Player of a job's clips: their channels are sorted once, so that poses at several times cost little. Private to
 * scene/; the scene must not change while a player exists. */
#ifndef FARLIGHT_SCENE_PLAYER_H
#define FARLIGHT_SCENE_PLAYER_H

#include "scene/channel.h"
#include "scene/pose.h"

struct player_track {
    const struct scene_channel *channel;
    const struct scene_clip *clip;
    enum channel_target target;
    uint32_t use;
};

struct player {
    const struct scene *scene;
    const struct record_clip_use *uses; /* borrowed */
    uint32_t use_count;
    double *durations_s, *times_s; /* per use: duration of its clip; time within it for the current pose */
    struct player_track *tracks;   /* sorted by target, object, use, channel: the last one wins */
    size_t track_count;
    size_t target_tracks[TARGET_VIEW + 1];
    size_t weight_count; /* floats of all weights together */
};

/* Initialises a player. ERROR_OUT_OF_MEMORY, ERROR_UNKNOWN_ID ("clips[2].clip"). Finish it in either case. */
bool player_init(struct player *player, const struct scene *scene, const struct record_clip_use *uses,
                 uint32_t use_count, struct error *error);
void player_finish(struct player *player);
/* The pose's entry of a node; NULL: none, or no pose. */
const struct pose_node *scene_pose_node(const struct scene_pose *pose, uint32_t id);
/* Bounds the turn of each node in the poses, in their order, see curve_turn_bound(). */
void player_turn_bounds(struct player *player, double from_s, double to_s, double *bounds);
bool player_pose(struct player *player, double time_s, struct scene_pose *pose, struct error *error);

#endif
