/* SPDX-License-Identifier: MIT */
/* The contents of a model: the importer runs as for a daemon, and is answered here. No bulk data is requested. */
#include "lib/boxes.h"
#include "lib/importer.h"
#include "lib/relay.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NOTES_MAX 1000u
#define VARIANTS_MAX 65536u

struct listing {
    struct fl_importer importer;
    struct fl_model_info *info;
    size_t note_capacity, variant_capacity;
    struct fl_relay relay; /* the rules that apply towards a daemon */
    uint64_t revision;
    struct fl_boxes boxes;
};

static bool add_note(struct listing *listing, const struct message_import_note *note, struct fl_error *error)
{
    struct fl_model_info *info = listing->info;
    if (info->note_count >= NOTES_MAX) {
        info->notes_left_out++;
        return true;
    }
    if (!fl_grow((void **)&info->notes, &listing->note_capacity, info->note_count, sizeof(*info->notes), error))
        return false;
    struct fl_model_note *made = &info->notes[info->note_count++];
    made->severity = note->severity;
    snprintf(made->where, sizeof(made->where), "%s", note->where);
    snprintf(made->text, sizeof(made->text), "%s", note->text);
    return true;
}

static bool add_variant(struct listing *listing, const struct message_import_variant *variant,
                        struct fl_error *error)
{
    struct fl_model_info *info = listing->info;
    if (info->variant_count >= VARIANTS_MAX)
        return true;
    if (!fl_grow((void **)&info->variants, &listing->variant_capacity, info->variant_count,
                 sizeof(*info->variants), error))
        return false;
    struct fl_variant_info *made = &info->variants[info->variant_count++];
    snprintf(made->name, sizeof(made->name), "%s", variant->name);
    return true;
}

static bool list(struct listing *listing, const struct message *message, struct fl_error *error)
{
    struct fl_model_info *info = listing->info;
    switch (message->type) {
    case MESSAGE_SET_NODE:
        info->nodes++;
        return fl_boxes_add_node(&listing->boxes, &message->set_node, error);
    case MESSAGE_IMPORT_BOUNDS:
        return fl_boxes_add(&listing->boxes, &message->import_bounds, error);
    case MESSAGE_SET_MESH:
        info->meshes++;
        info->closed_meshes += message->set_mesh.value.closed;
        info->triangles += message->set_mesh.value.triangle_count;
        info->morph_targets += message->set_mesh.value.target_count;
        break;
    case MESSAGE_SET_SKIN:
        info->skins++;
        info->joints += message->set_skin.value.joint_count;
        break;
    case MESSAGE_SET_SPHERES:
        info->sphere_sets++;
        info->spheres += message->set_spheres.value.sphere_count;
        break;
    case MESSAGE_SET_DISC:
        info->discs++;
        break;
    case MESSAGE_SET_MATERIAL:
        info->materials++;
        break;
    case MESSAGE_SET_TEXTURE:
        info->textures++;
        break;
    case MESSAGE_SET_LIGHT:
        info->lights++;
        break;
    case MESSAGE_IMPORT_VARIANT:
        return add_variant(listing, &message->import_variant, error);
    case MESSAGE_IMPORT_NOTE:
        return add_note(listing, &message->import_note, error);
    default:
        break;
    }
    return true;
}

/* Answers like a daemon that already has all blobs. */
static bool answer(struct listing *listing, const struct frame *frame, const struct message *message,
                   struct fl_error *error)
{
    struct message reply = {.type = MESSAGE_OK};
    if (message->type == MESSAGE_BLOB_OFFER) {
        for (uint32_t i = 0; i < message->blob_offer.blobs_count; i++)
            listing->importer.stats.offered_bytes += message->blob_offer.blobs[i].size_bytes;
        reply.type = MESSAGE_BLOB_NEED;
        reply.blob_need = (struct message_blob_need){0};
    } else if (message->type == MESSAGE_EDIT_COMMIT) {
        reply.ok.revision = ++listing->revision;
    } else {
        return true;
    }
    return fl_stream_push(&listing->importer.stream, frame->header.request, 0, &reply, error);
}

