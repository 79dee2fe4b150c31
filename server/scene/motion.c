/* SPDX-License-Identifier: MIT */
/* Where things are while a shutter is open. */
#include "scene/pose.h"

#include "scene/player.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define INTERVALS (MOTION_POSES_MAX - 1)
_Static_assert(INTERVALS == 8, "intervals are halved until they are one");

void scene_motion_finish(struct scene_motion *motion)
{
    for (uint32_t i = 0; i < motion->pose_count; i++)
        scene_pose_finish(&motion->poses[i]);
    free(motion->poses);
    *motion = (struct scene_motion){0};
}

/* ---- how far things turn ------------------------------------------------------------------------ */

/* Radians between the directions of a column in two matrices; of a column without length: 0. */
static double column_turn(const float *from, const float *to)
{
    double along = 0.0, across = 0.0;
    for (int row = 0; row < 3; row++) {
        int next = 4 * ((row + 1) % 3), after = 4 * ((row + 2) % 3);
        double product = (double)from[next] * (double)to[after] - (double)from[after] * (double)to[next];
        along += (double)from[4 * row] * (double)to[4 * row];
        across += product * product;
    }
    return atan2(sqrt(across), along);
}

static double matrix_turn(const float from[12], const float to[12])
{
    double turn = 0.0;
    for (int column = 0; column < 3; column++)
        turn = fmax(turn, column_turn(from + column, to + column));
    return turn;
}

/* By posed node and interval; all poses list the same nodes. */
typedef double interval_turns[INTERVALS];

static void posed_turns(const struct scene_motion *motion, interval_turns *turns)
{
    for (uint32_t node = 0; node < motion->poses[0].node_count; node++) {
        for (int i = 0; i < INTERVALS; i++)
            turns[node][i] = matrix_turn(motion->poses[i].nodes[node].parent_from_node,
                                         motion->poses[i + 1].nodes[node].parent_from_node);
    }
}

/* Adds up along the way to the root: that is as far as the node can turn in the world. */
static void chain_turns(const struct scene *scene, const struct scene_pose *pose, const interval_turns *turns,
                        const struct scene_node *node, interval_turns sum)
{
    memset(sum, 0, sizeof(interval_turns));
    for (int depth = 0; node && depth < SCENE_DEPTH_MAX; depth++) {
        const struct pose_node *posed = scene_pose_node(pose, node->base.id);
        for (int i = 0; posed && i < INTERVALS; i++)
            sum[i] += turns[posed - pose->nodes][i];
        node = node->parent ? scene_node(scene, node->parent) : NULL;
    }
}

/* Intervals that may be one without a turn beyond the limit, from `most` down. */
static int joinable(const interval_turns sum, int most)
{
    for (int together = most; together > 1; together /= 2) {
        bool fine = true;
        for (int first = 0; first < INTERVALS; first += together) {
            double turn = 0.0;
            for (int i = first; i < first + together; i++)
                turn += sum[i];
            fine = fine && turn <= MOTION_TURN_MAX;
        }
        if (fine)
            return together;
    }
    return 1;
}

static bool is_drawn_rigid(const struct scene *scene, const struct scene_node *node)
{
    const struct scene_mesh *mesh = node->kind == NODE_MESH ? scene_mesh(scene, node->object) : NULL;
    return node->kind == NODE_SPHERES || (mesh && !(node->skin && mesh->influence_count));
}

static int intervals_together(const struct scene *scene, const struct scene_motion *motion,
                              const interval_turns *turns)
{
    const struct scene_pose *pose = &motion->poses[0];
    interval_turns all = {0};
    for (uint32_t node = 0; node < pose->node_count; node++) {
        for (int i = 0; i < INTERVALS; i++)
            all[i] += turns[node][i];
    }
    int together = INTERVALS;
    if (joinable(all, together) == together)
        return together; /* even if everything hung below one another */
    size_t cursor = 0;
    void *value;
    while (together > 1 && hashmap_next(&scene->objects[SCENE_NODE], &cursor, NULL, &value)) {
        interval_turns sum;
        if (!is_drawn_rigid(scene, value))
            continue;
        chain_turns(scene, pose, turns, value, sum);
        together = joinable(sum, together);
    }
    return together;
}

/* ---- poses -------------------------------------------------------------------------------------- */

