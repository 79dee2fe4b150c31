/* SPDX-License-Identifier: MIT */
/* What an import has said of each object, as digests: the same model read again then tells what has changed. */
#ifndef FARLIGHT_CLIENT_LIB_IMPORTED_H
#define FARLIGHT_CLIENT_LIB_IMPORTED_H

#include "lib/farlight.h"
#include "protocol/framing.h"

struct fl_imported_object {
    uint32_t type, id; /* of the edit; type 0: an empty place */
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
/* Whether all objects of `before` are in `now`, whatever they are. */
bool fl_imported_covers(const struct fl_imported *now, const struct fl_imported *before);
void fl_imported_finish(struct fl_imported *imported);

#endif
