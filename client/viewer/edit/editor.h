/* SPDX-License-Identifier: MIT */
/* Editor of the window: the chosen object, its panel, its changes, and their history. */
#ifndef FARLIGHT_VIEWER_EDIT_EDITOR_H
#define FARLIGHT_VIEWER_EDIT_EDITOR_H

#include "options/edit_history.h"
#include "rows.h"
#include "viewer/input/controls.h"
#include "viewer/overlay/screen.h"
#include "viewer/view/outline.h"
#include "viewer/view/session.h"

#include <pthread.h>
#include <stdatomic.h>

#define EDIT_ROWS_MAX (HUD_EDIT_ROWS_MAX - 1) /* the first row shows the object's name */

/* State of the editor, which owns neither the screen nor the session. */
struct editor {
    struct screen *screen;
    struct session *session; /* the shown one */
    struct edit_choice choice;
    uint32_t picked;           /* picked node: the chosen node or a descendant of it */
    struct fl_object *objects; /* objects of the tab's kind; NULL: not fetched yet */
    size_t object_count;
    bool has_state;
    bool has_display_values; /* colours are display values */
    struct fl_object_state state;
    struct edit_row rows[EDIT_ROWS_MAX];
    size_t row_count, chosen; /* 0: which object; else a row counted from 1 */
    double metre;             /* step of a length */
    uint64_t read_ns, applied_ns;

    bool typing;
    char typed[24];
    /* The chosen row is being dragged, on its slider or starting at a value. */
    bool slides, drag_is_noted; /* the history has the undo of this drag */
    double drag_x, drag_from;
    double pending;     /* value not yet sent to the daemon */
    size_t pending_row; /* row of that value, counted from 0 */

    /* Change being sent to the daemon. A thread sends it, since an edit waits for the frame in progress. The
     * thread has the connection until `done`. */
    bool works;
    struct edit_work {
        pthread_t thread;
        struct session *session;
        struct edit_change change;
        enum edit_way { EDIT_CHANGE, EDIT_DRAG_ON, EDIT_UNDO, EDIT_REDO } way;
        struct fl_edited edited;
        struct fl_error refusal;
        atomic_bool done;
    } work;
    struct edit_history history;
    struct hud_edit hud;
};

/* Shows the object in the panel. */
void editor_show(struct editor *edit, uint32_t node, uint32_t material);
void editor_toggle(struct editor *edit); /* Shows or hides the panel. */
void editor_undo(struct editor *edit, bool redo);
/* Returns true if the panel consumed the input, never while the help hides it. */
bool editor_input(struct editor *edit, const struct input *input);
void editor_step(struct editor *edit, uint64_t now_ns);
/* Returns whether an edit is using the connection. With `wait`, waits until none is. */
bool editor_works(struct editor *edit, bool wait);
bool editor_must_wait(const struct editor *edit); /* an edit or a reload of files is using the connection */
void editor_forget(struct editor *edit);          /* forgets everything about the previous scene */
/* Reads the object again after the scene's files have changed. Unless `is_same`, it is another scene and
 * nothing is chosen. */
void editor_read_again(struct editor *edit, bool is_same);
const struct hud_edit *editor_hud(struct editor *edit);

/* ---- called by editor_input.c; ignored while editor_must_wait() ---- */

void editor_choose_tab(struct editor *edit, size_t tab);
void editor_choose_node_of_light(struct editor *edit);
/* Changes the chosen row by this number of steps. The first row steps through the objects. */
void editor_turn(struct editor *edit, double steps);
/* Sets the value of a row, counted from 0. `more`: the change continues a drag, which is undone as one change. */
void editor_apply(struct editor *edit, size_t row, double value, bool more);
void editor_stop_typing(struct editor *edit);
bool editor_has_field(const struct editor *edit); /* the chosen row is a field */

#endif
