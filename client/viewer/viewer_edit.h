/* SPDX-License-Identifier: MIT */
/* The object that is edited in the window: its panel, its changes, and what undoes them. */
#ifndef FARLIGHT_CLIENT_VIEWER_VIEWER_EDIT_H
#define FARLIGHT_CLIENT_VIEWER_VIEWER_EDIT_H

#include "options/edit_history.h"
#include "viewer/edit/rows.h"
#include "viewer/input/controls.h"

#include <pthread.h>
#include <stdatomic.h>

struct session;
struct viewer;

enum viewer_edit_tab { EDIT_NODE, EDIT_MATERIAL, EDIT_LIGHT, EDIT_ENVIRONMENT, EDIT_TABS };
#define EDIT_ROWS_MAX (HUD_EDIT_ROWS_MAX - 1) /* the first says which object it is */

/* The object that is edited. */
struct viewer_edit {
    bool shown;
    size_t tab;
    uint32_t picked;           /* node; that of `ids` is it, or one above it */
    uint32_t ids[EDIT_TABS];   /* 0: none */
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
    bool dragging, slides, drag_is_noted; /* the history has what undoes the drag */
    double drag_x, drag_from;
    bool has_pending;
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
void viewer_edit_object(struct viewer *viewer, uint32_t node, uint32_t material);
void viewer_edit_toggle(struct viewer *viewer); /* the panel */
void viewer_edit_undo(struct viewer *viewer, bool redo);
/* True: the input was meant for the panel. */
bool viewer_edit_input(struct viewer *viewer, const struct input *input);
void viewer_step_edit(struct viewer *viewer, uint64_t now_ns);
/* Whether the connection is in use by an edit; `wait`: until it is not. */
bool viewer_edit_works(struct viewer *viewer, bool wait);
bool viewer_edit_must_wait(
    const struct viewer *viewer);               /* it is in use by that, or by a file that is read again */
void viewer_edit_forget(struct viewer *viewer); /* of a scene that is gone */
/* Its files have changed: they are the same scene, or another one, of which nothing is chosen yet. */
void viewer_edit_read_again(struct viewer *viewer, bool is_same);
const struct hud_edit *viewer_edit_hud(struct viewer *viewer);

/* ---- from input to it: nothing happens while it must wait ---- */

void viewer_edit_choose_tab(struct viewer *viewer, size_t tab);
void viewer_edit_choose_node_of_light(struct viewer *viewer);
/* The chosen row, by so many steps; in the first one another object. */
void viewer_edit_step(struct viewer *viewer, double steps);
/* A row counted from 0 gets a value. `more`: of a drag, which is undone as one change. */
void viewer_edit_apply(struct viewer *viewer, size_t row, double value, bool more);
void viewer_edit_stop_typing(struct viewer_edit *edit);
bool viewer_edit_has_field(const struct viewer_edit *edit); /* the chosen row is one */

#endif
