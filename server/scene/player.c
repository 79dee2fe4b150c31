/* SPDX-License-Identifier: MIT */
/* Evaluation of a job's clips: tracks of each object, in order. */
#include "scene/player.h"

#include "scene/local_transform.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Minimum size of an area light: divisions by an area of 0 would give NaN. */
#define LIGHT_SIZE_MIN 1e-6f

/* ---- tracks ------------------------------------------------------------------------------------- */

static int compare_tracks(const void *a, const void *b)
{
    const struct player_track *x = a, *y = b;
    if (x->target != y->target)
        return x->target < y->target ? -1 : 1;
    if (x->channel->value.object != y->channel->value.object)
        return x->channel->value.object < y->channel->value.object ? -1 : 1;
    if (x->use != y->use)
        return x->use < y->use ? -1 : 1;
    uint32_t id_x = x->channel->base.id, id_y = y->channel->base.id;
    return (id_x > id_y) - (id_x < id_y);
}

static bool is_sorted(const struct player *player)
{
    for (size_t i = 1; i < player->track_count; i++) {
        if (compare_tracks(&player->tracks[i - 1], &player->tracks[i]) > 0)
            return false;
    }
    return true;
}

/* End of the tracks that change the same object as the one at `first`. */
static size_t group_end(const struct player *player, size_t first)
{
    const struct player_track *track = &player->tracks[first];
    size_t end = first + 1;
    while (end < player->track_count && player->tracks[end].target == track->target &&
           player->tracks[end].channel->value.object == track->channel->value.object)
        end++;
    return end;
}

static double last_key_s(const struct scene_channel *channel, const struct scene_clip *clip)
{
    const float *floats = (const float *)(const void *)clip->floats->data;
    return (double)floats[(size_t)channel->value.first_time + channel->value.key_count - 1];
}

/* Finds the last use of a clip, which overrides all earlier ones. */
static bool last_use(const struct player *player, uint32_t clip, uint32_t *use)
{
    for (uint32_t i = player->use_count; i-- > 0;) {
        if (player->uses[i].clip != clip)
            continue;
        *use = i;
        return true;
    }
    return false;
}

static void take_channel(struct player *player, const struct scene_channel *channel)
{
    uint32_t use;
    const struct channel_row *row = channel_row(channel->value.path);
    const struct scene_clip *clip = scene_clip(player->scene, channel->value.clip);
    if (!row || !clip || !last_use(player, channel->value.clip, &use))
        return;
    player->durations_s[use] = fmax(player->durations_s[use], last_key_s(channel, clip));
    player->tracks[player->track_count++] = (struct player_track){channel, clip, row->target, use};
    player->target_tracks[row->target]++;
    if (row->target == TARGET_WEIGHTS)
        player->weight_count += channel->value.width;
}

static bool uses_check(const struct scene *scene, const struct record_clip_use *uses, uint32_t use_count,
                       struct error *error)
{
    for (uint32_t i = 0; i < use_count; i++) {
        if (scene_clip(scene, uses[i].clip))
            continue;
        char field[48];
        snprintf(field, sizeof(field), "clips[%u].clip", i);
        return error_set(error, ERROR_UNKNOWN_ID, field, "clip %u does not exist", uses[i].clip);
    }
    return true;
}

bool player_init(struct player *player, const struct scene *scene, const struct record_clip_use *uses,
                 uint32_t use_count, struct error *error)
{
    *player = (struct player){.scene = scene, .uses = uses, .use_count = use_count};
    if (!uses_check(scene, uses, use_count, error))
        return false;
    const struct hashmap *channels = &scene->objects[OBJECT_CHANNEL];
    if (!use_count || !channels->count)
        return true;
    player->durations_s = calloc(use_count, sizeof(*player->durations_s));
    player->times_s = calloc(use_count, sizeof(*player->times_s));
    player->tracks = malloc(channels->count * sizeof(*player->tracks));
    if (!player->durations_s || !player->times_s || !player->tracks)
        return error_set(error, ERROR_OUT_OF_MEMORY, "clips", "no memory for %zu channels", channels->count);
    size_t cursor = 0;
    void *value;
    while (hashmap_next(channels, &cursor, NULL, &value))
        take_channel(player, value);
    if (!is_sorted(player))
        qsort(player->tracks, player->track_count, sizeof(*player->tracks), compare_tracks);
    return true;
}

void player_finish(struct player *player)
{
    free(player->durations_s);
    free(player->times_s);
    free(player->tracks);
    *player = (struct player){0};
}

double scene_clip_duration_s(const struct scene *scene, uint32_t clip_id)
{
    const struct scene_clip *clip = scene_clip(scene, clip_id);
    double duration_s = 0.0;
    size_t cursor = 0;
    void *value;
    while (clip && hashmap_next(&scene->objects[OBJECT_CHANNEL], &cursor, NULL, &value)) {
        const struct scene_channel *channel = value;
        if (channel->value.clip == clip_id)
            duration_s = fmax(duration_s, last_key_s(channel, clip));
    }
    return duration_s;
}

