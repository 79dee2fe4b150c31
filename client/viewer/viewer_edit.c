/* SPDX-License-Identifier: MIT */
/* Edits the scene: the object that was picked, its fields in a panel, and their changes to the daemon. What others
 * change is read again. */
#include "viewer/viewer_edit.h"
#include "viewer/viewer_state.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define APPLY_PAUSE_NS 40000000ull /* between changes of a drag: the newest counts */
#define READ_PAUSE_NS 200000000ull /* between looks at what others change */
#define METRES_OF_EXTENT 0.01      /* a step of a length */

static const enum protocol_object_kind kinds[EDIT_TABS] = {PROTOCOL_OBJECT_NODE, PROTOCOL_OBJECT_MATERIAL,
                                                           PROTOCOL_OBJECT_LIGHT, PROTOCOL_OBJECT_ENVIRONMENT};
static const char *const tab_names[EDIT_TABS] = {"node", "material", "light", "environment"};

static void say(struct viewer *viewer, const struct fl_error *refusal)
{
    if (refusal->code != FL_ERROR_NONE) /* else the connection is lost */
        viewer_say(viewer, "not possible: %s", refusal->text);
}

/* ---- what is edited ---- */

static void forget_objects(struct viewer_edit *edit)
{
    free(edit->objects);
    edit->objects = NULL;
    edit->object_count = 0;
}

static bool list_objects(struct viewer *viewer)
{
    struct viewer_edit *edit = &viewer->edit;
    struct fl_error refusal = {0};
    if (edit->objects)
        return true;
    if (session_objects(viewer->session, kinds[edit->tab], &edit->objects, &edit->object_count, &refusal))
        return true;
    say(viewer, &refusal);
    return false;
}

static size_t index_of(const struct viewer_edit *edit)
{
    for (size_t i = 0; i < edit->object_count; i++)
        if (edit->objects[i].id == edit->ids[edit->tab])
            return i;
    return 0;
}

/* Whether colours are a display's values, which the environment says. */
static void ask_for_colours(struct viewer *viewer)
{
    struct viewer_edit *edit = &viewer->edit;
    struct fl_error refusal = {0};
    edit->has_display_values = false;
    if (!session_read(viewer->session, PROTOCOL_OBJECT_ENVIRONMENT, 1, &edit->state, &refusal))
        return;
    for (size_t i = 0; i < edit->state.count; i++)
        if (strcmp(edit->state.fields[i].field.name, "display_values") == 0)
            edit->has_display_values = edit->state.fields[i].values[0] > 0;
}

/* A length that is a step in the scene. */
static void measure(struct viewer *viewer)
{
    struct fl_scene_bounds bounds;
    struct fl_error ignored;
    double extent = 0;
    if (fl_scene_get_bounds(session_scene(viewer->session), &bounds, &ignored) && !bounds.empty)
        for (int i = 0; i < 3; i++)
            extent = extent > (double)(bounds.upper_world[i] - bounds.lower_world[i])
                         ? extent
                         : (double)(bounds.upper_world[i] - bounds.lower_world[i]);
    viewer->edit.metre = extent > 0 ? extent * METRES_OF_EXTENT : METRES_OF_EXTENT;
}

static void read_object(struct viewer *viewer)
{
    struct viewer_edit *edit = &viewer->edit;
    struct fl_error refusal = {0};
    const uint32_t id = edit->ids[edit->tab];
    edit->read_ns = monotonic_now_ns();
    viewer->must_draw = true;
    edit->has_state = id != 0 && session_read(viewer->session, kinds[edit->tab], id, &edit->state, &refusal);
    edit->row_count = edit->has_state ? edit_rows(&edit->state, edit->rows, EDIT_ROWS_MAX) : 0;
    if (edit->chosen > edit->row_count)
        edit->chosen = 0;
    if (id == 0 || edit->has_state || refusal.code == FL_ERROR_NONE)
        return;
    say(viewer, &refusal); /* another client has removed it */
    edit->ids[edit->tab] = 0;
}

