/* SPDX-License-Identifier: MIT */
#include "lib/imported.h"

#include <stdlib.h>
#include <xxhash.h>

/* False: no edit that sets an object. An environment has no identifier, as there is one. */
static bool object_of(const struct message *message, uint32_t *id)
{
    *id = 0;
    switch (message->type) {
    case MESSAGE_SET_NODE:
        *id = message->set_node.node;
        return true;
    case MESSAGE_SET_MESH:
        *id = message->set_mesh.mesh;
        return true;
    case MESSAGE_SET_SPHERES:
        *id = message->set_spheres.spheres;
        return true;
    case MESSAGE_SET_DISC:
        *id = message->set_disc.disc;
        return true;
    case MESSAGE_SET_MATERIAL:
        *id = message->set_material.material;
        return true;
    case MESSAGE_SET_TEXTURE:
        *id = message->set_texture.texture;
        return true;
    case MESSAGE_SET_LIGHT:
        *id = message->set_light.light;
        return true;
    case MESSAGE_SET_CAMERA:
        *id = message->set_camera.camera;
        return true;
    case MESSAGE_SET_SKIN:
        *id = message->set_skin.skin;
        return true;
    case MESSAGE_SET_CLIP:
        *id = message->set_clip.clip;
        return true;
    case MESSAGE_SET_CHANNEL:
        *id = message->set_channel.channel;
        return true;
    case MESSAGE_SET_ENVIRONMENT:
        return true;
    default:
        return false;
    }
}

/* The object's place, or the empty one where it belongs; one of four places is always empty. */
static struct fl_imported_object *place_of(const struct fl_imported *imported, uint32_t type, uint32_t id)
{
    const uint64_t key = (uint64_t)type << 32 | id;
    size_t at = (size_t)XXH3_64bits(&key, sizeof(key)) & (imported->capacity - 1);
    while (imported->places[at].type != 0 && (imported->places[at].type != type || imported->places[at].id != id))
        at = (at + 1) & (imported->capacity - 1);
    return &imported->places[at];
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
        if (imported->places[i].type != 0)
            *place_of(&grown, imported->places[i].type, imported->places[i].id) = imported->places[i];
    free(imported->places);
    *imported = grown;
    return true;
}

bool fl_imported_add(struct fl_imported *imported, const struct frame *frame, const struct message *message,
                     struct fl_error *error)
{
    uint32_t id;
    if (!object_of(message, &id))
        return true;
    if (!make_room(imported, error))
        return false;
    struct fl_imported_object *place = place_of(imported, message->type, id);
    imported->count += place->type == 0;
    *place = (struct fl_imported_object){
        .type = message->type, .id = id, .digest = XXH3_64bits(frame->payload, frame->header.payload_bytes)};
    return true;
}

bool fl_imported_has(const struct fl_imported *imported, const struct frame *frame, const struct message *message)
{
    uint32_t id;
    if (imported->count == 0 || !object_of(message, &id))
        return false;
    const struct fl_imported_object *place = place_of(imported, message->type, id);
    return place->type != 0 && place->digest == XXH3_64bits(frame->payload, frame->header.payload_bytes);
}

bool fl_imported_covers(const struct fl_imported *now, const struct fl_imported *before)
{
    for (size_t i = 0; i < before->capacity; i++)
        if (before->places[i].type != 0 &&
            (now->count == 0 || place_of(now, before->places[i].type, before->places[i].id)->type == 0))
            return false;
    return true;
}

void fl_imported_finish(struct fl_imported *imported)
{
    free(imported->places);
    *imported = (struct fl_imported){0};
}
