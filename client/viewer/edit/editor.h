/* SPDX-License-Identifier: MIT */
/* The object that is edited in the window: its panel, its changes, and what undoes them. */
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

#define EDIT_ROWS_MAX (HUD_EDIT_ROWS_MAX - 1) /* the first says which object it is */

/* The screen and the session are the owner's. */
struct editor {
    struct screen *screen;
    struct session *session; /* the shown one */
    struct edit_choice choice;
    uint32_t picked;           /* node; that of the choice is it, or one above it */
    struct fl_object *objects; /* of the tab's kind; NULL: not asked for yet */
    size_t object_count;
    bool has_state;
    bool has_display_values; /* colours are a display's */
    struct fl_object_state state;
    struct edit_row rows[EDIT_ROWS_MAX];
    size_t row_count, chosen; /* 0: which object; else a row counted from 1 */
    double metre;             /* a step of a length */
    uint64_t read_ns, applied_ns;

    bool typing;
    char typed[24];
    /* The chosen row is dragged, on its slider or from a value on. */
    bool slides, drag_is_noted; /* the history has what undoes the drag */
    double drag_x, drag_from;
    double pending;     /* a value that the daemon is not told yet .. */
    size_t pending_row; /* .. and its row, counted from 0 */

    /* What the daemon is told of in a thread, as an edit waits for the frame that is being made: until it is done
     * the connection is the thread's. */
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
void editor_toggle(struct editor *edit); /* the panel */
void editor_undo(struct editor *edit, bool redo);
/* True: the input was meant for the panel. Not while the help hides it. */
bool editor_input(struct editor *edit, const struct input *input);
void editor_step(struct editor *edit, uint64_t now_ns);
/* Whether the connection is in use by an edit; `wait`: until it is not. */
bool editor_works(struct editor *edit, bool wait);
bool editor_must_wait(const struct editor *edit); /* it is in use by that, or by a file that is read again */
void editor_forget(struct editor *edit);          /* of a scene that is gone */
/* Its files have changed: they are the same scene, or another one, of which nothing is chosen yet. */
void editor_read_again(struct editor *edit, bool is_same);
const struct hud_edit *editor_hud(struct editor *edit);

/* ---- from input to it: nothing happens while it must wait ---- */

void editor_choose_tab(struct editor *edit, size_t tab);
void editor_choose_node_of_light(struct editor *edit);
/* The chosen row, by so many steps; in the first one another object. */
void editor_turn(struct editor *edit, double steps);
/* A row counted from 0 gets a value. `more`: of a drag, which is undone as one change. */
void editor_apply(struct editor *edit, size_t row, double value, bool more);
void editor_stop_typing(struct editor *edit);
bool editor_has_field(const struct editor *edit); /* the chosen row is one */

#endif
