/* SPDX-License-Identifier: MIT */
/* The history of edits for undo and redo: lists of assignments that restore fields. Independent of window and
 * daemon. */
#ifndef FARLIGHT_OPTIONS_EDIT_HISTORY_H
#define FARLIGHT_OPTIONS_EDIT_HISTORY_H

#include "lib/farlight.h"

#define EDIT_HISTORY_MAX 256u /* limit; older changes are dropped */

struct edit_change {
    struct fl_assignment *list; /* malloc'ed */
    size_t count;
};

/* Two stacks; initially zero. */
struct edit_history {
    struct edit_change undo[EDIT_HISTORY_MAX], redo[EDIT_HISTORY_MAX]; /* the last one is the newest */
    size_t undo_count, redo_count;
};

/* Adds the assignments that undo a new change, and clears redo. The history takes the list over. */
void edit_history_add(struct edit_history *history, struct fl_assignment *list, size_t count);
/* Takes the newest change to undo or redo, which the caller then owns; false: there is none. */
bool edit_history_take(struct edit_history *history, bool redo, struct edit_change *change);
/* Adds the inverse of a change that was taken and applied: for undo after `redo`, else for redo. */
void edit_history_took(struct edit_history *history, bool redo, struct fl_assignment *list, size_t count);
void edit_history_clear(struct edit_history *history);

#endif
