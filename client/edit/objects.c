/* SPDX-License-Identifier: MIT */
/* Finding and reading the objects of a scene. */
#include "edit/objects.h"

#include "edit/field.h"
#include "lib/scene.h"
#include "lib/text.h"
#include "protocol/codec.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ANSWER_NS 30000000000ull
#define ENVIRONMENT 1u /* the identifier of the only environment */

/* ---- names ---- */

struct list {
    struct fl_object *objects; /* owned */
    size_t count, capacity;
};

static int by_id(const void *a, const void *b)
{
    const uint32_t left = ((const struct fl_object *)a)->id, right = ((const struct fl_object *)b)->id;
    return left < right ? -1 : left > right;
}

/* Sorts by identifier and removes duplicates: a list that changes while it is read may name an object twice. */
static void put_in_order(struct list *list)
{
    size_t kept = 0;
    if (list->count > 0)
        qsort(list->objects, list->count, sizeof(*list->objects), by_id);
    for (size_t i = 0; i < list->count; i++)
        if (kept == 0 || list->objects[kept - 1].id != list->objects[i].id)
            list->objects[kept++] = list->objects[i];
    list->count = kept;
}

static bool take_page(struct list *list, const struct message_scene_objects_reply *reply, struct fl_error *error)
{
    for (uint32_t i = 0; i < reply->objects_count; i++) {
        const struct record_object_entry *from = &reply->objects[i];
        if (!fl_grow((void **)&list->objects, &list->capacity, list->count, sizeof(*list->objects), error))
            return false;
        struct fl_object *object = &list->objects[list->count++];
        *object = (struct fl_object){
            .id = from->object, .parent = from->parent, .shows = from->shows, .shows_kind = from->shows_kind};
        snprintf(object->name, sizeof(object->name), "%s", from->name);
    }
    return true;
}

/* Lists the environment, which each scene has and the daemon does not list. */
static bool list_environment(struct list *list, struct fl_error *error)
{
    if (!fl_grow((void **)&list->objects, &list->capacity, list->count, sizeof(*list->objects), error))
        return false;
    list->objects[list->count++] = (struct fl_object){.id = ENVIRONMENT};
    return true;
}

/* Requests the list page by page; `name` empty: all objects. Positions ascend from page to page, so that the
 * requests end. */
static bool list_objects(struct fl_scene *scene, enum protocol_object_kind kind, const char *name,
                         struct list *list, struct fl_error *error)
{
    struct message question;
    struct fl_received received;
    if (kind == PROTOCOL_OBJECT_ENVIRONMENT)
        return list_environment(list, error);
    message_init(&question, MESSAGE_SCENE_OBJECTS);
    question.scene_objects.scene = scene->scene;
    question.scene_objects.kind = kind;
    question.scene_objects.name = name;
    do {
        if (!fl_connection_ask(scene->connection, &question, MESSAGE_SCENE_OBJECTS_REPLY, &received, error))
            return false;
        const struct message_scene_objects_reply *reply = &received.message.scene_objects_reply;
        const uint32_t before = question.scene_objects.from;
        question.scene_objects.from = reply->next;
        if (reply->next > 0 && reply->next <= before)
            return fl_error_set(error, FL_ERROR_PROTOCOL, "scene_objects_reply.next", "%u does not come after %u",
                                reply->next, before);
        if (!take_page(list, reply, error))
            return false;
    } while (question.scene_objects.from > 0);
    put_in_order(list);
    return true;
}

bool fl_scene_objects(struct fl_scene *scene, enum protocol_object_kind kind, struct fl_object **objects,
                      size_t *count, struct fl_error *error)
{
    struct list list = {0};
    *objects = NULL;
    *count = 0;
    if (!fl_connection_check(scene->connection, error))
        return false;
    if (!list_objects(scene, kind, "", &list, error)) {
        free(list.objects);
        return false;
    }
    *objects = list.objects;
    *count = list.count;
    return true;
}

bool fl_scene_object(struct fl_scene *scene, enum protocol_object_kind kind, uint32_t id, struct fl_object *object,
                     struct fl_error *error)
{
    struct message question;
    struct fl_received received;
    struct list list = {0};
    if (!fl_connection_check(scene->connection, error))
        return false;
    message_init(&question, MESSAGE_SCENE_OBJECTS);
    question.scene_objects.scene = scene->scene;
    question.scene_objects.kind = kind;
    question.scene_objects.object = id;
    if (!fl_connection_ask(scene->connection, &question, MESSAGE_SCENE_OBJECTS_REPLY, &received, error) ||
        !take_page(&list, &received.message.scene_objects_reply, error)) {
        free(list.objects);
        return false;
    }
    const bool found = id > 0 && list.count == 1 && list.objects[0].id == id;
    if (found)
        *object = list.objects[0];
    free(list.objects);
    return found || fl_error_set(error, FL_ERROR_ARGUMENT, protocol_object_kind_text(kind),
                                 "the scene has no %s #%u", protocol_object_kind_text(kind), id);
}

