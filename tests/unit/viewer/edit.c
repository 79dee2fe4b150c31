/* SPDX-License-Identifier: MIT */
/* Editing in the viewer: rows of an object's fields, what keys and drags make of them, the panel that shows them,
 * and undoing. */
#include "options/edit_history.h"
#include "viewer/edit/rows.h"
#include "viewer/overlay/edit_panel.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define METRE 0.05

static struct fl_object_state object;
static struct edit_row rows[HUD_EDIT_ROWS_MAX];
static struct hud_edit_row shown;

/* Sets all fields of the kind, each to the middle of its range or to 1. */
static size_t some_state(enum protocol_object_kind kind)
{
    struct fl_field fields[FL_FIELDS_MAX];
    object = (struct fl_object_state){.kind = kind, .id = 7, .name = "thing", .count = fl_fields(kind, fields)};
    for (size_t i = 0; i < object.count; i++) {
        object.fields[i].field = fields[i];
        for (unsigned k = 0; k < fields[i].count; k++)
            object.fields[i].values[k] = fields[i].form == FL_FIELD_FLAG || fields[i].form == FL_FIELD_WORD ? 0
                                         : fields[i].max <= 2 ? (fields[i].min + fields[i].max) / 2
                                                              : 1;
    }
    return edit_rows(&object, rows, HUD_EDIT_ROWS_MAX);
}

static struct edit_row row_of(const char *name, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        edit_row_show(&object, rows[i], &shown);
        if (strcmp(shown.name, name) == 0)
            return rows[i];
    }
    fail_msg("there is no row '%s'", name);
    return rows[0];
}

static void set(struct edit_row row, double value)
{
    object.fields[row.field].values[row.component] = value;
}

TEST(every_number_of_an_object_is_a_row_and_stays_in_its_range)
{
    static const enum protocol_object_kind kinds[] = {PROTOCOL_OBJECT_NODE, PROTOCOL_OBJECT_MATERIAL,
                                                      PROTOCOL_OBJECT_LIGHT};
    for (size_t k = 0; k < 3; k++) {
        const size_t count = some_state(kinds[k]);
        assert_in_range(count, 4, HUD_EDIT_ROWS_MAX - 2);
        for (size_t i = 0; i < count; i++) {
            const struct fl_field *field = &object.fields[rows[i].field].field;
            edit_row_show(&object, rows[i], &shown);
            assert_true(shown.name[0] != '\0' && shown.value[0] != '\0' && shown.share <= 1);
            for (int way = -1; way <= 1; way += 2)
                for (int steps = 0; steps < 200; steps++) {
                    const double value = edit_row_step(&object, rows[i], way, METRE);
                    if (!(value >= field->min && value <= field->max))
                        fail_msg("%s: %g", shown.name, value);
                    set(rows[i], value);
                }
        }
    }
}

TEST(a_bounded_number_has_a_slider_and_another_one_grows)
{
    const size_t count = some_state(PROTOCOL_OBJECT_MATERIAL);
    const struct edit_row rough = row_of("roughness", count);
    assert_true(shown.share == 0.5 && !shown.has_colour);
    assert_string_equal(shown.value, "0.5");
    assert_true(fabs(edit_row_step(&object, rough, 1, METRE) - 0.55) < 1e-9);
    assert_true(edit_row_slide(&object, rough, 0.25) == 0.25 && edit_row_slide(&object, rough, 1.5) == 1);
    const struct edit_row green = row_of("base_colour g", count);
    assert_int_equal(green.component, 1);
    row_of("base_colour r", count);
    assert_true(shown.has_colour && shown.colour[0] == 0.5f);
    assert_false(edit_row_is_choice(&object, rough));
    assert_true(edit_row_is_choice(&object, row_of("double_sided", count)));
    const struct edit_row glow = row_of("emission r", count);
    assert_true(shown.share < 0);
    set(glow, 0);
    assert_true(edit_row_step(&object, glow, -1, METRE) == 0 && edit_row_step(&object, glow, 1, METRE) > 0);
    set(glow, 3);
    assert_true(fabs(edit_row_step(&object, glow, 4, METRE) - 6) < 0.01); /* four steps double it */
    assert_true(edit_row_drag(&object, glow, 3, 48, METRE) > 5.9);
    double value = -1;
    struct fl_error error = {0};
    assert_true(edit_row_read(&object, rough, "0.125", &value, &error) && value == 0.125);
    assert_false(edit_row_read(&object, rough, "1.5", &value, &error));
    assert_false(edit_row_read(&object, rough, "0.1.2", &value, &error));
    struct fl_assignment assignment;
    edit_row_assign(&object, green, 0.75, &assignment);
    assert_true(assignment.id == 7 && assignment.kind == PROTOCOL_OBJECT_MATERIAL && assignment.values[1] == 0.75);
    assert_true(assignment.values[0] == 0.5 && assignment.way == FL_ASSIGN);
    assert_string_equal(assignment.field, "base_colour");
}

