/* SPDX-License-Identifier: MIT */
/* Mouse and keys in the panel in which an object is edited. */
#include "viewer/viewer_edit.h"
#include "viewer/viewer_state.h"

#include <string.h>

#define FINE 0.1 /* of a step, with Shift */

static bool has_number(const struct viewer_edit *edit)
{
    return viewer_edit_has_field(edit) && !edit_row_is_choice(&edit->state, edit->rows[edit->chosen - 1]);
}

static void end_typing(struct viewer *viewer)
{
    struct viewer_edit *edit = &viewer->edit;
    struct fl_error error = {0};
    double value;
    if (viewer_edit_must_wait(viewer))
        return;
    if (edit->typed[0] != '\0' &&
        edit_row_read(&edit->state, edit->rows[edit->chosen - 1], edit->typed, &value, &error))
        viewer_edit_apply(viewer, edit->chosen - 1, value, false);
    else if (edit->typed[0] != '\0')
        viewer_say(viewer, "%s", error.text);
    viewer_edit_stop_typing(edit);
}

static void slide_to(struct viewer *viewer, double x)
{
    struct viewer_edit *edit = &viewer->edit;
    const struct edit_row row = edit->rows[edit->chosen - 1];
    edit->pending =
        edit->slides
            ? edit_row_slide(&edit->state, row, hud_edit_share(viewer->width, viewer->scale, x))
            : edit_row_drag(&edit->state, row, edit->drag_from, (x - edit->drag_x) / viewer->scale, edit->metre);
    edit->pending_row = edit->chosen - 1;
    edit->has_pending = true;
}

static bool press(struct viewer *viewer, const struct input *input)
{
    struct viewer_edit *edit = &viewer->edit;
    struct hud_edit_hit hit;
    hud_edit_find(viewer_edit_hud(viewer), viewer->width, viewer->height, viewer->scale, input->x, input->y, &hit);
    /* What begins must wait until the daemon has the last change. */
    if (!hit.is_panel || input->button != INPUT_LEFT || viewer_edit_must_wait(viewer) || edit->has_pending)
        return hit.is_panel;
    viewer_edit_stop_typing(edit);
    if (hit.part == HUD_EDIT_TAB)
        viewer_edit_choose_tab(viewer, hit.index);
    if (hit.part != HUD_EDIT_ROW && hit.part != HUD_EDIT_SLIDER)
        return true;
    edit->chosen = hit.index;
    if (!has_number(edit)) {
        viewer_edit_step(viewer, 1);
        return true;
    }
    edit->dragging = true;
    edit->drag_is_noted = false;
    edit->slides = hit.part == HUD_EDIT_SLIDER;
    edit->drag_x = input->x;
    edit->drag_from = edit_row_value(&edit->state, edit->rows[edit->chosen - 1]);
    if (edit->slides)
        slide_to(viewer, input->x);
    return true;
}

/* A number begins by itself: signs and dots are keys of something else. */
static bool take_text(struct viewer_edit *edit, const char *text)
{
    const char c = text[0] == ',' ? '.' : text[0];
    const size_t length = strlen(edit->typed);
    if (!has_number(edit) || (!edit->typing && (c < '0' || c > '9')))
        return edit->typing;
    edit->typing = true;
    if (c != '\0' && text[1] == '\0' && strchr("0123456789.-+e", c) && length + 1 < sizeof(edit->typed)) {
        edit->typed[length] = c;
        edit->typed[length + 1] = '\0';
    }
    return true;
}

static bool type(struct viewer *viewer, const struct input *input)
{
    struct viewer_edit *edit = &viewer->edit;
    const size_t length = strlen(edit->typed);
    if (strcmp(input->key, "escape") == 0)
        viewer_edit_stop_typing(edit);
    else if (strcmp(input->key, "backspace") == 0 && length > 0)
        edit->typed[length - 1] = '\0';
    else if (strcmp(input->key, "return") == 0 || strcmp(input->key, "keypad enter") == 0)
        end_typing(viewer);
    return true;
}

static bool press_key(struct viewer *viewer, const struct input *input)
{
    struct viewer_edit *edit = &viewer->edit;
    const size_t count = edit->row_count + 1;
    if (edit->typing)
        return type(viewer, input);
    if (strcmp(input->key, "escape") == 0)
        edit->shown = false;
    else if (strcmp(input->key, "up") == 0 || strcmp(input->key, "down") == 0)
        edit->chosen = (edit->chosen + (input->key[0] == 'd' ? 1 : count - 1)) % count;
    else if (strcmp(input->key, "left") == 0 || strcmp(input->key, "right") == 0)
        viewer_edit_step(viewer, (input->key[0] == 'r' ? 1 : -1) * (input->shift ? FINE : 1));
    else if (strcmp(input->key, "tab") == 0)
        viewer_edit_choose_tab(viewer, edit->tab + (input->shift ? EDIT_TABS - 1 : 1));
    else if (strcmp(input->key, "return") == 0 && edit->tab == EDIT_LIGHT && edit->chosen == 0)
        viewer_edit_choose_node_of_light(viewer);
    else if (strcmp(input->key, "return") == 0 && has_number(edit))
        edit->typing = true;
    else
        return false;
    return true;
}

static bool is_on_panel(struct viewer *viewer, double x, double y)
{
    struct hud_edit_hit hit;
    hud_edit_find(viewer_edit_hud(viewer), viewer->width, viewer->height, viewer->scale, x, y, &hit);
    return hit.is_panel;
}

bool viewer_edit_input(struct viewer *viewer, const struct input *input)
{
    struct viewer_edit *edit = &viewer->edit;
    if (!edit->shown || viewer->settings.help || !session_has_scene(viewer->session))
        return false;
    viewer->must_draw = true;
    switch (input->kind) {
    case INPUT_BUTTON_DOWN:
        return press(viewer, input);
    case INPUT_MOTION:
        if (edit->dragging)
            slide_to(viewer, input->x);
        return edit->dragging;
    case INPUT_BUTTON_UP:
        edit->dragging = false; /* the last value of it may be pending */
        return false;
    case INPUT_WHEEL:
        if (!is_on_panel(viewer, viewer->pointer_x, viewer->pointer_y))
            return false;
        if (!edit->dragging && !edit->typing)
            edit->chosen = input->wheel > 0 ? edit->chosen - (edit->chosen > 0)
                                            : edit->chosen + (edit->chosen < edit->row_count);
        return true;
    case INPUT_FOCUS_LOST:
        viewer_edit_stop_typing(edit);
        return false;
    case INPUT_TEXT:
        return take_text(edit, input->text);
    case INPUT_KEY_DOWN:
        return press_key(viewer, input);
    default:
        return false;
    }
}
