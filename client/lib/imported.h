/* SPDX-License-Identifier: MIT */
/* Digests of an import's edits, one per object: reading the same model again then shows which objects have
 * changed. */
#ifndef FARLIGHT_CLIENT_LIB_IMPORTED_H
#define FARLIGHT_CLIENT_LIB_IMPORTED_H

#include "lib/farlight.h"
#include "protocol/framing.h"

struct fl_imported_object {
    bool is_there; /* false: an empty place of the table */
    enum protocol_object_kind kind;
    uint32_t id; /* 0 for an environment */
    uint64_t digest;
};

struct fl_imported {
    struct fl_imported_object *places; /* a hash table, of a power of two; NULL: none */
    size_t count, capacity;
};

/* Records an edit that sets an object, in place of an earlier one; other messages are ignored. False: no
 * memory. */
bool fl_imported_add(struct fl_imported *imported, const struct frame *frame, const struct message *message,
                     struct fl_error *error);
/* True if the edit would change nothing. */
bool fl_imported_has(const struct fl_imported *imported, const struct frame *frame, const struct message *message);
/* The next object of `before`, from *cursor (0 at first), that is missing in `now`; NULL: no more. */
const struct fl_imported_object *fl_imported_gone(const struct fl_imported *now, const struct fl_imported *before,
                                                  size_t *cursor);
/* A digest of all objects of the scene's import and their contents, if they were recorded
 * (fl_load_options.will_reload). It is the same on every host and after any history. */
uint64_t fl_scene_import_digest(const struct fl_scene *scene);
void fl_imported_finish(struct fl_imported *imported);

#endif
