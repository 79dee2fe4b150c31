/* SPDX-License-Identifier: MIT */
#include "session/scenes.h"

#include "protocol/codec.h"
#include "session/others.h"
#include "session/scene_record.h"
#include "session/session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Timeouts of questions to other workers: a list can do without an answer, an attach may need it. */
#define LIST_NS UINT64_C(500000000)
#define ATTACH_NS UINT64_C(10000000000)

struct session_scene {
    enum session_scene_state state;
    char name[SCENE_NAME_MAX + 1];
    uint64_t changed_revision; /* revision that the client must be notified of; 0: none */
};

static struct session_scene *find(const struct session *session, uint32_t scene)
{
    return hashmap_get(&session->scenes, scene);
}

enum session_scene_state session_scene(const struct session *session, uint32_t scene)
{
    const struct session_scene *found = find(session, scene);
    return found ? found->state : 0;
}

const char *session_scene_name(const struct session *session, uint32_t scene)
{
    const struct session_scene *found = find(session, scene);
    return found ? found->name : "";
}

static void forget(struct session *session, uint32_t scene)
{
    free(hashmap_remove(&session->scenes, scene));
}

void scenes_finish(struct session *session)
{
    size_t cursor = 0;
    void *scene;
    while (hashmap_next(&session->scenes, &cursor, NULL, &scene))
        free(scene);
    hashmap_finish(&session->scenes);
}

/* ---- coming and going -------------------------------------------------------------------------------- */

static bool add(struct session *session, uint32_t scene, const char *name, const char *field, struct error *error)
{
    uint32_t limit = session->hub->options.limits.scenes_per_client;
    if (find(session, scene))
        return error_set(error, ERROR_INVALID, field, "scene %u is there already", scene);
    if (session->scenes.count >= limit) {
        error_set(error, ERROR_LIMIT, field, "%u scenes are open, the limit", limit);
        return error_remedy(error, "close one, or raise limits.scenes in the daemon's configuration");
    }
    struct session_scene *added = calloc(1, sizeof(*added));
    if (!added || !hashmap_put(&session->scenes, scene, added)) {
        free(added);
        return error_set(error, ERROR_OUT_OF_MEMORY, field, "no memory");
    }
    added->state = SCENE_OPENING;
    snprintf(added->name, sizeof(added->name), "%s", name);
    return true;
}

static void submit(struct session *session, struct request *request, enum engine_command_kind kind, uint32_t scene,
                   const char *name, enum sharing sharing)
{
    request->scene = scene;
    struct engine_command *command = hub_command(kind, session->number, request->id);
    if (command) {
        command->scene = scene;
        command->principal = session->principal;
        command->sharing = sharing;
        snprintf(command->name, sizeof(command->name), "%s", name);
    }
    session_submit(session, request, command);
}

void scenes_open(struct session *session, struct request *request, const struct message_scene_open *open)
{
    struct error error = {0};
    enum sharing sharing = (enum sharing)open->sharing;
    /* An unidentified client shares its user with no other client. */
    if (sharing == SHARING_KEPT && !session->identity.known)
        sharing = SHARING_PRIVATE;
    if (!add(session, open->scene, open->name, "scene_open.scene", &error)) {
        request_answer_error(session, request, &error);
        return;
    }
    submit(session, request, ENGINE_SCENE_OPEN, open->scene, open->name, sharing);
}

void scenes_attach(struct session *session, struct request *request, const struct message_scene_attach *attach)
{
    struct error error = {0};
    if (!add(session, attach->scene, attach->name, "scene_attach.scene", &error)) {
        request_answer_error(session, request, &error);
        return;
    }
    submit(session, request, ENGINE_SCENE_ATTACH, attach->scene, attach->name, SHARING_PRIVATE);
}

/* False: the scene does not exist, and an error was sent. A scene that is being opened suffices: the engine runs
 * commands in order. */
