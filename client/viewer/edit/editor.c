/* SPDX-License-Identifier: MIT */
/* Editing of the scene: the picked object, its fields in a panel, their changes sent to the daemon, and changes
 * that other clients make. */
#include "editor.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define APPLY_PAUSE_NS 40000000ull /* between changes sent in a drag; the newest value wins */
#define READ_PAUSE_NS 200000000ull /* between checks for other clients' changes */
#define METRES_OF_EXTENT 0.01      /* step of a length as a share of the scene's extent */

static const enum protocol_object_kind kinds[EDIT_TABS] = {PROTOCOL_OBJECT_NODE, PROTOCOL_OBJECT_MATERIAL,
                                                           PROTOCOL_OBJECT_LIGHT, PROTOCOL_OBJECT_ENVIRONMENT};
static const char *const tab_names[EDIT_TABS] = {"node", "material", "light", "environment"};

static void say(struct editor *edit, const struct fl_error *refusal)
{
    if (refusal->code != FL_ERROR_NONE) /* otherwise the connection is lost */
        screen_say(edit->screen, "not possible: %s", refusal->text);
}

/* ---- choice of the object ---- */

static void forget_objects(struct editor *edit)
{
    free(edit->objects);
    edit->objects = NULL;
    edit->object_count = 0;
}

static bool list_objects(struct editor *edit)
{
    struct fl_error refusal = {0};
    if (edit->objects)
        return true;
    if (session_objects(edit->session, kinds[edit->choice.tab], &edit->objects, &edit->object_count, &refusal))
        return true;
    say(edit, &refusal);
    return false;
}

static size_t index_of(const struct editor *edit)
{
    for (size_t i = 0; i < edit->object_count; i++)
        if (edit->objects[i].id == edit->choice.ids[edit->choice.tab])
            return i;
    return 0;
}

/* Asks whether colours are display values, a setting of the environment. */
static void ask_for_colours(struct editor *edit)
{
    struct fl_error refusal = {0};
    edit->has_display_values = false;
    if (!session_read(edit->session, PROTOCOL_OBJECT_ENVIRONMENT, 1, &edit->state, &refusal))
        return;
    for (size_t i = 0; i < edit->state.count; i++)
        if (strcmp(edit->state.fields[i].field.name, "display_values") == 0)
            edit->has_display_values = edit->state.fields[i].values[0] > 0;
}

/* Chooses the step of a length by the scene's size. */
static void measure(struct editor *edit)
{
    struct fl_scene_bounds bounds;
    struct fl_error ignored;
    double extent = 0;
    if (fl_scene_get_bounds(session_scene(edit->session), &bounds, &ignored) && !bounds.empty)
        for (int i = 0; i < 3; i++)
            extent = extent > (double)(bounds.upper_world[i] - bounds.lower_world[i])
                         ? extent
                         : (double)(bounds.upper_world[i] - bounds.lower_world[i]);
    edit->metre = extent > 0 ? extent * METRES_OF_EXTENT : METRES_OF_EXTENT;
}

static void read_object(struct editor *edit)
{
    struct fl_error refusal = {0};
    const uint32_t id = edit->choice.ids[edit->choice.tab];
    edit->read_ns = monotonic_now_ns();
    edit->screen->must_draw = true;
    edit->has_state = id != 0 && session_read(edit->session, kinds[edit->choice.tab], id, &edit->state, &refusal);
    edit->row_count = edit->has_state ? edit_rows(&edit->state, edit->rows, EDIT_ROWS_MAX) : 0;
    if (edit->chosen > edit->row_count)
        edit->chosen = 0;
    if (id == 0 || edit->has_state || refusal.code == FL_ERROR_NONE)
        return;
    say(edit, &refusal); /* another client has removed the object */
    edit->choice.ids[edit->choice.tab] = 0;
}

void editor_stop_typing(struct editor *edit)
{
    edit->typing = edit->choice.dragging = edit->choice.has_pending = false;
    edit->typed[0] = '\0';
}

void editor_choose_tab(struct editor *edit, size_t tab)
{
    if (editor_must_wait(edit))
        return;
    editor_stop_typing(edit);
    edit->choice.tab = tab % EDIT_TABS;
    edit->chosen = 0;
    forget_objects(edit);
    ask_for_colours(edit);
    /* Objects of these tabs cannot be picked, so the first one is chosen initially. */
    if (edit->choice.tab >= EDIT_LIGHT && edit->choice.ids[edit->choice.tab] == 0 && list_objects(edit) &&
        edit->object_count > 0)
        edit->choice.ids[edit->choice.tab] = edit->objects[0].id;
    read_object(edit);
}

