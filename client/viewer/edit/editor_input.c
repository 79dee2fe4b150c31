/* SPDX-License-Identifier: MIT */
/* Mouse and keyboard input of the edit panel. */
#include "editor.h"

#include <string.h>

#define FINE 0.1 /* scale of a step with Shift */

static bool has_number(const struct editor *edit)
{
    return editor_has_field(edit) && !edit_row_is_choice(&edit->state, edit->rows[edit->chosen - 1]);
}

static void end_typing(struct editor *edit)
{
    struct fl_error error = {0};
    double value;
    if (editor_must_wait(edit))
        return;
    if (edit->typed[0] != '\0' &&
        edit_row_read(&edit->state, edit->rows[edit->chosen - 1], edit->typed, &value, &error))
        editor_apply(edit, edit->chosen - 1, value, false);
    else if (edit->typed[0] != '\0')
        screen_say(edit->screen, "%s", error.text);
    editor_stop_typing(edit);
}

static void slide_to(struct editor *edit, double x)
{
    const struct edit_row row = edit->rows[edit->chosen - 1];
    edit->pending = edit->slides ? edit_row_slide(&edit->state, row,
                                                  hud_edit_share(edit->screen->width, edit->screen->scale, x))
                                 : edit_row_drag(&edit->state, row, edit->drag_from,
                                                 (x - edit->drag_x) / edit->screen->scale, edit->metre);
    edit->pending_row = edit->chosen - 1;
    edit->choice.has_pending = true;
}

static bool press(struct editor *edit, const struct input *input)
{
    struct hud_edit_hit hit;
    hud_edit_find(editor_hud(edit), edit->screen->width, edit->screen->height, edit->screen->scale, input->x,
                  input->y, &hit);
    /* A new action waits until the daemon has received the last change. */
    if (!hit.is_panel || input->button != INPUT_LEFT || editor_must_wait(edit) || edit->choice.has_pending)
        return hit.is_panel;
    editor_stop_typing(edit);
    if (hit.part == HUD_EDIT_TAB)
        editor_choose_tab(edit, hit.index);
    if (hit.part != HUD_EDIT_ROW && hit.part != HUD_EDIT_SLIDER)
        return true;
    edit->chosen = hit.index;
    if (!has_number(edit)) {
        editor_turn(edit, 1);
        return true;
    }
    edit->choice.dragging = true;
    edit->drag_is_noted = false;
    edit->slides = hit.part == HUD_EDIT_SLIDER;
    edit->drag_x = input->x;
    edit->drag_from = edit_row_value(&edit->state, edit->rows[edit->chosen - 1]);
    if (edit->slides)
        slide_to(edit, input->x);
    return true;
}

/* Starts typing with a digit only: signs and dots are keys of other actions. */
static bool take_text(struct editor *edit, const char *text)
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

static bool type(struct editor *edit, const struct input *input)
{
    const size_t length = strlen(edit->typed);
    if (strcmp(input->key, "escape") == 0)
        editor_stop_typing(edit);
    else if (strcmp(input->key, "backspace") == 0 && length > 0)
        edit->typed[length - 1] = '\0';
    else if (strcmp(input->key, "return") == 0 || strcmp(input->key, "keypad enter") == 0)
        end_typing(edit);
    return true;
}

static bool press_key(struct editor *edit, const struct input *input)
{
    const size_t count = edit->row_count + 1;
    if (edit->typing)
        return type(edit, input);
    if (strcmp(input->key, "escape") == 0)
        edit->choice.shown = false;
    else if (strcmp(input->key, "up") == 0 || strcmp(input->key, "down") == 0)
        edit->chosen = (edit->chosen + (input->key[0] == 'd' ? 1 : count - 1)) % count;
    else if (strcmp(input->key, "left") == 0 || strcmp(input->key, "right") == 0)
        editor_turn(edit, (input->key[0] == 'r' ? 1 : -1) * (input->shift ? FINE : 1));
    else if (strcmp(input->key, "tab") == 0)
        editor_choose_tab(edit, edit->choice.tab + (input->shift ? EDIT_TABS - 1 : 1));
    else if (strcmp(input->key, "return") == 0 && edit->choice.tab == EDIT_LIGHT && edit->chosen == 0)
        editor_choose_node_of_light(edit);
    else if (strcmp(input->key, "return") == 0 && has_number(edit))
        edit->typing = true;
    else
        return false;
    return true;
}

static bool is_on_panel(struct editor *edit, double x, double y)
{
    struct hud_edit_hit hit;
    hud_edit_find(editor_hud(edit), edit->screen->width, edit->screen->height, edit->screen->scale, x, y, &hit);
    return hit.is_panel;
}

bool editor_input(struct editor *edit, const struct input *input)
{
    if (!edit->choice.shown || !session_has_scene(edit->session))
        return false;
    edit->screen->must_draw = true;
    switch (input->kind) {
    case INPUT_BUTTON_DOWN:
        return press(edit, input);
    case INPUT_MOTION:
        if (edit->choice.dragging)
            slide_to(edit, input->x);
        return edit->choice.dragging;
    case INPUT_BUTTON_UP:
        edit->choice.dragging = false; /* the drag's last value may still be pending */
        return false;
    case INPUT_WHEEL:
        if (!is_on_panel(edit, edit->screen->pointer_x, edit->screen->pointer_y))
            return false;
        if (!edit->choice.dragging && !edit->typing)
            edit->chosen = input->wheel > 0 ? edit->chosen - (edit->chosen > 0)
                                            : edit->chosen + (edit->chosen < edit->row_count);
        return true;
    case INPUT_FOCUS_LOST:
        editor_stop_typing(edit);
        return false;
    case INPUT_TEXT:
        return take_text(edit, input->text);
    case INPUT_KEY_DOWN:
        return press_key(edit, input);
    default:
        return false;
    }
}
