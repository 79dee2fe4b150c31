/* SPDX-License-Identifier: MIT */
/* The names of an import's objects, and looking them up. */
#include "lib/catalogue.h"
#include "lib/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Limits for hostile models: 12 MiB of each list, 32 MiB of names, 9 MiB of clips. */
#define ENTRIES_MAX (1u << 20)
#define TEXT_BYTES_MAX (32u << 20)
#define CLIPS_MAX 65536u
#define ITEMS_MAX (16u << 20)

bool fl_grow(void **items, size_t *capacity, size_t count, size_t item_bytes, struct fl_error *error)
{
    if (count < *capacity)
        return true;
    const size_t more = *capacity > 0 ? *capacity * 2 : 16;
    void *grown = more <= ITEMS_MAX ? realloc(*items, more * item_bytes) : NULL;
    if (!grown)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    *items = grown;
    *capacity = more;
    return true;
}

/* ---- remembering ---- */

/* The offset of the stored name; 0, the empty name, if the limit is reached. */
static bool keep_text(struct fl_catalogue *catalogue, const char *name, uint32_t *place, struct fl_error *error)
{
    const size_t length = strlen(name) + 1;
    *place = 0;
    if (catalogue->text_bytes > 0 && (length == 1 || length > TEXT_BYTES_MAX - catalogue->text_bytes))
        return true;
    const size_t begin = catalogue->text_bytes > 0 ? catalogue->text_bytes : 1;
    if (begin + length > catalogue->text_capacity) {
        const size_t capacity =
            catalogue->text_capacity * 2 > begin + length ? catalogue->text_capacity * 2 : 4096 + length;
        char *grown = realloc(catalogue->text, capacity);
        if (!grown)
            return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        catalogue->text = grown;
        catalogue->text_capacity = capacity;
    }
    catalogue->text[0] = '\0';
    memcpy(catalogue->text + begin, name, length);
    catalogue->text_bytes = begin + length;
    *place = (uint32_t)begin;
    return true;
}

static bool keep(struct fl_catalogue *catalogue, enum fl_catalogue_list list, struct fl_catalogue_entry entry,
                 const char *name, struct fl_error *error)
{
    if (catalogue->lists[list].count >= ENTRIES_MAX) {
        catalogue->lists[list].left_out++;
        return true;
    }
    if (!fl_grow((void **)&catalogue->lists[list].entries, &catalogue->lists[list].capacity,
                 catalogue->lists[list].count, sizeof(entry), error) ||
        !keep_text(catalogue, name, &entry.name, error))
        return false;
    catalogue->lists[list].entries[catalogue->lists[list].count++] = entry;
    return true;
}

static bool keep_clip(struct fl_catalogue *catalogue, const struct message_import_clip *clip,
                      struct fl_error *error)
{
    if (catalogue->clip_count >= CLIPS_MAX)
        return true;
    if (!fl_grow((void **)&catalogue->clips, &catalogue->clip_capacity, catalogue->clip_count,
                 sizeof(*catalogue->clips), error))
        return false;
    struct fl_clip_info *made = &catalogue->clips[catalogue->clip_count++];
    *made = (struct fl_clip_info){.clip = clip->clip, .channels = clip->channels, .duration_s = clip->duration_s};
    snprintf(made->name, sizeof(made->name), "%s", clip->name);
    return true;
}

static bool count_id(struct fl_catalogue *catalogue, enum protocol_object_kind kind, uint32_t id)
{
    if (id > catalogue->max_id[kind])
        catalogue->max_id[kind] = id;
    return true;
}

static bool observe_node(struct fl_catalogue *catalogue, const struct message_set_node *node,
                         struct fl_error *error)
{
    count_id(catalogue, PROTOCOL_OBJECT_NODE, node->node);
    return keep(catalogue, FL_CATALOGUE_NODES, (struct fl_catalogue_entry){.id = node->node}, node->name, error) &&
           (node->value.kind != PROTOCOL_NODE_LIGHT || node->name[0] == '\0' ||
            keep(catalogue, FL_CATALOGUE_LIGHT_NODES, (struct fl_catalogue_entry){.id = node->value.object},
                 node->name, error));
}

static bool observe_light(struct fl_catalogue *catalogue, const struct message_set_light *light,
                          struct fl_error *error)
{
    const bool has_size =
        light->value.kind == PROTOCOL_LIGHT_RECTANGLE || light->value.kind == PROTOCOL_LIGHT_SPHERE;
    count_id(catalogue, PROTOCOL_OBJECT_LIGHT, light->light);
    return keep(catalogue, FL_CATALOGUE_LIGHTS,
                (struct fl_catalogue_entry){.id = light->light, .has_size = has_size}, light->name, error);
}