static bool is_there(struct session *session, struct request *request, uint32_t scene, const char *field)
{
    enum session_scene_state state = session_scene(session, scene);
    if (state == SCENE_OPENING || state == SCENE_OPEN)
        return true;
    struct error error = {0};
    error_set(&error, ERROR_UNKNOWN_ID, field, "there is no scene %u", scene);
    request_answer_error(session, request, &error);
    return false;
}

void scenes_close(struct session *session, struct request *request, const struct message_scene_close *close)
{
    if (!is_there(session, request, close->scene, "scene_close.scene"))
        return;
    find(session, close->scene)->state = SCENE_CLOSING;
    submit(session, request, ENGINE_SCENE_CLOSE, close->scene, "", SHARING_PRIVATE);
}

void scenes_opened(struct session *session, struct request *request, uint64_t revision)
{
    struct session_scene *scene = find(session, request->scene);
    if (scene && scene->state == SCENE_OPENING)
        scene->state = SCENE_OPEN;
    request_answer_ok(session, request, revision);
}

void scenes_closed(struct session *session, struct request *request)
{
    forget(session, request->scene);
    request_answer_ok(session, request, 0);
}

void scenes_failed(struct session *session, const struct request *request, bool submitted)
{
    struct session_scene *scene = find(session, request->scene);
    if (request->kind == REQUEST_SCENE_OPEN || request->kind == REQUEST_SCENE_ATTACH) {
        if (scene && scene->state == SCENE_OPENING)
            forget(session, request->scene);
    } else if (request->kind == REQUEST_SCENE_CLOSE) {
        if (submitted)
            forget(session, request->scene);
        else if (scene)
            scene->state = SCENE_OPEN;
    }
}

/* ---- what there is ----------------------------------------------------------------------------------- */

void scenes_list(struct session *session, struct request *request)
{
    submit(session, request, ENGINE_SCENE_LIST, 0, "", SHARING_PRIVATE);
}

void scenes_describe(struct session *session, struct request *request,
                     const struct message_scene_describe *describe)
{
    if (is_there(session, request, describe->scene, "scene_describe.scene"))
        submit(session, request, ENGINE_SCENE_DESCRIBE, describe->scene, "", SHARING_PRIVATE);
}

void scenes_list_objects(struct session *session, struct request *request,
                         const struct message_scene_objects *objects)
{
    if (!is_there(session, request, objects->scene, "scene_objects.scene"))
        return;
    struct engine_command *command = hub_command(ENGINE_OBJECTS_LIST, session->number, request->id);
    if (command) {
        command->scene = objects->scene;
        command->object_kind = (enum object_kind)objects->kind;
        command->object = objects->object;
        command->list_from = objects->from;
        snprintf(command->name, sizeof(command->name), "%s", objects->name);
    }
    session_submit(session, request, command);
}

void scenes_get_object(struct session *session, struct request *request, const struct message_object_get *get)
{
    if (!is_there(session, request, get->scene, "object_get.scene"))
        return;
    struct engine_command *command = hub_command(ENGINE_OBJECT_READ, session->number, request->id);
    if (command) {
        command->scene = get->scene;
        command->object_kind = (enum object_kind)get->kind;
        command->object = get->object;
    }
    session_submit(session, request, command);
}

static void answer(struct session *session, struct request *request, const struct message *message)
{
    struct error error = {0};
    if (session_send(session, request->id, 0, message)) {
        request_answered(session, request);
        return;
    }
    error_set(&error, ERROR_INTERNAL, NULL, "the answer cannot be sent");
    request_answer_error(session, request, &error);
}

void scenes_fill_list(struct message *message, struct record_scene_entry entries[SCENES_LIST_MAX],
                      const struct engine_scene_list *list)
{
    message_init(message, MESSAGE_SCENE_LIST_REPLY);
    message->scene_list_reply.scenes = entries;
    message->scene_list_reply.scenes_count =
        (uint16_t)(list->count < SCENES_LIST_MAX ? list->count : SCENES_LIST_MAX);
    for (uint32_t i = 0; i < message->scene_list_reply.scenes_count; i++) {
        const struct engine_scene_entry *from = &list->scenes[i];
        entries[i] = (struct record_scene_entry){
            .revision = from->revision,
            .triangles = from->triangles,
            .clients = from->clients,
            .sharing = (enum protocol_sharing)from->sharing,
            .name = from->name,
        };
    }
}