/* ---- one pose ----------------------------------------------------------------------------------- */

static void set_times(struct player *player, double time_s)
{
    for (uint32_t i = 0; player->times_s && i < player->use_count; i++) {
        const struct record_clip_use *use = &player->uses[i];
        double clip_s = fmax((time_s - (double)use->start_s) * (double)use->speed, 0.0);
        if (use->loop)
            clip_s = player->durations_s[i] > 0.0 ? fmod(clip_s, player->durations_s[i]) : 0.0;
        player->times_s[i] = clip_s;
    }
}

/* Evaluates a track, clamped to the protocol's range. */
static void evaluate(const struct player *player, const struct player_track *track, float *out)
{
    const struct channel_row *row = channel_row(track->channel->value.path);
    struct curve curve = channel_curve(track->channel, track->clip);
    double value[CURVE_WIDTH_MAX];
    curve_at(&curve, player->times_s[track->use], value);
    for (uint32_t i = 0; i < curve.width; i++)
        out[i] = (float)fmin(fmax(value[i], row->min), row->max);
}

static void change_transform(const struct player *player, const struct player_track *track,
                             struct local_transform *transform)
{
    struct curve curve = channel_curve(track->channel, track->clip);
    double value[CURVE_WIDTH_MAX], time_s = player->times_s[track->use];
    if (track->channel->value.path == CHANNEL_NODE_ROTATION) {
        curve_rotation_at(&curve, time_s, value);
        local_transform_set_rotation(transform, value);
        return;
    }
    curve_at(&curve, time_s, value);
    memcpy(track->channel->value.path == CHANNEL_NODE_TRANSLATION ? transform->translation : transform->scale,
           value, 3 * sizeof(*value));
}

/* Poses a node by `count` tracks of one object. */
static void pose_node(const struct player *player, const struct player_track *tracks, size_t count,
                      struct scene_pose *pose)
{
    const struct scene_node *node = scene_node(player->scene, tracks->channel->value.object);
    if (!node)
        return;
    struct pose_node *posed = &pose->nodes[pose->node_count++];
    struct local_transform transform;
    bool moves = false;
    *posed = (struct pose_node){.node = node->base.id, .hidden = node->value.hidden};
    memcpy(posed->parent_from_node, node->value.parent_from_node, sizeof(posed->parent_from_node));
    for (size_t i = 0; i < count; i++) {
        if (tracks[i].channel->value.path == CHANNEL_NODE_HIDDEN) {
            float hidden;
            evaluate(player, &tracks[i], &hidden);
            posed->hidden = hidden >= 0.5f;
            continue;
        }
        if (!moves)
            local_transform_from_matrix(&transform, node->value.parent_from_node);
        moves = true;
        change_transform(player, &tracks[i], &transform);
    }
    if (moves)
        local_transform_to_matrix(&transform, posed->parent_from_node);
}

static void pose_weights(const struct player *player, const struct player_track *tracks, size_t count,
                         struct scene_pose *pose)
{
    const struct player_track *track = &tracks[count - 1];
    struct pose_weights *posed = &pose->morphs[pose->morph_count++];
    *posed = (struct pose_weights){track->channel->value.object, pose->weight_count, track->channel->value.width};
    evaluate(player, track, pose->weights + pose->weight_count);
    pose->weight_count += track->channel->value.width;
}

static void pose_light(const struct player *player, const struct player_track *tracks, size_t count,
                       struct scene_pose *pose)
{
    const struct scene_light *light = scene_light(player->scene, tracks->channel->value.object);
    if (!light)
        return;
    struct scene_light *posed = &pose->lights[pose->light_count++];
    *posed = *light;
    for (size_t i = 0; i < count; i++)
        evaluate(player, &tracks[i],
                 tracks[i].channel->value.path == CHANNEL_LIGHT_COLOUR ? posed->value.colour : posed->value.size);
    for (int i = 0; i < 2 && (light->value.kind == LIGHT_RECTANGLE || light->value.kind == LIGHT_SPHERE); i++)
        posed->value.size[i] = fmaxf(posed->value.size[i], LIGHT_SIZE_MIN);
}

static float *material_value(struct scene_material *material, enum channel_path path)
{
    switch (path) {
    case CHANNEL_MATERIAL_BASE_COLOUR:
        return material->value.base_colour;
    case CHANNEL_MATERIAL_EMISSION:
        return material->value.emission;
    case CHANNEL_MATERIAL_METALLIC:
        return &material->value.metallic;
    case CHANNEL_MATERIAL_ROUGHNESS:
        return &material->value.roughness;
    case CHANNEL_MATERIAL_TRANSMISSION:
        return &material->value.transmission;
    default:
        return &material->value.ior;
    }
}