bool fl_catalogue_observe(struct fl_catalogue *catalogue, const struct message *message, struct fl_error *error)
{
    catalogue->is_lit |= message->type == MESSAGE_SET_LIGHT || message->type == MESSAGE_SET_ENVIRONMENT;
    switch (message->type) {
    case MESSAGE_SET_NODE:
        return observe_node(catalogue, &message->set_node, error);
    case MESSAGE_SET_MATERIAL:
        return count_id(catalogue, PROTOCOL_OBJECT_MATERIAL, message->set_material.material) &&
               keep(catalogue, FL_CATALOGUE_MATERIALS,
                    (struct fl_catalogue_entry){.id = message->set_material.material}, message->set_material.name,
                    error);
    case MESSAGE_SET_LIGHT:
        return observe_light(catalogue, &message->set_light, error);
    case MESSAGE_SET_MESH:
        return count_id(catalogue, PROTOCOL_OBJECT_MESH, message->set_mesh.mesh);
    case MESSAGE_SET_SPHERES:
        return count_id(catalogue, PROTOCOL_OBJECT_SPHERES, message->set_spheres.spheres);
    case MESSAGE_SET_DISC:
        return count_id(catalogue, PROTOCOL_OBJECT_DISC, message->set_disc.disc);
    case MESSAGE_SET_TEXTURE:
        return count_id(catalogue, PROTOCOL_OBJECT_TEXTURE, message->set_texture.texture);
    case MESSAGE_SET_CAMERA:
        return count_id(catalogue, PROTOCOL_OBJECT_CAMERA, message->set_camera.camera);
    case MESSAGE_SET_SKIN:
        return count_id(catalogue, PROTOCOL_OBJECT_SKIN, message->set_skin.skin);
    case MESSAGE_SET_CLIP:
        return count_id(catalogue, PROTOCOL_OBJECT_CLIP, message->set_clip.clip);
    case MESSAGE_SET_CHANNEL:
        return count_id(catalogue, PROTOCOL_OBJECT_CHANNEL, message->set_channel.channel);
    case MESSAGE_IMPORT_CLIP:
        return keep_clip(catalogue, &message->import_clip, error);
    default:
        return true;
    }
}

void fl_catalogue_finish(struct fl_catalogue *catalogue)
{
    for (int i = 0; i < FL_CATALOGUE_LIST_COUNT; i++)
        free(catalogue->lists[i].entries);
    free(catalogue->text);
    free(catalogue->clips);
    *catalogue = (struct fl_catalogue){0};
}

/* ---- finding ---- */

void fl_listing_begin(struct fl_listing *listing, size_t count, const char *what)
{
    *listing = (struct fl_listing){.used = 0};
    if (count == 0)
        listing->used = (size_t)snprintf(listing->text, sizeof(listing->text), "it has no %s at all", what);
    else
        listing->used = (size_t)snprintf(listing->text, sizeof(listing->text), "it has %zu %s%s", count, what,
                                         count == 1 ? "" : "s");
}

void fl_listing_add(struct fl_listing *listing, const char *name)
{
    const size_t room = sizeof(listing->text) - sizeof ", .." - listing->used;
    char entry[160];
    const int length = snprintf(entry, sizeof(entry), "%s '%s'", listing->listed == 0 ? ":" : ",", name);
    if (name[0] == '\0' || room > sizeof(listing->text))
        return;
    if (length < 0 || (size_t)length >= sizeof(entry) || (size_t)length > room) {
        memcpy(listing->text + listing->used, ", ..", sizeof ", ..");
        listing->used = sizeof(listing->text); /* full */
        return;
    }
    memcpy(listing->text + listing->used, entry, (size_t)length + 1);
    listing->used += (size_t)length;
    listing->listed++;
}

bool fl_listing_is_full(const struct fl_listing *listing)
{
    return listing->used >= sizeof(listing->text);
}

static const char *entry_name(const struct fl_catalogue *catalogue, enum fl_catalogue_list list, size_t i)
{
    const uint32_t name = catalogue->lists[list].entries[i].name;
    return name > 0 ? catalogue->text + name : "";
}