static const struct record_scene_entry *find_entry(const struct message_scene_list_reply *list, const char *name)
{
    for (uint32_t i = 0; i < list->scenes_count; i++) {
        if (strcmp(list->scenes[i].name, name) == 0)
            return &list->scenes[i];
    }
    return NULL;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct record_scene_entry *)a)->name, ((const struct record_scene_entry *)b)->name);
}

static void on_listed(void *context, struct session *session, struct request *request,
                      const struct others_answer *answers)
{
    struct record_scene_entry entries[SCENES_LIST_MAX];
    struct message message;
    scenes_fill_list(&message, entries, context);
    struct message_scene_list_reply *reply = &message.scene_list_reply;
    for (const struct others_answer *other = answers; other; other = other->next) {
        const struct message_scene_list_reply *more = &other->message.scene_list_reply;
        for (uint32_t i = 0; i < more->scenes_count && reply->scenes_count < SCENES_LIST_MAX; i++) {
            /* The first entry of a name counts: an attach finds this worker's scene first. */
            if (!find_entry(reply, more->scenes[i].name))
                entries[reply->scenes_count++] = more->scenes[i];
        }
    }
    qsort(entries, reply->scenes_count, sizeof(entries[0]), by_name);
    if (session)
        answer(session, request, &message);
    free(context);
}

void scenes_listed(struct session *session, struct request *request, struct engine_scene_list *list)
{
    others_ask(session->hub->others, CHANNEL_SCENES, session, request, LIST_NS, on_listed, list);
}

struct search {
    char name[SCENE_NAME_MAX + 1];
    struct error error; /* where no worker has it */
};

static void move_or_refuse(struct session *session, struct request *request, uint32_t worker,
                           const struct search *search)
{
    struct error error = {0};
    struct message attach;
    message_init(&attach, MESSAGE_SCENE_ATTACH);
    attach.scene_attach.scene = request->scene;
    attach.scene_attach.name = search->name;
    scenes_failed(session, request, true);
    if (session_move(session, worker, request->id, &attach))
        return;
    error_set(
        &error, ERROR_UNSUPPORTED, "scene_attach.name",
        "\"%s\" is a scene of another user's: a client attaches to it while it has no scene and no other request",
        search->name);
    error_remedy(&error, "attach to it over a connection of its own");
    request_answer_error(session, request, &error);
}

static void on_searched(void *context, struct session *session, struct request *request,
                        const struct others_answer *answers)
{
    struct search *search = context;
    const struct others_answer *other = answers;
    while (other && !find_entry(&other->message.scene_list_reply, search->name))
        other = other->next;
    if (session)
        session_hold(session, session->hub->held);
    if (session && other) {
        move_or_refuse(session, request, other->worker, search);
    } else if (session) {
        scenes_failed(session, request, true);
        request_answer_error(session, request, &search->error);
    }
    free(search);
}

void scenes_find_elsewhere(struct session *session, struct request *request, const struct error *error)
{
    struct search *search = calloc(1, sizeof(*search));
    if (!search) {
        scenes_failed(session, request, true);
        request_answer_error(session, request, error);
        return;
    }
    search->error = *error;
    snprintf(search->name, sizeof(search->name), "%s", session_scene_name(session, request->scene));
    session_hold(session, true); /* the worker with the scene must get its next messages */
    others_ask(session->hub->others, CHANNEL_SCENES, session, request, ATTACH_NS, on_searched, search);
}

