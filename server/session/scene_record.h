/* SPDX-License-Identifier: MIT */
/* A scene as bytes: the messages by which a client would make it, preceded by its name and sharing. Blobs are
 * named by their hashes and stored separately. */
#ifndef FARLIGHT_SESSION_SCENE_RECORD_H
#define FARLIGHT_SESSION_SCENE_RECORD_H

#include "scene/scene.h"
#include "session/edits.h"
#include "store/store.h"

#include <stdatomic.h>

/* Fills content and blobs of the record. False: out of memory, or *abandoned was set; the record is to be finished
 * either way. */
bool scene_record_write(struct store_record *record, const struct scene *scene, enum sharing sharing,
                        const atomic_bool *abandoned);

/* Passes the message that would make the object of an edit (of kind set, without blobs) to take(). False: out of
 * memory. */
bool scene_record_object(const struct scene_edit *object,
                         void (*take)(void *context, const struct message *message), void *context);

/* A scene read by scene_record_read(). */
struct scene_record {
    uint64_t revision;
    enum sharing sharing; /* kept or shared */
    char name[SCENE_NAME_MAX + 1];
    struct scene_edit *edits; /* owned */
    size_t edit_count;
};
/* Reads any bytes, with the checks of a client's messages. False and *error: they are not a valid record. */
bool scene_record_read(struct scene_record *record, const uint8_t *content, size_t content_bytes,
                       const struct edit_source *source, struct error *error);
void scene_record_finish(struct scene_record *record);

#endif