/* ---- the panel ---- */

TEST(what_is_pressed_is_what_is_drawn_there)
{
    static struct hud_edit edit;
    struct hud_edit_hit hit;
    edit = (struct hud_edit){.shown = true, .count = 60, .chosen = 0};
    for (size_t i = 0; i < edit.count; i++)
        edit.rows[i].share = 0.5;
    /* From the top left of the panel down: tabs, then rows in order, each as high as the others. */
    const double left = 1280 - hud_edit_width(&edit, 1280, 1) + 20;
    size_t last = 0;
    bool has_tab = false, has_row = false;
    for (double y = 0; y < 720; y++) {
        hud_edit_find(&edit, 1280, 720, 1, left, y, &hit);
        has_tab |= hit.part == HUD_EDIT_TAB && hit.index == 0;
        assert_true(hit.part != HUD_EDIT_TAB || !has_row);
        if (hit.part != HUD_EDIT_ROW)
            continue;
        assert_true(hit.index == last || hit.index == last + 1);
        last = hit.index;
        has_row = true;
    }
    assert_true(has_tab && last > 20 && last < 59); /* not all fit */
    edit.chosen = 59;
    double bottom = 720;
    do
        hud_edit_find(&edit, 1280, 720, 1, left, --bottom, &hit);
    while (bottom > 0 && hit.part != HUD_EDIT_ROW);
    assert_int_equal(hit.index, 59); /* the chosen one does */
    /* On its slider, from one end to the other. */
    double from = -1, to = -1;
    for (double x = left; x < 1280; x++) {
        hud_edit_find(&edit, 1280, 720, 1, x, bottom, &hit);
        if (hit.part == HUD_EDIT_SLIDER && from < 0)
            from = hit.share;
        to = hit.part == HUD_EDIT_SLIDER ? hit.share : to;
    }
    assert_true(from < 0.02 && to > 0.98);
    hud_edit_find(&edit, 1280, 720, 1, left - 40, 300, &hit);
    assert_false(hit.is_panel);
    edit.shown = false;
    hud_edit_find(&edit, 1280, 720, 1, left, 300, &hit);
    assert_true(!hit.is_panel && hud_edit_width(&edit, 1280, 1) == 0);
}

/* ---- undoing ---- */

static struct fl_assignment *list_of(double value)
{
    struct fl_assignment *list = calloc(1, sizeof(*list));
    assert_non_null(list);
    list->values[0] = value;
    return list;
}

TEST(the_newest_change_is_undone_first_and_a_new_one_ends_redoing)
{
    static struct edit_history history;
    struct edit_change change;
    assert_false(edit_history_take(&history, false, &change));
    for (unsigned i = 0; i < EDIT_HISTORY_MAX + 10; i++)
        edit_history_add(&history, list_of(i), 1);
    edit_history_add(&history, list_of(-1), 0); /* nothing was changed */
    assert_true(edit_history_take(&history, false, &change));
    assert_true(change.list[0].values[0] == EDIT_HISTORY_MAX + 9);
    edit_history_took(&history, false, change.list, 1);
    assert_true(edit_history_take(&history, true, &change));
    edit_history_took(&history, true, change.list, 1);
    unsigned count = 0;
    while (edit_history_take(&history, false, &change)) {
        edit_history_took(&history, false, change.list, 1);
        count++;
    }
    assert_int_equal(count, EDIT_HISTORY_MAX);
    edit_history_add(&history, list_of(5), 1);
    assert_false(edit_history_take(&history, true, &change));
    edit_history_clear(&history);
    assert_false(edit_history_take(&history, false, &change));
}