/* ---- which one is meant ---- */

struct wanted {
    enum protocol_object_kind kind;
    const char *which;
};

struct found {
    uint32_t *ids; /* owned */
    size_t count, capacity;
};

static bool add_id(struct found *found, uint32_t id, struct fl_error *error)
{
    if (!fl_grow((void **)&found->ids, &found->capacity, found->count, sizeof(*found->ids), error))
        return false;
    found->ids[found->count++] = id;
    return true;
}

/* Matches a pattern in which "*" stands for any characters. */
static bool matches(const char *pattern, const char *name)
{
    const char *star = NULL, *resume = NULL;
    while (*name != '\0') {
        if (*pattern == '*') {
            star = ++pattern;
            resume = name;
        } else if (*pattern == *name) {
            pattern++;
            name++;
        } else if (star) {
            pattern = star;
            name = ++resume;
        } else {
            return false;
        }
    }
    while (*pattern == '*')
        pattern++;
    return *pattern == '\0';
}

/* The kind that a node must show for its name to select an object of this kind; group: none. */
static enum protocol_node_kind shown_as(enum protocol_object_kind kind)
{
    return kind == PROTOCOL_OBJECT_LIGHT    ? PROTOCOL_NODE_LIGHT
           : kind == PROTOCOL_OBJECT_CAMERA ? PROTOCOL_NODE_CAMERA
                                            : PROTOCOL_NODE_GROUP;
}

/* Adds objects with matching names, all or the first; for lights and cameras without a match, objects by the
 * names of nodes. */
static bool add_matching(const struct list *objects, const struct list *nodes, enum protocol_object_kind kind,
                         const char *pattern, struct found *found, struct fl_error *error)
{
    const bool all = strchr(pattern, '*') != NULL;
    for (size_t i = 0; i < objects->count && (all || found->count == 0); i++)
        if (matches(pattern, objects->objects[i].name) && !add_id(found, objects->objects[i].id, error))
            return false;
    if (found->count > 0)
        return true;
    for (size_t i = 0; i < nodes->count && (all || found->count == 0); i++) {
        const struct fl_object *node = &nodes->objects[i];
        if (node->shows_kind == shown_as(kind) && node->shows > 0 && matches(pattern, node->name) &&
            !add_id(found, node->shows, error))
            return false;
    }
    return true;
}

static bool unknown(const struct list *objects, const struct list *nodes, const struct wanted *wanted,
                    struct fl_error *error)
{
    const char *what = protocol_object_kind_text(wanted->kind);
    struct fl_nearest nearest = {0};
    struct fl_listing listing;
    fl_listing_begin(&listing, objects->count, what);
    for (size_t i = 0; i < objects->count; i++) {
        fl_nearest_try(&nearest, wanted->which, objects->objects[i].name);
        if (!fl_listing_is_full(&listing))
            fl_listing_add(&listing, objects->objects[i].name);
    }
    for (size_t i = 0; i < nodes->count; i++)
        if (nodes->objects[i].shows_kind == shown_as(wanted->kind))
            fl_nearest_try(&nearest, wanted->which, nodes->objects[i].name);
    fl_error_set(error, FL_ERROR_ARGUMENT, "", "the scene has no %s '%s'", what, wanted->which);
    if (nearest.name)
        return fl_error_remedy(error, "did you mean '%s'?", nearest.name);
    return fl_error_remedy(error, "%s", listing.text);
}

static bool find_in_lists(struct fl_scene *scene, const struct wanted *wanted, struct list *objects,
                          struct list *nodes, struct found *found, struct fl_error *error)
{
    const bool by_nodes = shown_as(wanted->kind) != PROTOCOL_NODE_GROUP;
    uint64_t index = 0;
    /* Requests this one name first, since a scene may have millions. */
    if (!list_objects(scene, wanted->kind, wanted->which, objects, error) ||
        (by_nodes && objects->count == 0 &&
         !list_objects(scene, PROTOCOL_OBJECT_NODE, wanted->which, nodes, error)))
        return false;
    if (objects->count > 0)
        return add_id(found, objects->objects[0].id, error);
    if (nodes->count > 0 && !add_matching(objects, nodes, wanted->kind, nodes->objects[0].name, found, error))
        return false;
    if (found->count > 0)
        return true;
    nodes->count = 0;
    if (!list_objects(scene, wanted->kind, "", objects, error) ||
        (by_nodes && !list_objects(scene, PROTOCOL_OBJECT_NODE, "", nodes, error)))
        return false;
    if (objects->count > 0 && fl_text_integer(wanted->which, 0, objects->count - 1, &index, NULL))
        return add_id(found, objects->objects[index].id, error);
    if (strchr(wanted->which, '*') && !add_matching(objects, nodes, wanted->kind, wanted->which, found, error))
        return false;
    return found->count > 0 || unknown(objects, nodes, wanted, error);
}

