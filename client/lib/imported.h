/* SPDX-License-Identifier: MIT */
/* What an import has said of each object, as digests: the same model read again then tells what has changed. */
#ifndef FARLIGHT_CLIENT_LIB_IMPORTED_H
#define FARLIGHT_CLIENT_LIB_IMPORTED_H

#include "lib/farlight.h"
#include "protocol/framing.h"

struct fl_imported_object {
    bool is_there; /* else the place is empty */
    enum protocol_object_kind kind;
    uint32_t id; /* 0 of an environment */
    uint64_t digest;
};

struct fl_imported {
    struct fl_imported_object *places; /* a hash table, of a power of two; NULL: none */
    size_t count, capacity;
};

/* Takes an edit that sets an object, and passes other messages over; what the object was before is forgotten. */
bool fl_imported_add(struct fl_imported *imported, const struct frame *frame, const struct message *message,
                     struct fl_error *error);
/* Whether the edit would change nothing. */
bool fl_imported_has(const struct fl_imported *imported, const struct frame *frame, const struct message *message);
/* The next object of `before`, from *cursor on, 0 at first, that is not in `now`, whatever it was; NULL: no more.
 */
const struct fl_imported_object *fl_imported_gone(const struct fl_imported *now, const struct fl_imported *before,
                                                  size_t *cursor);
/* A digest of all objects that the scene's import has made, of what they are and hold, if it was remembered
 * (fl_load_options.will_reload): the same on any host, whatever came first. */
uint64_t fl_scene_import_digest(const struct fl_scene *scene);
void fl_imported_finish(struct fl_imported *imported);

#endif
