/* SPDX-License-Identifier: MIT */
/* Poses of objects while a shutter is open. */
#include "scene/pose.h"

#include "scene/hierarchy.h"
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
    scene_pose_finish(&motion->earlier);
    scene_pose_finish(&motion->later);
    free(motion->poses);
    *motion = (struct scene_motion){0};
}

/* ---- bounds of turns ---------------------------------------------------------------------------- */

/* Angle in radians between the directions of a column in two matrices; 0 for a column without length. */
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

/* Turns by posed node and interval; all poses list the same nodes. */
typedef double interval_turns[INTERVALS];

static void posed_turns(const struct scene_motion *motion, interval_turns *turns)
{
    for (uint32_t node = 0; node < motion->poses[0].node_count; node++) {
        for (int i = 0; i < INTERVALS; i++)
            turns[node][i] = matrix_turn(motion->poses[i].nodes[node].parent_from_node,
                                         motion->poses[i + 1].nodes[node].parent_from_node);
    }
}

/* Sums of turns for each node, by its position in the hierarchy: over all nodes from it up to the root, which
 * bounds its turn in the world. */
struct turn_sums {
    const struct scene_pose *pose;
    const interval_turns *turns; /* turns of posed nodes */
    struct hierarchy hierarchy;
    interval_turns *sums;
    bool *known;
};

static bool turn_sums_init(struct turn_sums *sums, const struct scene *scene, const struct scene_pose *pose,
                           const interval_turns *turns)
{
    *sums = (struct turn_sums){.pose = pose, .turns = turns};
    if (!hierarchy_of_scene(&sums->hierarchy, scene))
        return false;
    sums->sums = malloc((sums->hierarchy.count + 1) * sizeof(*sums->sums));
    sums->known = calloc(sums->hierarchy.count + 1, sizeof(*sums->known));
    return sums->sums && sums->known;
}

static void turn_sums_finish(struct turn_sums *sums)
{
    hierarchy_finish(&sums->hierarchy);
    free(sums->sums);
    free(sums->known);
}

/* Sums up to the nearest ancestor with a known sum, then back down. */
static void turn_sums_resolve(struct turn_sums *sums, uint32_t start)
{
    uint32_t chain[SCENE_DEPTH_MAX], above = start;
    size_t length = 0;
    while (above != HIERARCHY_NONE && !sums->known[above] && length < SCENE_DEPTH_MAX) {
        chain[length++] = above;
        above = sums->hierarchy.parents[above];
    }
    while (length > 0) {
        uint32_t node = chain[--length];
        const struct pose_node *posed = scene_pose_node(sums->pose, sums->hierarchy.nodes[node]->base.id);
        for (int i = 0; i < INTERVALS; i++)
            sums->sums[node][i] = (above == HIERARCHY_NONE ? 0.0 : sums->sums[above][i]) +
                                  (posed ? sums->turns[posed - sums->pose->nodes][i] : 0.0);
        sums->known[node] = true;
        above = node;
    }
}

/* Number of intervals that may be joined without a turn beyond the limit, from `maximum` down. */
static int joinable(const interval_turns sum, int maximum)
{
    for (int together = maximum; together > 1; together /= 2) {
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
    const struct scene_mesh *mesh = node->value.kind == NODE_MESH ? scene_mesh(scene, node->value.object) : NULL;
    return node->value.kind == NODE_SPHERES || (mesh && !(node->value.skin && mesh->value.influence_count));
}

/* Number of the finest intervals that may be joined: 8, 4, 2 or 1; 0: out of memory. */
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
        return together; /* even for nodes in a single chain */
    struct turn_sums sums;
    if (!turn_sums_init(&sums, scene, pose, turns))
        together = 0;
    for (uint32_t i = 0; together > 1 && i < sums.hierarchy.count; i++) {
        if (!is_drawn_rigid(scene, sums.hierarchy.nodes[i]))
            continue;
        turn_sums_resolve(&sums, i);
        together = joinable(sums.sums[i], together);
    }
    turn_sums_finish(&sums);
    return together;
}

/* ---- poses -------------------------------------------------------------------------------------- */

