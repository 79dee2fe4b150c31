/* SPDX-License-Identifier: MIT */
/* A hash table of digests of imported objects. */
#include "lib/imported.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

/* Edits that set an object, and the place of its identifier in the message. A scene has a single environment,
 * without an identifier. */
static const struct {
    enum message_type type;
    enum protocol_object_kind kind;
    size_t id;
} edits[] = {
    {MESSAGE_SET_NODE, PROTOCOL_OBJECT_NODE, offsetof(struct message, set_node.node)},
    {MESSAGE_SET_MESH, PROTOCOL_OBJECT_MESH, offsetof(struct message, set_mesh.mesh)},
    {MESSAGE_SET_SPHERES, PROTOCOL_OBJECT_SPHERES, offsetof(struct message, set_spheres.spheres)},
    {MESSAGE_SET_DISC, PROTOCOL_OBJECT_DISC, offsetof(struct message, set_disc.disc)},
    {MESSAGE_SET_MATERIAL, PROTOCOL_OBJECT_MATERIAL, offsetof(struct message, set_material.material)},
    {MESSAGE_SET_TEXTURE, PROTOCOL_OBJECT_TEXTURE, offsetof(struct message, set_texture.texture)},
    {MESSAGE_SET_LIGHT, PROTOCOL_OBJECT_LIGHT, offsetof(struct message, set_light.light)},
    {MESSAGE_SET_CAMERA, PROTOCOL_OBJECT_CAMERA, offsetof(struct message, set_camera.camera)},
    {MESSAGE_SET_SKIN, PROTOCOL_OBJECT_SKIN, offsetof(struct message, set_skin.skin)},
    {MESSAGE_SET_CLIP, PROTOCOL_OBJECT_CLIP, offsetof(struct message, set_clip.clip)},
    {MESSAGE_SET_CHANNEL, PROTOCOL_OBJECT_CHANNEL, offsetof(struct message, set_channel.channel)},
    {MESSAGE_SET_ENVIRONMENT, PROTOCOL_OBJECT_ENVIRONMENT, 0},
};

/* False: no edit that sets an object. */
static bool object_of(const struct message *message, struct fl_imported_object *object)
{
    for (size_t i = 0; i < sizeof(edits) / sizeof(edits[0]); i++) {
        if (edits[i].type != message->type)
            continue;
        *object = (struct fl_imported_object){.is_there = true, .kind = edits[i].kind};
        if (edits[i].id)
            memcpy(&object->id, (const char *)message + edits[i].id, sizeof(object->id));
        return true;
    }
    return false;
}

/* The object's place, or the empty one where it belongs; one of four places is always empty. */
static struct fl_imported_object *place_of(const struct fl_imported *imported,
                                           const struct fl_imported_object *object)
{
    const uint64_t key = (uint64_t)object->kind << 32 | object->id;
    for (size_t at = (size_t)XXH3_64bits(&key, sizeof(key));; at++) {
        struct fl_imported_object *place = &imported->places[at & (imported->capacity - 1)];
        if (!place->is_there || (place->kind == object->kind && place->id == object->id))
            return place;
    }
}

static bool make_room(struct fl_imported *imported, struct fl_error *error)
{
    if ((imported->count + 1) * 4 <= imported->capacity * 3)
        return true;
    struct fl_imported grown = {.count = imported->count,
                                .capacity = imported->capacity > 0 ? imported->capacity * 2 : 64};
    grown.places = calloc(grown.capacity, sizeof(*grown.places));
    if (!grown.places)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    for (size_t i = 0; i < imported->capacity; i++)
        if (imported->places[i].is_there)
            *place_of(&grown, &imported->places[i]) = imported->places[i];
    free(imported->places);
    *imported = grown;
    return true;
}

bool fl_imported_add(struct fl_imported *imported, const struct frame *frame, const struct message *message,
                     struct fl_error *error)
{
    struct fl_imported_object object;
    if (!object_of(message, &object))
        return true;
    if (!make_room(imported, error))
        return false;
    struct fl_imported_object *place = place_of(imported, &object);
    imported->count += !place->is_there;
    object.digest = XXH3_64bits(frame->payload, frame->header.payload_bytes);
    *place = object;
    return true;
}

bool fl_imported_has(const struct fl_imported *imported, const struct frame *frame, const struct message *message)
{
    struct fl_imported_object object;
    if (imported->count == 0 || !object_of(message, &object))
        return false;
    const struct fl_imported_object *place = place_of(imported, &object);
    return place->is_there && place->digest == XXH3_64bits(frame->payload, frame->header.payload_bytes);
}

const struct fl_imported_object *fl_imported_gone(const struct fl_imported *now, const struct fl_imported *before,
                                                  size_t *cursor)
{
    while (*cursor < before->capacity) {
        const struct fl_imported_object *object = &before->places[(*cursor)++];
        if (object->is_there && (now->count == 0 || !place_of(now, object)->is_there))
            return object;
    }
    return NULL;
}

void fl_imported_finish(struct fl_imported *imported)
{
    free(imported->places);
    *imported = (struct fl_imported){0};
}
