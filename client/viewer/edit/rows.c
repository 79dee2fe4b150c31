/* SPDX-License-Identifier: MIT */
/* Rows of the editing panel: values, steps and drags. */
#include "rows.h"
#include "lib/text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define VECTOR_MAX 4u          /* matrices are not edited number by number */
#define BOUNDED_MAX 400.0      /* a longer range gets no slider */
#define STEPS_OF_RANGE 20.0    /* key presses from end to end */
#define GROWTH_PER_STEP 1.1892 /* four steps double the value */
#define FIRST 0.01             /* first value after 0, which does not grow */
#define SMALLEST 1e-4          /* last value before 0 */
#define STEP_DEGREES 5.0
#define PIXELS_PER_STEP 12.0

static const struct fl_field *field_of(const struct fl_object_state *state, struct edit_row row)
{
    return &state->fields[row.field].field;
}

size_t edit_rows(const struct fl_object_state *state, struct edit_row *rows, size_t max)
{
    size_t count = 0;
    for (size_t i = 0; i < state->count; i++)
        for (unsigned k = 0;
             k < state->fields[i].field.count && state->fields[i].field.count <= VECTOR_MAX && count < max; k++)
            rows[count++] = (struct edit_row){.field = i, .component = k};
    return count;
}

double edit_row_value(const struct fl_object_state *state, struct edit_row row)
{
    return state->fields[row.field].values[row.component];
}

static bool is_choice(const struct fl_field *field)
{
    return field->form == FL_FIELD_FLAG || field->form == FL_FIELD_WORD;
}

bool edit_row_is_choice(const struct fl_object_state *state, struct edit_row row)
{
    return is_choice(field_of(state, row));
}

static bool is_bounded(const struct fl_field *field)
{
    return !is_choice(field) && field->max - field->min <= BOUNDED_MAX;
}

static double within(const struct fl_field *field, double value)
{
    return fmin(fmax(value, field->min), field->max);
}

void edit_row_show(const struct fl_object_state *state, struct edit_row row, struct hud_edit_row *shown)
{
    static const char axes[] = "xyzw", colours[] = "rgba";
    const struct fl_field *field = field_of(state, row);
    const double value = edit_row_value(state, row);
    const bool is_colour = field->form == FL_FIELD_COLOUR;
    *shown = (struct hud_edit_row){.share = -1};
    if (field->count == 1)
        snprintf(shown->name, sizeof(shown->name), "%.39s", field->name);
    else
        snprintf(shown->name, sizeof(shown->name), "%.37s %c", field->name,
                 (is_colour ? colours : axes)[row.component]);
    const char *word = field->form == FL_FIELD_WORD ? fl_field_word(field, (unsigned)value) : NULL;
    if (field->form == FL_FIELD_FLAG)
        word = value > 0 ? "yes" : "no";
    if (word)
        snprintf(shown->value, sizeof(shown->value), "%.39s", word);
    else
        snprintf(shown->value, sizeof(shown->value), "%.4g", value == 0 ? 0 : value); /* avoids -0 */
    if (is_bounded(field))
        shown->share = (value - field->min) / (field->max - field->min);
    shown->has_colour = is_colour && row.component == 0;
    for (int i = 0; i < 3 && shown->has_colour; i++)
        shown->colour[i] = (float)state->fields[row.field].values[i];
}

const char *edit_row_hint(const struct fl_object_state *state, struct edit_row row)
{
    const struct fl_field *field = field_of(state, row);
    if (field->doc[0] != '\0')
        return field->doc;
    return is_choice(field) ? "Left and Right or a click change it"
                            : "Left and Right, a drag or a number change it";
}

/* Steps to the next word, whose numbers may have gaps. */
static double next_word(const struct fl_field *field, double value, double steps)
{
    const int count = (int)(field->max - field->min) + 1, step = steps > 0 ? 1 : count - 1;
    int at = (int)(value - field->min);
    for (int tries = 0; tries < count; tries++) {
        at = (at + step) % count;
        if (field->form == FL_FIELD_FLAG || fl_field_word(field, (unsigned)(at + (int)field->min)))
            break;
    }
    return field->min + at;
}

/* Moves a value by steps: a number without bounds grows by a factor, a signed one by a distance. */
static double moved(const struct fl_field *field, double from, double steps, double metre)
{
    const bool is_angle = strstr(field->unit, "degree") != NULL, is_length = strstr(field->unit, "met") != NULL;
    if (is_bounded(field))
        return within(field, from + steps * (field->max - field->min) / STEPS_OF_RANGE);
    if (is_angle || (is_length && field->min < 0))
        return within(field, from + steps * (is_angle ? STEP_DEGREES : metre));
    if (from == 0)
        return within(field, steps > 0 ? FIRST : -FIRST);
    const double value = from * pow(GROWTH_PER_STEP, from > 0 ? steps : -steps);
    return fabs(value) < SMALLEST && fabs(value) < fabs(from) ? 0 : within(field, value);
}

double edit_row_step(const struct fl_object_state *state, struct edit_row row, double steps, double metre)
{
    const struct fl_field *field = field_of(state, row);
    const double value = edit_row_value(state, row);
    return is_choice(field) ? next_word(field, value, steps) : moved(field, value, steps, metre);
}

double edit_row_slide(const struct fl_object_state *state, struct edit_row row, double share)
{
    const struct fl_field *field = field_of(state, row);
    return field->min + fmin(fmax(share, 0), 1) * (field->max - field->min);
}

double edit_row_drag(const struct fl_object_state *state, struct edit_row row, double from, double pixels,
                     double metre)
{
    const struct fl_field *field = field_of(state, row);
    return moved(field, from, pixels / PIXELS_PER_STEP, metre);
}

bool edit_row_read(const struct fl_object_state *state, struct edit_row row, const char *text, double *value,
                   struct fl_error *error)
{
    const struct fl_field *field = field_of(state, row);
    return fl_text_real(text, field->min, field->max, value, error);
}

void edit_row_assign(const struct fl_object_state *state, struct edit_row row, double value,
                     struct fl_assignment *assignment)
{
    const struct fl_field_value *field = &state->fields[row.field];
    *assignment = (struct fl_assignment){
        .kind = state->kind, .id = state->id, .way = FL_ASSIGN, .count = field->field.count};
    snprintf(assignment->field, sizeof(assignment->field), "%s", field->field.name);
    memcpy(assignment->values, field->values, sizeof(field->values));
    assignment->values[row.component] = value;
}
