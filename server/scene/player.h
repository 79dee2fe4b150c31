/* SPDX-License-Identifier: MIT */
/* The channels of the clips that a job plays, sorted once so that poses at several times cost little. Private to
 * scene/; while there is one, its scene must not change. */
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
    const struct clip_use *uses; /* borrowed */
    uint32_t use_count;
    double *durations_s, *times_s; /* of each use's clip; times within the clips for the current pose */
    struct player_track *tracks;   /* sorted by target, object, use, channel: the last one wins */
    size_t track_count;
    size_t target_tracks[TARGET_VIEW + 1];
    size_t weight_count; /* floats that all weights together have */
};

/* ERROR_OUT_OF_MEMORY, ERROR_UNKNOWN_ID ("clips[2].clip"). Finish it either way. */
bool player_init(struct player *player, const struct scene *scene, const struct clip_use *uses, uint32_t use_count,
                 struct error *error);
void player_finish(struct player *player);
/* The pose's entry of a node; NULL: none, or no pose. */
const struct pose_node *scene_pose_node(const struct scene_pose *pose, uint32_t id);
/* For each node that poses list, in their order: how far it turns at most, see curve_turn_bound(). */
void player_turn_bounds(struct player *player, double from_s, double to_s, double *bounds);
bool player_pose(struct player *player, double time_s, struct scene_pose *pose, struct error *error);

#endif
