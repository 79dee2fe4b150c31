/* SPDX-License-Identifier: MIT */
/* Unique names of objects, from the names that people gave them. */
#ifndef FARLIGHT_CLIENT_LIB_NAMES_H
#define FARLIGHT_CLIENT_LIB_NAMES_H

#include "lib/farlight.h"

/* Makes a name for each object: its own; nodes that share a name are qualified by all nodes above, "car/wheel",
 * and where this is still ambiguous by their identifiers, "car/wheel#12". An object without a name is "#12".
 * Nodes that show nothing get NULL. `objects` ascend by id; fl_names_free frees *names and its strings. */
bool fl_names_make(const struct fl_object *objects, size_t count, enum protocol_object_kind kind, char ***names,
                   struct fl_error *error);
void fl_names_free(char **names, size_t count);

#endif
