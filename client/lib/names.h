/* SPDX-License-Identifier: MIT */
/* Names of objects that differ, from those that people gave them. */
#ifndef FARLIGHT_CLIENT_LIB_NAMES_H
#define FARLIGHT_CLIENT_LIB_NAMES_H

#include "lib/farlight.h"

/* The name of each object: its own; of nodes that share one those of all above it, too, "car/wheel"; the
 * identifiers of those that share that as well behind it, "car/wheel#12". An object without a name is "#12". Nodes
 * that show nothing have none: NULL. `objects` ascend by id; *names and what it points to are for fl_names_free.
 */
bool fl_names_make(const struct fl_object *objects, size_t count, enum protocol_object_kind kind, char ***names,
                   struct fl_error *error);
void fl_names_free(char **names, size_t count);

#endif