void viewer_edit_stop_typing(struct viewer_edit *edit)
{
    edit->typing = edit->dragging = edit->has_pending = false;
    edit->typed[0] = '\0';
}

void viewer_edit_choose_tab(struct viewer *viewer, size_t tab)
{
    struct viewer_edit *edit = &viewer->edit;
    if (viewer_edit_must_wait(viewer))
        return;
    viewer_edit_stop_typing(edit);
    edit->tab = tab % EDIT_TABS;
    edit->chosen = 0;
    forget_objects(edit);
    ask_for_colours(viewer);
    /* What cannot be picked: the first one is there to begin with. */
    if (edit->tab >= EDIT_LIGHT && edit->ids[edit->tab] == 0 && list_objects(viewer) && edit->object_count > 0)
        edit->ids[edit->tab] = edit->objects[0].id;
    read_object(viewer);
}

void viewer_edit_object(struct viewer *viewer, uint32_t node, uint32_t material)
{
    struct viewer_edit *edit = &viewer->edit;
    edit->picked = edit->ids[EDIT_NODE] = node;
    edit->ids[EDIT_MATERIAL] = material;
    edit->shown = true;
    measure(viewer);
    viewer_edit_choose_tab(viewer, edit->tab < EDIT_LIGHT && edit->ids[edit->tab] != 0 ? edit->tab
                                   : material != 0                                     ? EDIT_MATERIAL
                                                                                       : EDIT_NODE);
}

void viewer_edit_read_again(struct viewer *viewer, bool is_same)
{
    struct viewer_edit *edit = &viewer->edit;
    forget_objects(edit);
    if (!is_same) {
        edit_history_clear(&edit->history);
        memset(edit->ids, 0, sizeof(edit->ids));
        edit->picked = 0;
        edit->has_state = false;
        viewer_edit_stop_typing(edit);
    }
    if (edit->shown && is_same)
        read_object(viewer);
    else if (edit->shown)
        viewer_edit_choose_tab(viewer, edit->tab);
}

void viewer_edit_forget(struct viewer *viewer)
{
    viewer_edit_works(viewer, true);
    forget_objects(&viewer->edit);
    edit_history_clear(&viewer->edit.history);
    viewer->edit = (struct viewer_edit){.tab = EDIT_MATERIAL};
}

/* ---- another object ---- */

/* Up the hierarchy, and back down to what was picked. */
static void choose_node(struct viewer *viewer, bool up)
{
    struct viewer_edit *edit = &viewer->edit;
    struct fl_error refusal = {0};
    struct fl_object object;
    uint32_t id = up ? edit->ids[EDIT_NODE] : edit->picked;
    for (unsigned i = 0; id != 0 && i < 1000; i++) {
        if (!session_object(viewer->session, PROTOCOL_OBJECT_NODE, id, &object, &refusal)) {
            say(viewer, &refusal);
            return;
        }
        if (up ? object.parent != 0 : object.parent == edit->ids[EDIT_NODE]) {
            edit->ids[EDIT_NODE] = up ? object.parent : id;
            break;
        }
        id = up ? 0 : object.parent;
    }
    read_object(viewer);
}

static void choose_object(struct viewer *viewer, int step)
{
    struct viewer_edit *edit = &viewer->edit;
    if (edit->tab == EDIT_NODE) {
        choose_node(viewer, step < 0);
        return;
    }
    if (!list_objects(viewer) || edit->object_count == 0)
        return;
    const size_t at = (index_of(edit) + edit->object_count + (size_t)step) % edit->object_count;
    edit->ids[edit->tab] = edit->objects[at].id;
    read_object(viewer);
}

/* A light is moved by the node that shows it. */
void viewer_edit_choose_node_of_light(struct viewer *viewer)
{
    struct viewer_edit *edit = &viewer->edit;
    struct fl_error refusal = {0};
    struct fl_object *nodes = NULL;
    size_t count = 0;
    if (viewer_edit_must_wait(viewer))
        return;
    if (!session_objects(viewer->session, PROTOCOL_OBJECT_NODE, &nodes, &count, &refusal))
        say(viewer, &refusal);
    for (size_t i = 0; i < count; i++)
        if (nodes[i].shows_kind == PROTOCOL_NODE_LIGHT && nodes[i].shows == edit->ids[EDIT_LIGHT]) {
            edit->picked = edit->ids[EDIT_NODE] = nodes[i].id;
            viewer_edit_choose_tab(viewer, EDIT_NODE);
            break;
        }
    free(nodes);
}