void scenes_described(struct session *session, struct request *request,
                      const struct engine_scene_description *from)
{
    struct record_camera_entry cameras[ENGINE_DESCRIPTION_MAX];
    struct record_clip_entry clips[ENGINE_DESCRIPTION_MAX];
    struct message message;
    message_init(&message, MESSAGE_SCENE_DESCRIPTION);
    struct message_scene_description *told = &message.scene_description;
    told->revision = from->revision;
    told->triangles = from->triangles;
    told->spheres = from->spheres;
    told->nodes = from->nodes;
    told->empty = from->empty;
    for (int axis = 0; axis < 3; axis++) {
        told->lower_world[axis] = from->lower_world[axis];
        told->upper_world[axis] = from->upper_world[axis];
    }
    for (uint32_t i = 0; i < from->camera_count; i++)
        cameras[i] = (struct record_camera_entry){
            .node = from->cameras[i].node, .fov_y = from->cameras[i].fov_y, .name = from->cameras[i].name};
    for (uint32_t i = 0; i < from->clip_count; i++)
        clips[i] = (struct record_clip_entry){.clip = from->clips[i].clip,
                                              .channels = from->clips[i].channels,
                                              .duration_s = from->clips[i].duration_s,
                                              .name = from->clips[i].name};
    told->cameras = cameras;
    told->cameras_count = from->camera_count;
    told->clips = clips;
    told->clips_count = from->clip_count;
    /* Many long names may exceed a message. */
    while (message_payload_bytes(&message) > CODEC_CONTROL_PAYLOAD_MAX_BYTES) {
        if (told->clips_count >= told->cameras_count)
            told->clips_count--;
        else
            told->cameras_count--;
    }
    answer(session, request, &message);
}

void scenes_objects_listed(struct session *session, struct request *request, const struct engine_object_list *list)
{
    struct record_object_entry entries[ENGINE_OBJECTS_MAX];
    struct message message;
    message_init(&message, MESSAGE_SCENE_OBJECTS_REPLY);
    message.scene_objects_reply.revision = list->revision;
    message.scene_objects_reply.total = list->total;
    message.scene_objects_reply.next = list->next;
    message.scene_objects_reply.objects = entries;
    message.scene_objects_reply.objects_count = list->count;
    for (uint32_t i = 0; i < list->count; i++) {
        const struct engine_object_entry *from = &list->objects[i];
        entries[i] = (struct record_object_entry){.object = from->object,
                                                  .parent = from->parent,
                                                  .shows_kind = (enum protocol_node_kind)from->shows_kind,
                                                  .shows = from->shows,
                                                  .name = from->name};
    }
    answer(session, request, &message);
}

struct sent_object {
    struct session *session;
    uint32_t request;
    bool sent;
};

static void send_object(void *context, const struct message *message)
{
    struct sent_object *sent = context;
    sent->sent = session_send(sent->session, sent->request, 0, message);
}

void scenes_object_is(struct session *session, struct request *request, const struct engine_event *event)
{
    struct sent_object sent = {.session = session, .request = request->id};
    if (scene_record_object(event->object, send_object, &sent) && sent.sent) {
        request_answer_ok(session, request, event->revision);
        return;
    }
    struct error error = {0};
    error_set(&error, ERROR_INTERNAL, NULL, "the object cannot be sent");
    request_answer_error(session, request, &error);
}

/* ---- changes ----------------------------------------------------------------------------------------- */

void scenes_changed(struct session *session, uint32_t scene, uint64_t revision)
{
    struct session_scene *changed = find(session, scene);
    if (!changed || changed->state == SCENE_CLOSING)
        return;
    changed->changed_revision = revision;
    session->scenes_changed = true;
    connection_wake(session->connection);
}

void scenes_send_changes(struct session *session)
{
    if (!session->scenes_changed)
        return;
    session->scenes_changed = false;
    size_t cursor = 0;
    uint64_t id;
    void *value;
    while (hashmap_next(&session->scenes, &cursor, &id, &value)) {
        struct session_scene *scene = value;
        if (!scene->changed_revision || scene->state == SCENE_CLOSING)
            continue;
        struct message message;
        message_init(&message, MESSAGE_SCENE_CHANGED);
        message.scene_changed.scene = (uint32_t)id;
        message.scene_changed.revision = scene->changed_revision;
        scene->changed_revision = 0;
        session_send(session, 0, 0, &message);
    }
}