bool fl_scene_find_objects(struct fl_scene *scene, enum protocol_object_kind kind, const char *which,
                           uint32_t **ids, size_t *count, struct fl_error *error)
{
    const struct wanted wanted = {.kind = kind, .which = which};
    struct list objects = {0}, nodes = {0};
    struct found found = {0};
    uint64_t id = 0;
    bool good = fl_connection_check(scene->connection, error);
    if (good && which[0] == '#' && fl_text_integer(which + 1, 1, UINT32_MAX, &id, NULL))
        good = add_id(&found, (uint32_t)id, error);
    else if (good && kind == PROTOCOL_OBJECT_ENVIRONMENT)
        good = add_id(&found, ENVIRONMENT, error);
    else if (good)
        good = find_in_lists(scene, &wanted, &objects, &nodes, &found, error);
    free(objects.objects);
    free(nodes.objects);
    if (!good)
        free(found.ids);
    *ids = good ? found.ids : NULL;
    *count = good ? found.count : 0;
    return good;
}

/* ---- one as it is ---- */

static uint32_t id_in(const struct message *message)
{
    return message->type == MESSAGE_SET_NODE          ? message->set_node.node
           : message->type == MESSAGE_SET_MATERIAL    ? message->set_material.material
           : message->type == MESSAGE_SET_LIGHT       ? message->set_light.light
           : message->type == MESSAGE_SET_CAMERA      ? message->set_camera.camera
           : message->type == MESSAGE_SET_ENVIRONMENT ? ENVIRONMENT
                                                      : 0;
}

/* Copies a message by encoding and decoding it, so that it needs no buffer of the connection. */
static bool keep_message(struct edit_object *object, const struct message *message, struct fl_error *error)
{
    const size_t payload_bytes = message_payload_bytes(message), scratch_bytes = 2 * payload_bytes + 8;
    uint8_t *payload = malloc(payload_bytes);
    struct writer writer;
    struct scratch scratch;
    object->memory = malloc(scratch_bytes);
    if (!payload || !object->memory) {
        free(payload);
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    }
    writer_init(&writer, payload, payload_bytes);
    scratch_init(&scratch, object->memory, scratch_bytes);
    const bool kept =
        message_encode(&writer, message) &&
        message_decode(&object->message, (uint16_t)message->type, payload, writer.used_bytes, &scratch, NULL);
    free(payload);
    return kept || fl_error_set(error, FL_ERROR_PROTOCOL, "", "the daemon's answer cannot be kept");
}

bool edit_object_read(struct fl_scene *scene, enum protocol_object_kind kind, uint32_t id,
                      struct edit_object *object, struct fl_error *error)
{
    struct fl_connection *connection = scene->connection;
    const enum message_type type = edit_message_type(kind);
    struct message question;
    struct fl_received received;
    *object = (struct edit_object){.kind = kind, .id = id};
    if (!fl_connection_check(connection, error))
        return false;
    if (type == MESSAGE_OK)
        return fl_error_set(error, FL_ERROR_ARGUMENT, protocol_object_kind_text(kind),
                            "objects of this kind have no fields");
    message_init(&question, MESSAGE_OBJECT_GET);
    question.object_get.scene = scene->scene;
    question.object_get.kind = kind;
    question.object_get.object = id;
    const uint32_t request = fl_connection_next_request(connection);
    const uint64_t until_ns = monotonic_now_ns() + ANSWER_NS;
    if (!fl_connection_send(connection, request, 0, &question, error) ||
        !fl_connection_answer(connection, request, type, &received, until_ns, error))
        return false;
    if (id_in(&received.message) != id)
        return fl_error_set(error, FL_ERROR_PROTOCOL, message_type_text(type),
                            "the answer is for another object than %u", id);
    if (!keep_message(object, &received.message, error) ||
        !fl_connection_answer(connection, request, MESSAGE_OK, &received, until_ns, error))
        return false;
    object->revision = received.message.ok.revision;
    return true;
}

void edit_object_finish(struct edit_object *object)
{
    free(object->memory);
    *object = (struct edit_object){0};
}