void editor_show(struct editor *edit, uint32_t node, uint32_t material)
{
    edit->picked = edit->choice.ids[EDIT_NODE] = node;
    edit->choice.ids[EDIT_MATERIAL] = material;
    edit->choice.shown = true;
    measure(edit);
    editor_choose_tab(edit, edit->choice.tab < EDIT_LIGHT && edit->choice.ids[edit->choice.tab] != 0
                                ? edit->choice.tab
                            : material != 0 ? EDIT_MATERIAL
                                            : EDIT_NODE);
}

void editor_read_again(struct editor *edit, bool is_same)
{
    forget_objects(edit);
    if (!is_same) {
        edit_history_clear(&edit->history);
        memset(edit->choice.ids, 0, sizeof(edit->choice.ids));
        edit->picked = 0;
        edit->has_state = false;
        editor_stop_typing(edit);
    }
    if (edit->choice.shown && is_same)
        read_object(edit);
    else if (edit->choice.shown)
        editor_choose_tab(edit, edit->choice.tab);
}

void editor_forget(struct editor *edit)
{
    editor_works(edit, true);
    forget_objects(edit);
    edit_history_clear(&edit->history);
    *edit = (struct editor){.screen = edit->screen, .session = edit->session, .choice.tab = EDIT_MATERIAL};
}

/* ---- another object ---- */

/* Moves the choice up the hierarchy, or back down towards the picked node. */
static void choose_node(struct editor *edit, bool up)
{
    struct fl_error refusal = {0};
    struct fl_object object;
    uint32_t id = up ? edit->choice.ids[EDIT_NODE] : edit->picked;
    for (unsigned i = 0; id != 0 && i < 1000; i++) {
        if (!session_object(edit->session, PROTOCOL_OBJECT_NODE, id, &object, &refusal)) {
            say(edit, &refusal);
            return;
        }
        if (up ? object.parent != 0 : object.parent == edit->choice.ids[EDIT_NODE]) {
            edit->choice.ids[EDIT_NODE] = up ? object.parent : id;
            break;
        }
        id = up ? 0 : object.parent;
    }
    read_object(edit);
}

static void choose_object(struct editor *edit, int step)
{
    if (edit->choice.tab == EDIT_NODE) {
        choose_node(edit, step < 0);
        return;
    }
    if (!list_objects(edit) || edit->object_count == 0)
        return;
    const size_t at = (index_of(edit) + edit->object_count + (size_t)step) % edit->object_count;
    edit->choice.ids[edit->choice.tab] = edit->objects[at].id;
    read_object(edit);
}

