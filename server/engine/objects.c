/* SPDX-License-Identifier: MIT */
/* Objects of a scene for clients that edit what others made. */
#include "engine/engine_private.h"

#include <stdlib.h>
#include <string.h>

#define VISITS_MAX 65536u /* objects that one answer visits at: a millisecond or two */

static void add(struct engine_object_list *list, enum object_kind kind, const struct scene_object *object)
{
    struct engine_object_entry *entry = &list->objects[list->count++];
    entry->object = object->id;
    memcpy(entry->name, object->name, sizeof(entry->name));
    if (kind != OBJECT_NODE)
        return;
    const struct scene_node *node = (const struct scene_node *)(const void *)object;
    entry->parent = node->value.parent;
    entry->shows_kind = node->value.kind;
    entry->shows = node->value.object;
}

/* The cursor is the number of objects before it, so a whole list visits each object once. */
static void list_from(struct engine_object_list *list, const struct hashmap *objects,
                      const struct engine_command *command)
{
    size_t cursor = command->list_from;
    void *object = NULL;
    for (size_t visits = 0; visits < VISITS_MAX && list->count < ENGINE_OBJECTS_MAX; visits++) {
        if (!hashmap_next(objects, &cursor, NULL, &object))
            return;
        if (!command->name[0] || strcmp(((const struct scene_object *)object)->name, command->name) == 0)
            add(list, command->object_kind, object);
    }
    list->next = cursor < objects->count ? (uint32_t)cursor : 0;
}

void engine_objects_list(struct engine *engine, const struct engine_scene *from,
                         const struct engine_command *command)
{
    const struct hashmap *objects = &from->scene->objects[command->object_kind];
    struct engine_event *event = event_create(ENGINE_OBJECTS_LISTED, command->client, command->request);
    struct engine_object_list *list = event ? calloc(1, sizeof(*list)) : NULL;
    if (event && !list) {
        event->kind = ENGINE_FAILED;
        error_set(&event->error, ERROR_OUT_OF_MEMORY, "scene_objects", "no memory for an answer");
    }
    if (list) {
        const struct scene_object *one = command->object ? hashmap_get(objects, command->object) : NULL;
        list->revision = from->scene->revision;
        list->total = (uint32_t)objects->count;
        if (!command->object)
            list_from(list, objects, command);
        else if (one)
            add(list, command->object_kind, one);
        event->objects = list;
    }
    engine_post(engine, event);
}

void engine_object_read(struct engine *engine, const struct engine_scene *from,
                        const struct engine_command *command)
{
    struct engine_event *event = event_create(ENGINE_OBJECT_IS, command->client, command->request);
    if (event) {
        event->revision = from->scene->revision;
        event->object = calloc(1, sizeof(*event->object));
    }
    if (event && !event->object)
        error_set(&event->error, ERROR_OUT_OF_MEMORY, "object_get", "no memory for an answer");
    if (event && (!event->object || !scene_read_object(from->scene, command->object_kind, command->object,
                                                       event->object, &event->error)))
        event->kind = ENGINE_FAILED;
    engine_post(engine, event);
}