/* ---- changes ---- */

static void *work(void *argument)
{
    struct edit_work *work = argument;
    session_edit(work->session, work->change.list, work->change.count, &work->edited, &work->refusal);
    atomic_store(&work->done, true);
    return NULL;
}

/* Takes the list over. */
static void begin_work(struct viewer *viewer, enum edit_way way, struct edit_change change)
{
    struct viewer_edit *edit = &viewer->edit;
    edit->applied_ns = monotonic_now_ns();
    edit->work = (struct edit_work){.session = viewer->session, .change = change, .way = way};
    edit->works = pthread_create(&edit->work.thread, NULL, work, &edit->work) == 0;
    if (!edit->works)
        free(change.list);
}

static void end_work(struct viewer *viewer)
{
    struct viewer_edit *edit = &viewer->edit;
    struct edit_work *done = &edit->work;
    const struct fl_edited *edited = &done->edited;
    const bool is_undo = done->way == EDIT_UNDO || done->way == EDIT_REDO;
    pthread_join(done->thread, NULL);
    edit->works = false;
    if (edited->undo_count == 0 || done->refusal.code != FL_ERROR_NONE)
        say(viewer, &done->refusal);
    else if (is_undo)
        viewer_say(viewer, "%s: %s", done->way == EDIT_REDO ? "redone" : "undone", done->change.list[0].field);
    if (is_undo)
        edit_history_took(&edit->history, done->way == EDIT_REDO, edited->undo, edited->undo_count);
    else if (done->way == EDIT_DRAG_ON)
        free(edited->undo);
    else
        edit_history_add(&edit->history, edited->undo, edited->undo_count);
    edit->drag_is_noted |= !is_undo && edited->undo_count > 0;
    free(done->change.list);
}

bool viewer_edit_must_wait(const struct viewer *viewer)
{
    return viewer->edit.works || session_reads(viewer->session);
}

bool viewer_edit_works(struct viewer *viewer, bool wait)
{
    struct viewer_edit *edit = &viewer->edit;
    if (!edit->works || (!wait && !atomic_load(&edit->work.done)))
        return edit->works;
    end_work(viewer);
    if (!wait && edit->shown && session_scene(viewer->session))
        read_object(viewer);
    return false;
}

void viewer_edit_apply(struct viewer *viewer, size_t row, double value, bool more)
{
    struct viewer_edit *edit = &viewer->edit;
    struct edit_change change = {.list = calloc(1, sizeof(*change.list)), .count = 1};
    if (!change.list)
        return;
    edit_row_assign(&edit->state, edit->rows[row], value, change.list);
    begin_work(viewer, more ? EDIT_DRAG_ON : EDIT_CHANGE, change);
}

bool viewer_edit_has_field(const struct viewer_edit *edit)
{
    return edit->has_state && edit->chosen > 0;
}

void viewer_edit_step(struct viewer *viewer, double steps)
{
    struct viewer_edit *edit = &viewer->edit;
    if (viewer_edit_must_wait(viewer) || edit->has_pending)
        return;
    if (edit->chosen == 0)
        choose_object(viewer, steps > 0 ? 1 : -1);
    else if (viewer_edit_has_field(edit))
        viewer_edit_apply(viewer, edit->chosen - 1,
                          edit_row_step(&edit->state, edit->rows[edit->chosen - 1], steps, edit->metre), false);
}

void viewer_edit_undo(struct viewer *viewer, bool redo)
{
    struct viewer_edit *edit = &viewer->edit;
    struct edit_change change;
    if (viewer_edit_must_wait(viewer))
        return;
    if (!edit_history_take(&edit->history, redo, &change)) {
        viewer_say(viewer, "there is nothing to %s", redo ? "redo" : "undo");
        return;
    }
    begin_work(viewer, redo ? EDIT_REDO : EDIT_UNDO, change);
}