static bool same_places(const struct scene_pose *a, const struct scene_pose *b)
{
    for (uint32_t i = 0; i < a->node_count; i++) {
        if (memcmp(a->nodes[i].parent_from_node, b->nodes[i].parent_from_node,
                   sizeof a->nodes[i].parent_from_node))
            return false;
    }
    return true;
}

static bool same_weights(const struct scene_pose *a, const struct scene_pose *b)
{
    return !a->weight_count || memcmp(a->weights, b->weights, a->weight_count * sizeof *a->weights) == 0;
}

/* Only nodes and weights move within a frame. */
static bool stands_still(const struct scene_motion *motion)
{
    for (uint32_t i = 1; i < motion->pose_count; i++) {
        if (!same_places(&motion->poses[0], &motion->poses[i]) ||
            !same_weights(&motion->poses[0], &motion->poses[i]))
            return false;
    }
    return true;
}

/* Keeps every `step`th pose. */
static void thin_out(struct scene_motion *motion, uint32_t step)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < motion->pose_count; i++) {
        if (i % step == 0)
            motion->poses[kept++] = motion->poses[i];
        else
            scene_pose_finish(&motion->poses[i]);
    }
    motion->pose_count = kept;
}

/* Whether two poses will do, by what is known of the turns without looking at the poses between. */
static bool turns_little(struct player *player, const struct scene_motion *ends, double open_s, double shutter_s,
                         interval_turns *turns, double *bounds)
{
    uint32_t count = ends->poses[0].node_count;
    player_turn_bounds(player, open_s, open_s + shutter_s, bounds);
    memset(turns, 0, count * sizeof *turns);
    for (uint32_t node = 0; node < count; node++)
        turns[node][0] = bounds[node];
    return intervals_together(player->scene, ends, (const interval_turns *)turns) == INTERVALS;
}

static bool add_poses(struct scene_motion *motion, struct player *player, double open_s, double shutter_s,
                      uint32_t intervals, struct error *error)
{
    for (uint32_t i = 0; i <= intervals; i++) {
        double time_s = intervals ? open_s + shutter_s * i / intervals : open_s;
        if (!player_pose(player, time_s, &motion->poses[i], error))
            return false;
        motion->pose_count = i + 1;
    }
    return true;
}

/* Of two poses, the ends, to as many as are needed. */
static bool fill_in(struct scene_motion *motion, struct player *player, double open_s, double shutter_s,
                    struct error *error)
{
    size_t count = (size_t)motion->poses[0].node_count + 1;
    interval_turns *turns = malloc(count * sizeof *turns);
    double *bounds = malloc(count * sizeof *bounds);
    bool fine = turns && bounds;
    if (!fine)
        error_set(error, ERROR_OUT_OF_MEMORY, "clips", "no memory for the turns of %zu nodes", count);
    if (fine && !turns_little(player, motion, open_s, shutter_s, turns, bounds)) {
        for (uint32_t i = 0; i < 2; i++)
            scene_pose_finish(&motion->poses[i]);
        motion->pose_count = 0;
        fine = add_poses(motion, player, open_s, shutter_s, INTERVALS, error);
        if (fine) {
            posed_turns(motion, turns);
            thin_out(motion, (uint32_t)intervals_together(player->scene, motion, (const interval_turns *)turns));
        }
    }
    if (fine && stands_still(motion))
        thin_out(motion, MOTION_POSES_MAX);
    free(turns);
    free(bounds);
    return fine;
}

bool scene_motion_evaluate(struct scene_motion *motion, const struct scene *scene, const struct clip_use *uses,
                           uint32_t use_count, double open_s, double shutter_s, struct error *error)
{
    struct player player;
    bool moves = shutter_s > 0.0;
    *motion = (struct scene_motion){0};
    bool fine = player_init(&player, scene, uses, use_count, error);
    if (fine && !(motion->poses = calloc(MOTION_POSES_MAX, sizeof *motion->poses)))
        fine = error_set(error, ERROR_OUT_OF_MEMORY, "clips", "no memory for %d poses", MOTION_POSES_MAX);
    fine = fine && add_poses(motion, &player, open_s, shutter_s, moves ? 1 : 0, error) &&
           (!moves || fill_in(motion, &player, open_s, shutter_s, error));
    player_finish(&player);
    if (!fine)
        scene_motion_finish(motion);
    return fine;
}
