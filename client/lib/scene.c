/* SPDX-License-Identifier: MIT */
/* Scenes of a connection, and the contents of a loaded one. */
#include "lib/scene.h"
#include "lib/text.h"

#include <stdlib.h>
#include <string.h>

void fl_scene_note_revision(struct fl_scene *scene, uint64_t revision)
{
    if (revision > scene->revision)
        scene->revision = revision;
}

/* The message is for all that have the scene. */
static int take_message(struct fl_receiver *receiver, const struct framing_header *header,
                        const struct message *message, struct fl_error *error)
{
    struct fl_scene *scene = (struct fl_scene *)receiver;
    (void)header;
    (void)error;
    if (message->type != MESSAGE_SCENE_CHANGED || message->scene_changed.scene != scene->scene)
        return 0;
    fl_scene_note_revision(scene, message->scene_changed.revision);
    return 1;
}

struct fl_scene *fl_scene_create(struct fl_connection *connection, struct fl_error *error)
{
    struct fl_scene *scene = calloc(1, sizeof(*scene));
    if (!scene) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    scene->connection = connection;
    scene->scene = ++connection->last_scene;
    scene->receiver.take = take_message;
    fl_connection_add(connection, &scene->receiver);
    return scene;
}

void fl_scene_forget_import(struct fl_scene *scene)
{
    free(scene->cameras);
    for (size_t i = 0; i < scene->file_count; i++)
        free(scene->files[i]);
    free(scene->files);
    fl_catalogue_finish(&scene->catalogue);
    fl_imported_finish(&scene->imported);
}

/* Removes this client's clips from another client's scene. */
static void remove_clips(const struct fl_scene *scene)
{
    struct message begin = {.type = MESSAGE_EDIT_BEGIN}, remove = {.type = MESSAGE_REMOVE},
                   commit = {.type = MESSAGE_EDIT_COMMIT};
    const uint32_t request = fl_connection_next_request(scene->connection);
    begin.edit_begin.scene = scene->scene;
    fl_connection_send_late(scene->connection, request, &begin);
    for (size_t i = 0; i < scene->clip_count; i++) {
        remove.remove.kind = PROTOCOL_OBJECT_CLIP;
        remove.remove.object = scene->clips[i];
        fl_connection_send_late(scene->connection, request, &remove);
    }
    fl_connection_send_late(scene->connection, request, &commit);
}

/* Does not wait for answers: they are dropped on arrival. */
void fl_scene_destroy(struct fl_scene *scene)
{
    if (!scene)
        return;
    struct message close = {.type = MESSAGE_SCENE_CLOSE};
    if (scene->clip_count > 0)
        remove_clips(scene);
    close.scene_close.scene = scene->scene;
    fl_connection_send_late(scene->connection, fl_connection_next_request(scene->connection), &close);
    fl_connection_remove(scene->connection, &scene->receiver);
    free(scene->clips);
    fl_scene_forget_import(scene);
    free(scene);
}

const struct fl_import_stats *fl_scene_import_stats(const struct fl_scene *scene)
{
    return &scene->stats;
}

const char *fl_scene_file(const struct fl_scene *scene, size_t index)
{
    return index < scene->file_count ? scene->files[index] : NULL;
}

size_t fl_scene_camera_count(const struct fl_scene *scene)
{
    return scene->camera_count;
}

const struct fl_camera_info *fl_scene_camera(const struct fl_scene *scene, size_t index)
{
    return index < scene->camera_count ? &scene->cameras[index] : NULL;
}

bool fl_scene_find_camera(const struct fl_scene *scene, const char *which, uint32_t *node, struct fl_error *error)
{
    for (size_t i = 0; i < scene->camera_count; i++)
        if (strcmp(scene->cameras[i].name, which) == 0) {
            *node = scene->cameras[i].node;
            return true;
        }
    uint64_t index = 0;
    if (scene->camera_count > 0 && fl_text_integer(which, 0, scene->camera_count - 1, &index, NULL)) {
        *node = scene->cameras[index].node;
        return true;
    }
    fl_error_set(error, FL_ERROR_ARGUMENT, "--camera", "the model has no camera '%s'", which);
    if (scene->camera_count == 0)
        return fl_error_remedy(error, "the scene has no cameras; use --eye and --look-at");
    return fl_error_remedy(error, "it has %zu; 'farlight info' lists them", scene->camera_count);
}

size_t fl_scene_clip_count(const struct fl_scene *scene)
{
    return scene->catalogue.clip_count;
}

const struct fl_clip_info *fl_scene_clip(const struct fl_scene *scene, size_t index)
{
    return index < scene->catalogue.clip_count ? &scene->catalogue.clips[index] : NULL;
}

bool fl_scene_find_clip(const struct fl_scene *scene, const char *which, uint32_t *clip,
                        const struct fl_clip_info **info, struct fl_error *error)
{
    return fl_catalogue_find_clip(&scene->catalogue, which, clip, info, error);
}

bool fl_scene_find_object(const struct fl_scene *scene, enum protocol_object_kind kind, const char *which,
                          uint32_t *id, struct fl_error *error)
{
    return fl_catalogue_find(&scene->catalogue, kind, which, id, error);
}

bool fl_scene_is_lit(const struct fl_scene *scene)
{
    return scene->catalogue.is_lit;
}

bool fl_scene_light_has_size(const struct fl_scene *scene, uint32_t light)
{
    return fl_catalogue_light_has_size(&scene->catalogue, light);
}

uint32_t fl_scene_new_id(struct fl_scene *scene, enum protocol_object_kind kind)
{
    return fl_catalogue_new_id(&scene->catalogue, kind);
}