void viewer_edit_toggle(struct viewer *viewer)
{
    struct viewer_edit *edit = &viewer->edit;
    if (viewer_edit_must_wait(viewer))
        return;
    edit->shown = !edit->shown;
    if (!edit->shown)
        return;
    measure(viewer);
    viewer_edit_choose_tab(viewer, edit->ids[edit->tab] != 0 ? edit->tab : EDIT_LIGHT);
}

void viewer_step_edit(struct viewer *viewer, uint64_t now_ns)
{
    struct viewer_edit *edit = &viewer->edit;
    if (!edit->has_state || !session_scene(viewer->session))
        return;
    if (edit->has_pending && (!edit->dragging || now_ns >= edit->applied_ns + APPLY_PAUSE_NS)) {
        edit->has_pending = false;
        viewer_edit_apply(viewer, edit->pending_row, edit->pending, edit->drag_is_noted);
    } else if (edit->shown && !edit->dragging && now_ns >= edit->read_ns + READ_PAUSE_NS &&
               fl_scene_revision(session_scene(viewer->session)) > edit->state.revision) {
        read_object(viewer);
    }
}

/* ---- what is shown ---- */

static void show_which(const struct viewer_edit *edit, struct hud_edit_row *row)
{
    *row = (struct hud_edit_row){.share = -1};
    snprintf(row->name, sizeof(row->name), "which");
    if (edit->tab == EDIT_NODE)
        snprintf(row->value, sizeof(row->value),
                 edit->ids[EDIT_NODE] == edit->picked ? "picked" : "group around it");
    else if (edit->tab == EDIT_ENVIRONMENT)
        snprintf(row->value, sizeof(row->value), "the only one");
    else if (edit->objects)
        snprintf(row->value, sizeof(row->value), "%zu of %zu", index_of(edit) + 1, edit->object_count);
    else
        snprintf(row->value, sizeof(row->value), "\u25c2 \u25b8");
}

const struct hud_edit *viewer_edit_hud(struct viewer *viewer)
{
    struct viewer_edit *edit = &viewer->edit;
    struct hud_edit *hud = &edit->hud;
    *hud = (struct hud_edit){.shown = edit->shown, .tab = edit->tab, .chosen = edit->chosen};
    memcpy(hud->tabs, tab_names, sizeof(hud->tabs));
    hud->hint = "Ctrl + click on it";
    /* Of what cannot be picked the first one is chosen, if there is one. */
    if (edit->tab >= EDIT_LIGHT && edit->ids[edit->tab] == 0) {
        snprintf(hud->title, sizeof(hud->title), "the scene has no %s", tab_names[edit->tab]);
        hud->hint = edit->tab == EDIT_LIGHT ? "Tab: the environment, which lights it" : "";
        return hud;
    }
    if (!edit->has_state) {
        snprintf(hud->title, sizeof(hud->title), "no %s is chosen", tab_names[edit->tab]);
        return hud;
    }
    const char *name = edit->state.name;
    if (edit->tab == EDIT_ENVIRONMENT)
        snprintf(hud->title, sizeof(hud->title), "environment");
    else
        snprintf(hud->title, sizeof(hud->title), "%.60s%s#%u", name, name[0] != '\0' ? "  " : "", edit->state.id);
    hud->count = edit->row_count + 1;
    show_which(edit, &hud->rows[0]);
    for (size_t i = 0; i < edit->row_count; i++) {
        edit_row_show(&edit->state, edit->rows[i], &hud->rows[i + 1]);
        hud->rows[i + 1].is_shown_as_it_is = edit->has_display_values;
    }
    static const char *const others[EDIT_TABS] = {
        "Left: the group around it, Right: back", "Left, Right: another one",
        "Left, Right: another one; Return: its node", "light from far away, all around the scene"};
    hud->hint = edit->chosen > 0 ? edit_row_hint(&edit->state, edit->rows[edit->chosen - 1]) : others[edit->tab];
    hud->typed = edit->typing ? edit->typed : NULL;
    return hud;
}