static bool find_name(const struct fl_catalogue *catalogue, enum fl_catalogue_list list, const char *which,
                      uint32_t *id)
{
    for (size_t i = 0; which[0] != '\0' && i < catalogue->lists[list].count; i++)
        if (strcmp(entry_name(catalogue, list, i), which) == 0) {
            *id = catalogue->lists[list].entries[i].id;
            return true;
        }
    return false;
}

static bool unknown_object(const struct fl_catalogue *catalogue, enum fl_catalogue_list list, const char *what,
                           const char *which, struct fl_error *error)
{
    struct fl_listing listing;
    fl_listing_begin(&listing, catalogue->lists[list].count, what);
    for (size_t i = 0; i < catalogue->lists[list].count && !fl_listing_is_full(&listing); i++)
        fl_listing_add(&listing, entry_name(catalogue, list, i));
    fl_error_set(error, FL_ERROR_ARGUMENT, what, "the model has no %s '%s'", what, which);
    if (catalogue->lists[list].left_out > 0)
        return fl_error_remedy(error, "only its first %zu %ss can be named", catalogue->lists[list].count, what);
    return fl_error_remedy(error, "%s", listing.text);
}

bool fl_catalogue_find(const struct fl_catalogue *catalogue, enum protocol_object_kind kind, const char *which,
                       uint32_t *id, struct fl_error *error)
{
    const enum fl_catalogue_list list = kind == PROTOCOL_OBJECT_NODE       ? FL_CATALOGUE_NODES
                                        : kind == PROTOCOL_OBJECT_MATERIAL ? FL_CATALOGUE_MATERIALS
                                        : kind == PROTOCOL_OBJECT_LIGHT    ? FL_CATALOGUE_LIGHTS
                                                                           : FL_CATALOGUE_LIST_COUNT;
    if (list == FL_CATALOGUE_LIST_COUNT)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "objects of this kind have no names");
    uint64_t index = 0;
    if (find_name(catalogue, list, which, id) ||
        (list == FL_CATALOGUE_LIGHTS && find_name(catalogue, FL_CATALOGUE_LIGHT_NODES, which, id)))
        return true;
    if (catalogue->lists[list].count > 0 &&
        fl_text_integer(which, 0, catalogue->lists[list].count - 1, &index, NULL)) {
        *id = catalogue->lists[list].entries[index].id;
        return true;
    }
    return unknown_object(catalogue, list, protocol_object_kind_text(kind), which, error);
}

bool fl_catalogue_light_has_size(const struct fl_catalogue *catalogue, uint32_t light)
{
    for (size_t i = 0; i < catalogue->lists[FL_CATALOGUE_LIGHTS].count; i++)
        if (catalogue->lists[FL_CATALOGUE_LIGHTS].entries[i].id == light)
            return catalogue->lists[FL_CATALOGUE_LIGHTS].entries[i].has_size;
    return false;
}

static const struct fl_clip_info *search_clip(const struct fl_catalogue *catalogue, const char *which)
{
    uint64_t index = 0;
    for (size_t i = 0; which[0] != '\0' && i < catalogue->clip_count; i++)
        if (strcmp(catalogue->clips[i].name, which) == 0)
            return &catalogue->clips[i];
    if (catalogue->clip_count > 0 && fl_text_integer(which, 0, catalogue->clip_count - 1, &index, NULL))
        return &catalogue->clips[index];
    return NULL;
}

bool fl_catalogue_find_clip(const struct fl_catalogue *catalogue, const char *which, uint32_t *clip,
                            const struct fl_clip_info **info, struct fl_error *error)
{
    const struct fl_clip_info *found = search_clip(catalogue, which);
    if (!found) {
        struct fl_listing listing;
        fl_listing_begin(&listing, catalogue->clip_count, "clip");
        for (size_t i = 0; i < catalogue->clip_count && !fl_listing_is_full(&listing); i++)
            fl_listing_add(&listing, catalogue->clips[i].name);
        fl_error_set(error, FL_ERROR_ARGUMENT, "--clip", "the model has no clip '%s'", which);
        return fl_error_remedy(error, "%s", listing.text);
    }
    if (found->clip == 0)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "--clip", "clip '%s' moves nothing in the scene", which);
    *clip = found->clip;
    if (info)
        *info = found;
    return true;
}

uint32_t fl_catalogue_new_id(struct fl_catalogue *catalogue, enum protocol_object_kind kind)
{
    if ((unsigned)kind >= PROTOCOL_OBJECT_COUNT || catalogue->max_id[kind] == UINT32_MAX)
        return 0;
    return ++catalogue->max_id[kind];
}
