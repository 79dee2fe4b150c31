/* SPDX-License-Identifier: MIT */
/* Existing scenes: listed, attached to, described; and their notifications. */
#include "lib/scene.h"
#include "lib/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/random.h>

#define NEW_IDS_FROM 0x80000000u

/* ---- the list ---- */

bool fl_scene_list(struct fl_connection *connection, struct fl_scene_entry **list, size_t *count,
                   struct fl_error *error)
{
    const struct message question = {.type = MESSAGE_SCENE_LIST};
    struct fl_received received;
    *list = NULL;
    *count = 0;
    if (!fl_connection_ask(connection, &question, MESSAGE_SCENE_LIST_REPLY, &received, error))
        return false;
    const struct message_scene_list_reply *reply = &received.message.scene_list_reply;
    struct fl_scene_entry *entries = calloc(reply->scenes_count + 1u, sizeof(*entries));
    if (!entries)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    for (uint32_t i = 0; i < reply->scenes_count; i++) {
        const struct record_scene_entry *from = &reply->scenes[i];
        entries[i].revision = from->revision;
        entries[i].triangles = from->triangles;
        entries[i].clients = from->clients;
        entries[i].sharing = from->sharing;
        snprintf(entries[i].name, sizeof(entries[i].name), "%s", from->name);
    }
    *list = entries;
    *count = reply->scenes_count;
    return true;
}

/* ---- one scene ---- */

static bool describe(struct fl_scene *scene, struct fl_received *received, struct fl_error *error)
{
    struct message question = {.type = MESSAGE_SCENE_DESCRIBE};
    question.scene_describe.scene = scene->scene;
    if (!fl_connection_ask(scene->connection, &question, MESSAGE_SCENE_DESCRIPTION, received, error))
        return false;
    fl_scene_note_revision(scene, received->message.scene_description.revision);
    return true;
}

static bool learn_cameras(struct fl_scene *scene, const struct message_scene_description *description)
{
    free(scene->cameras);
    scene->camera_count = 0;
    scene->cameras = calloc(description->cameras_count + 1u, sizeof(*scene->cameras));
    if (!scene->cameras)
        return false;
    scene->camera_count = description->cameras_count;
    for (size_t i = 0; i < scene->camera_count; i++) {
        scene->cameras[i].node = description->cameras[i].node;
        snprintf(scene->cameras[i].name, sizeof(scene->cameras[i].name), "%s", description->cameras[i].name);
    }
    return true;
}

static bool learn_clips(struct fl_catalogue *catalogue, const struct message_scene_description *description)
{
    free(catalogue->clips);
    catalogue->clip_count = catalogue->clip_capacity = 0;
    catalogue->clips = calloc(description->clips_count + 1u, sizeof(*catalogue->clips));
    if (!catalogue->clips)
        return false;
    catalogue->clip_count = catalogue->clip_capacity = description->clips_count;
    for (size_t i = 0; i < catalogue->clip_count; i++) {
        const struct record_clip_entry *from = &description->clips[i];
        struct fl_clip_info *clip = &catalogue->clips[i];
        clip->clip = from->channels > 0 ? from->clip : 0; /* a clip without channels cannot be played */
        clip->channels = from->channels;
        clip->duration_s = from->duration_s;
        snprintf(clip->name, sizeof(clip->name), "%s", from->name);
    }
    return true;
}

static bool learn(struct fl_scene *scene, const struct message_scene_description *description,
                  struct fl_error *error)
{
    return (learn_cameras(scene, description) && learn_clips(&scene->catalogue, description)) ||
           fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
}

/* Objects that other clients create later are unknown here: own identifiers begin far from theirs, at a different
 * number in each client. */
static bool choose_new_ids(struct fl_catalogue *catalogue)
{
    uint32_t chance;
    if (getrandom(&chance, sizeof(chance), 0) != (ssize_t)sizeof(chance))
        return false;
    for (int kind = 0; kind < PROTOCOL_OBJECT_COUNT; kind++)
        catalogue->max_id[kind] = NEW_IDS_FROM + chance / 4;
    return true;
}

static bool come_to(struct fl_scene *scene, const char *name, struct fl_error *error)
{
    struct message question = {.type = MESSAGE_SCENE_ATTACH};
    char short_name[129];
    struct fl_received received;
    fl_text_utf8(name, short_name, sizeof(short_name));
    question.scene_attach.scene = scene->scene;
    question.scene_attach.name = short_name;
    if (!fl_connection_ask(scene->connection, &question, MESSAGE_OK, &received, error))
        return false;
    fl_scene_note_revision(scene, received.message.ok.revision);
    scene->attached = true;
    if (!describe(scene, &received, error) || !learn(scene, &received.message.scene_description, error))
        return false;
    return choose_new_ids(&scene->catalogue) || fl_error_set(error, FL_ERROR_SYSTEM, "", "no random numbers");
}

struct fl_scene *fl_scene_attach(struct fl_connection *connection, const char *name, struct fl_error *error)
{
    if (!fl_connection_check(connection, error))
        return NULL;
    struct fl_scene *scene = fl_scene_create(connection, error);
    if (!scene || come_to(scene, name, error))
        return scene;
    fl_scene_destroy(scene);
    return NULL;
}

static void fill_bounds(struct fl_scene_bounds *bounds, const struct message_scene_description *description)
{
    *bounds = (struct fl_scene_bounds){.empty = description->empty != 0,
                                       .revision = description->revision,
                                       .triangles = description->triangles,
                                       .spheres = description->spheres};
    for (int axis = 0; axis < 3; axis++) {
        bounds->lower_world[axis] = description->lower_world[axis];
        bounds->upper_world[axis] = description->upper_world[axis];
    }
}

bool fl_scene_get_bounds(struct fl_scene *scene, struct fl_scene_bounds *bounds, struct fl_error *error)
{
    struct fl_received received;
    if (!describe(scene, &received, error))
        return false;
    fill_bounds(bounds, &received.message.scene_description);
    return true;
}

bool fl_scene_refresh(struct fl_scene *scene, struct fl_scene_bounds *bounds, struct fl_error *error)
{
    struct fl_received received;
    if (!describe(scene, &received, error) || !learn(scene, &received.message.scene_description, error))
        return false;
    fill_bounds(bounds, &received.message.scene_description);
    return true;
}

uint64_t fl_scene_revision(const struct fl_scene *scene)
{
    return scene->revision;
}