static void pose_material(const struct player *player, const struct player_track *tracks, size_t count,
                          struct scene_pose *pose)
{
    const struct scene_material *material = scene_material(player->scene, tracks->channel->value.object);
    if (!material)
        return;
    struct scene_material *posed = &pose->materials[pose->material_count++];
    *posed = *material;
    for (size_t i = 0; i < count; i++)
        evaluate(player, &tracks[i], material_value(posed, tracks[i].channel->value.path));
}

static float *view_value(struct pose_view *view, enum channel_path path, unsigned *given)
{
    switch (path) {
    case CHANNEL_VIEW_EYE:
        *given = POSE_VIEW_EYE;
        return view->eye_world;
    case CHANNEL_VIEW_LOOK_AT:
        *given = POSE_VIEW_LOOK_AT;
        return view->look_at_world;
    case CHANNEL_VIEW_UP:
        *given = POSE_VIEW_UP;
        return view->up_world;
    case CHANNEL_VIEW_FOV_Y:
        *given = POSE_VIEW_FOV_Y;
        return &view->fov_y;
    case CHANNEL_VIEW_APERTURE:
        *given = POSE_VIEW_APERTURE;
        return &view->aperture;
    case CHANNEL_VIEW_FOCUS:
        *given = POSE_VIEW_FOCUS;
        return &view->focus;
    default:
        *given = POSE_VIEW_EXPOSURE;
        return &view->exposure_stops;
    }
}

static void pose_view(const struct player *player, const struct player_track *tracks, size_t count,
                      struct scene_pose *pose)
{
    for (size_t i = 0; i < count; i++) {
        unsigned given;
        evaluate(player, &tracks[i], view_value(&pose->view, tracks[i].channel->value.path, &given));
        pose->view.given |= given;
    }
}

static bool pose_reserve(const struct player *player, struct scene_pose *pose, struct error *error)
{
    const size_t *tracks = player->target_tracks;
    pose->nodes = calloc(tracks[TARGET_NODE] + 1, sizeof(*pose->nodes));
    pose->morphs = calloc(tracks[TARGET_WEIGHTS] + 1, sizeof(*pose->morphs));
    pose->weights = calloc(player->weight_count + 1, sizeof(*pose->weights));
    pose->lights = calloc(tracks[TARGET_LIGHT] + 1, sizeof(*pose->lights));
    pose->materials = calloc(tracks[TARGET_MATERIAL] + 1, sizeof(*pose->materials));
    if (pose->nodes && pose->morphs && pose->weights && pose->lights && pose->materials)
        return true;
    scene_pose_finish(pose);
    return error_set(error, ERROR_OUT_OF_MEMORY, "clips", "no memory for the pose of %zu channels",
                     player->track_count);
}

bool player_pose(struct player *player, double time_s, struct scene_pose *pose, struct error *error)
{
    static void (*const makers[])(const struct player *, const struct player_track *, size_t,
                                  struct scene_pose *) = {
        [TARGET_NODE] = pose_node,         [TARGET_WEIGHTS] = pose_weights, [TARGET_LIGHT] = pose_light,
        [TARGET_MATERIAL] = pose_material, [TARGET_VIEW] = pose_view,
    };
    *pose = (struct scene_pose){0};
    if (!player->track_count)
        return true;
    if (!pose_reserve(player, pose, error))
        return false;
    set_times(player, time_s);
    for (size_t first = 0, end; first < player->track_count; first = end) {
        end = group_end(player, first);
        makers[player->tracks[first].target](player, &player->tracks[first], end - first, pose);
    }
    return true;
}

/* Turn bound of the last track that rotates the node, as it overrides the others. */
static double track_turn_bound(struct player *player, const struct player_track *tracks, size_t count,
                               double from_s, double to_s)
{
    for (size_t i = count; i-- > 0;) {
        if (tracks[i].channel->value.path != CHANNEL_NODE_ROTATION)
            continue;
        struct curve curve = channel_curve(tracks[i].channel, tracks[i].clip);
        set_times(player, from_s);
        double clip_from_s = player->times_s[tracks[i].use];
        set_times(player, to_s);
        double clip_to_s = player->times_s[tracks[i].use];
        /* A clip jumps where it begins again. */
        bool jumps = clip_to_s < clip_from_s || (player->uses[tracks[i].use].loop &&
                                                 (to_s - from_s) * (double)player->uses[tracks[i].use].speed >=
                                                     player->durations_s[tracks[i].use]);
        return jumps ? INFINITY : curve_turn_bound(&curve, clip_from_s, clip_to_s);
    }
    return 0.0;
}

void player_turn_bounds(struct player *player, double from_s, double to_s, double *bounds)
{
    uint32_t node = 0;
    for (size_t first = 0, end; first < player->target_tracks[TARGET_NODE]; first = end) {
        end = group_end(player, first);
        if (scene_node(player->scene, player->tracks[first].channel->value.object))
            bounds[node++] = track_turn_bound(player, &player->tracks[first], end - first, from_s, to_s);
    }
}