/* Chooses the node of a light, since that node moves it. */
void editor_choose_node_of_light(struct editor *edit)
{
    struct fl_error refusal = {0};
    struct fl_object *nodes = NULL;
    size_t count = 0;
    if (editor_must_wait(edit))
        return;
    if (!session_objects(edit->session, PROTOCOL_OBJECT_NODE, &nodes, &count, &refusal))
        say(edit, &refusal);
    for (size_t i = 0; i < count; i++)
        if (nodes[i].shows_kind == PROTOCOL_NODE_LIGHT && nodes[i].shows == edit->choice.ids[EDIT_LIGHT]) {
            edit->picked = edit->choice.ids[EDIT_NODE] = nodes[i].id;
            editor_choose_tab(edit, EDIT_NODE);
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

/* Takes ownership of the change's list. */
static void begin_work(struct editor *edit, enum edit_way way, struct edit_change change)
{
    edit->applied_ns = monotonic_now_ns();
    edit->work = (struct edit_work){.session = edit->session, .change = change, .way = way};
    edit->works = pthread_create(&edit->work.thread, NULL, work, &edit->work) == 0;
    if (!edit->works)
        free(change.list);
}

static void end_work(struct editor *edit)
{
    struct edit_work *done = &edit->work;
    const struct fl_edited *edited = &done->edited;
    const bool is_undo = done->way == EDIT_UNDO || done->way == EDIT_REDO;
    pthread_join(done->thread, NULL);
    edit->works = false;
    if (edited->undo_count == 0 || done->refusal.code != FL_ERROR_NONE)
        say(edit, &done->refusal);
    else if (is_undo)
        screen_say(edit->screen, "%s: %s", done->way == EDIT_REDO ? "redone" : "undone",
                   done->change.list[0].field);
    if (is_undo)
        edit_history_took(&edit->history, done->way == EDIT_REDO, edited->undo, edited->undo_count);
    else if (done->way == EDIT_DRAG_ON)
        free(edited->undo);
    else
        edit_history_add(&edit->history, edited->undo, edited->undo_count);
    edit->drag_is_noted |= !is_undo && edited->undo_count > 0;
    free(done->change.list);
}

bool editor_must_wait(const struct editor *edit)
{
    return edit->works || session_reads(edit->session);
}

bool editor_works(struct editor *edit, bool wait)
{
    if (!edit->works || (!wait && !atomic_load(&edit->work.done)))
        return edit->works;
    end_work(edit);
    if (!wait && edit->choice.shown && session_scene(edit->session))
        read_object(edit);
    return false;
}

void editor_apply(struct editor *edit, size_t row, double value, bool more)
{
    struct edit_change change = {.list = calloc(1, sizeof(*change.list)), .count = 1};
    if (!change.list)
        return;
    edit_row_assign(&edit->state, edit->rows[row], value, change.list);
    begin_work(edit, more ? EDIT_DRAG_ON : EDIT_CHANGE, change);
}

bool editor_has_field(const struct editor *edit)
{
    return edit->has_state && edit->chosen > 0;
}

void editor_turn(struct editor *edit, double steps)
{
    if (editor_must_wait(edit) || edit->choice.has_pending)
        return;
    if (edit->chosen == 0)
        choose_object(edit, steps > 0 ? 1 : -1);
    else if (editor_has_field(edit))
        editor_apply(edit, edit->chosen - 1,
                     edit_row_step(&edit->state, edit->rows[edit->chosen - 1], steps, edit->metre), false);
}

void editor_undo(struct editor *edit, bool redo)
{
    struct edit_change change;
    if (editor_must_wait(edit))
        return;
    if (!edit_history_take(&edit->history, redo, &change)) {
        screen_say(edit->screen, "there is nothing to %s", redo ? "redo" : "undo");
        return;
    }
    begin_work(edit, redo ? EDIT_REDO : EDIT_UNDO, change);
}

void editor_toggle(struct editor *edit)
{
    if (editor_must_wait(edit))
        return;
    edit->choice.shown = !edit->choice.shown;
    if (!edit->choice.shown)
        return;
    measure(edit);
    editor_choose_tab(edit, edit->choice.ids[edit->choice.tab] != 0 ? edit->choice.tab : EDIT_LIGHT);
}

void editor_step(struct editor *edit, uint64_t now_ns)
{
    if (!edit->has_state || !session_scene(edit->session))
        return;
    if (edit->choice.has_pending && (!edit->choice.dragging || now_ns >= edit->applied_ns + APPLY_PAUSE_NS)) {
        edit->choice.has_pending = false;
        editor_apply(edit, edit->pending_row, edit->pending, edit->drag_is_noted);
    } else if (edit->choice.shown && !edit->choice.dragging && now_ns >= edit->read_ns + READ_PAUSE_NS &&
               fl_scene_revision(session_scene(edit->session)) > edit->state.revision) {
        read_object(edit);
    }
}

/* ---- content of the panel ---- */

static void show_which(const struct editor *edit, struct hud_edit_row *row)
{
    *row = (struct hud_edit_row){.share = -1};
    snprintf(row->name, sizeof(row->name), "which");
    if (edit->choice.tab == EDIT_NODE)
        snprintf(row->value, sizeof(row->value),
                 edit->choice.ids[EDIT_NODE] == edit->picked ? "picked" : "group around it");
    else if (edit->choice.tab == EDIT_ENVIRONMENT)
        snprintf(row->value, sizeof(row->value), "the only one");
    else if (edit->objects)
        snprintf(row->value, sizeof(row->value), "%zu of %zu", index_of(edit) + 1, edit->object_count);
    else
        snprintf(row->value, sizeof(row->value), "\u25c2 \u25b8");
}

const struct hud_edit *editor_hud(struct editor *edit)
{
    struct hud_edit *hud = &edit->hud;
    *hud = (struct hud_edit){.shown = edit->choice.shown, .tab = edit->choice.tab, .chosen = edit->chosen};
    memcpy(hud->tabs, tab_names, sizeof(hud->tabs));
    hud->hint = "Ctrl + click on it";
    /* Objects of these tabs cannot be picked: the first one is chosen, if any. */
    if (edit->choice.tab >= EDIT_LIGHT && edit->choice.ids[edit->choice.tab] == 0) {
        snprintf(hud->title, sizeof(hud->title), "the scene has no %s", tab_names[edit->choice.tab]);
        hud->hint = edit->choice.tab == EDIT_LIGHT ? "Tab: the environment, which lights it" : "";
        return hud;
    }
    if (!edit->has_state) {
        snprintf(hud->title, sizeof(hud->title), "no %s is chosen", tab_names[edit->choice.tab]);
        return hud;
    }
    const char *name = edit->state.name;
    if (edit->choice.tab == EDIT_ENVIRONMENT)
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
    hud->hint =
        edit->chosen > 0 ? edit_row_hint(&edit->state, edit->rows[edit->chosen - 1]) : others[edit->choice.tab];
    hud->typed = edit->typing ? edit->typed : NULL;
    return hud;
}
