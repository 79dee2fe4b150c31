/* SPDX-License-Identifier: MIT */
/* What was changed here, to undo and redo it: lists of assignments that bring fields back. Independent of window
 * and daemon. */
#ifndef FARLIGHT_OPTIONS_EDIT_HISTORY_H
#define FARLIGHT_OPTIONS_EDIT_HISTORY_H

#include "lib/farlight.h"

#define EDIT_HISTORY_MAX 256u /* older ones are forgotten */

struct edit_change {
    struct fl_assignment *list; /* malloc'ed */
    size_t count;
};

/* All zero at first. */
struct edit_history {
    struct edit_change undo[EDIT_HISTORY_MAX], redo[EDIT_HISTORY_MAX]; /* the last one is the newest */
    size_t undo_count, redo_count;
};

/* What undoes a change that was made; there is nothing to redo any more. The history takes the list over. */
void edit_history_add(struct edit_history *history, struct fl_assignment *list, size_t count);
/* The newest to undo or redo, which is the caller's then; false: there is none. */
bool edit_history_take(struct edit_history *history, bool redo, struct edit_change *change);
/* What undoes a change that was taken, after `redo`, or redoes it. */
void edit_history_took(struct edit_history *history, bool redo, struct fl_assignment *list, size_t count);
void edit_history_clear(struct edit_history *history);

#endif