static bool same_places(const struct scene_pose *a, const struct scene_pose *b)
{
    for (uint32_t i = 0; i < a->node_count; i++) {
        if (memcmp(a->nodes[i].parent_from_node, b->nodes[i].parent_from_node,
                   sizeof(a->nodes[i].parent_from_node)))
            return false;
    }
    return true;
}

static bool same_weights(const struct scene_pose *a, const struct scene_pose *b)
{
    return !a->weight_count || memcmp(a->weights, b->weights, a->weight_count * sizeof(*a->weights)) == 0;
}

/* Whether nothing moves; within a frame only nodes and weights do. */
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

/* Upper bound of the rotations without the poses in between: all of it counts in the first interval. */
static void bound_turns(struct player *player, uint32_t node_count, double open_s, double shutter_s,
                        double *bounds, interval_turns *turns)
{
    player_turn_bounds(player, open_s, open_s + shutter_s, bounds);
    memset(turns, 0, node_count * sizeof(*turns));
    for (uint32_t node = 0; node < node_count; node++)
        turns[node][0] = bounds[node];
}

/* Adds as many poses as needed between the two ends. False: out of memory. */
static bool fill_in(struct scene_motion *motion, struct player *player, double open_s, double shutter_s,
                    interval_turns *turns, double *bounds, struct error *error)
{
    bound_turns(player, motion->poses[0].node_count, open_s, shutter_s, bounds, turns);
    int together = intervals_together(player->scene, motion, (const interval_turns *)turns);
    if (together == 0 || together == INTERVALS)
        return together != 0;
    for (uint32_t i = 0; i < 2; i++)
        scene_pose_finish(&motion->poses[i]);
    motion->pose_count = 0;
    if (!add_poses(motion, player, open_s, shutter_s, INTERVALS, error))
        return false;
    posed_turns(motion, turns);
    together = intervals_together(player->scene, motion, (const interval_turns *)turns);
    if (together)
        thin_out(motion, (uint32_t)together);
    return together != 0;
}

static bool choose_poses(struct scene_motion *motion, struct player *player, double open_s, double shutter_s,
                         struct error *error)
{
    size_t count = (size_t)motion->poses[0].node_count + 1;
    interval_turns *turns = malloc(count * sizeof(*turns));
    double *bounds = malloc(count * sizeof(*bounds));
    bool fine = turns && bounds && fill_in(motion, player, open_s, shutter_s, turns, bounds, error);
    free(turns);
    free(bounds);
    if (!fine)
        return error_set(error, ERROR_OUT_OF_MEMORY, "clips", "no memory for the turns of %zu nodes", count - 1);
    if (stands_still(motion))
        thin_out(motion, MOTION_POSES_MAX);
    return true;
}

bool scene_motion_evaluate(struct scene_motion *motion, const struct scene *scene,
                           const struct record_clip_use *uses, uint32_t use_count, double open_s, double shutter_s,
                           struct error *error)
{
    struct player player;
    bool moves = shutter_s > 0.0;
    *motion = (struct scene_motion){0};
    bool fine = player_init(&player, scene, uses, use_count, error);
    if (fine && !(motion->poses = calloc(MOTION_POSES_MAX, sizeof(*motion->poses))))
        fine = error_set(error, ERROR_OUT_OF_MEMORY, "clips", "no memory for %d poses", MOTION_POSES_MAX);
    fine = fine && add_poses(motion, &player, open_s, shutter_s, moves ? 1 : 0, error) &&
           (!moves || choose_poses(motion, &player, open_s, shutter_s, error));
    player_finish(&player);
    if (!fine)
        scene_motion_finish(motion);
    return fine;
}

bool scene_motion_add_neighbours(struct scene_motion *motion, const struct scene *scene,
                                 const struct record_clip_use *uses, uint32_t use_count, const double times_s[2],
                                 struct error *error)
{
    motion->has_neighbours = scene_pose_evaluate(&motion->earlier, scene, uses, use_count, times_s[0], error) &&
                             scene_pose_evaluate(&motion->later, scene, uses, use_count, times_s[1], error);
    return motion->has_neighbours;
}