static bool drain(struct listing *listing, struct fl_error *error)
{
    while (fl_stream_has_room(&listing->importer.stream)) {
        struct frame frame;
        struct message message;
        uint32_t request = 0;
        const enum fl_stream_result result = fl_stream_next(&listing->importer.stream, &frame, &message, error);
        if (result != FL_STREAM_MESSAGE)
            return result == FL_STREAM_NOTHING;
        if (fl_relay_from_importer(&listing->relay, &frame.header, &message, &request, error) == FL_RELAY_REFUSE)
            return false;
        if (message.type == MESSAGE_BLOB_DATA)
            return fl_error_set(error, FL_ERROR_PROTOCOL, "farlight-import",
                                "the importer sent an unexpected message");
        if (!fl_importer_observe(&listing->importer, &message, error) || !list(listing, &message, error) ||
            !answer(listing, &frame, &message, error))
            return false;
    }
    return true;
}

static bool run(struct listing *listing, int interrupt_fd, struct fl_error *error)
{
    struct fl_importer *importer = &listing->importer;
    for (;;) {
        if (!drain(listing, error))
            return false;
        if (importer->done)
            return true;
        if (importer->stream.ended)
            return fl_importer_explain(importer, error);
        struct pollfd polled = {.fd = importer->stream.fd, .events = fl_stream_events(&importer->stream)};
        if (!fl_wait(&polled, 1, interrupt_fd, importer->deadline_ns, error)) {
            if (error->code == FL_ERROR_TIMEOUT)
                fl_error_set(error, FL_ERROR_TIMEOUT, fl_importer_name(importer), "the import timed out");
            return false;
        }
        if (!fl_stream_transfer(&importer->stream, error))
            return fl_importer_explain(importer, error);
    }
}

static bool list_names(const struct fl_catalogue *catalogue, enum fl_catalogue_list list,
                       struct fl_model_object **objects, size_t *count, struct fl_error *error)
{
    const struct fl_catalogue_entry *entries = catalogue->lists[list].entries;
    *count = catalogue->lists[list].count;
    *objects = calloc(*count + 1, sizeof(**objects));
    if (!*objects)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    for (size_t i = 0; i < *count; i++)
        (*objects)[i].name = catalogue->text + entries[i].name;
    return true;
}

/* Moves the names to the result. */
static bool list_objects(struct listing *listing, struct fl_error *error)
{
    struct fl_model_info *info = listing->info;
    struct fl_catalogue *catalogue = &listing->importer.catalogue;
    const bool listed =
        list_names(catalogue, FL_CATALOGUE_NODES, &info->node_list, &info->node_list_count, error) &&
        list_names(catalogue, FL_CATALOGUE_MATERIALS, &info->material_list, &info->material_list_count, error) &&
        list_names(catalogue, FL_CATALOGUE_LIGHTS, &info->light_list, &info->light_list_count, error);
    info->names = catalogue->text;
    catalogue->text = NULL;
    return listed && fl_boxes_place(&listing->boxes, info, error);
}

struct fl_model_info *fl_model_info(const struct fl_load_options *options, int interrupt_fd,
                                    struct fl_error *error)
{
    struct fl_load_options quiet = *options;
    quiet.note = NULL; /* the notes are in the result */
    struct listing listing = {.relay = {.scene = 1}, .info = calloc(1, sizeof(*listing.info))};
    if (!listing.info) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    if (!fl_importer_start(&listing.importer, &quiet, error)) {
        fl_model_info_destroy(listing.info);
        return NULL;
    }
    const bool complete = run(&listing, interrupt_fd, error) && list_objects(&listing, error);
    fl_boxes_finish(&listing.boxes);
    fl_importer_stop(&listing.importer);
    listing.info->import = listing.importer.stats;
    listing.info->cameras = listing.importer.cameras;
    listing.info->camera_count = listing.importer.camera_count;
    listing.importer.cameras = NULL;
    listing.importer.camera_count = 0;
    listing.info->clips = listing.importer.catalogue.clips;
    listing.info->clip_count = listing.importer.catalogue.clip_count;
    listing.importer.catalogue.clips = NULL;
    fl_importer_finish(&listing.importer);
    if (complete)
        return listing.info;
    fl_model_info_destroy(listing.info);
    return NULL;
}

void fl_model_info_destroy(struct fl_model_info *info)
{
    if (!info)
        return;
    free(info->cameras);
    free(info->clips);
    free(info->notes);
    free(info->variants);
    free(info->node_list);
    free(info->material_list);
    free(info->light_list);
    free(info->names);
    free(info);
}
