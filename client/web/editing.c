/* SPDX-License-Identifier: MIT */
/* Answers to browsers that edit. */
#include "web/editing.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#define LIST_MAX 200u /* limit of objects in an answer */
#define WORDS_MAX 64u

static char *print(json_t *json, struct fl_error *error)
{
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(json);
    if (!text)
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    return text;
}

/* ---- reading ---- */

static char *list(struct fl_scene *scene, const struct web_request *request, struct fl_error *error)
{
    struct fl_object *objects = NULL;
    size_t count = 0, more = 0;
    if (!fl_scene_objects(scene, request->assignment.kind, &objects, &count, error))
        return NULL;
    json_t *found = json_array();
    for (size_t i = 0; i < count; i++) {
        if (!strcasestr(objects[i].name, request->assignment.which))
            continue;
        if (json_array_size(found) < LIST_MAX)
            json_array_append_new(found, json_pack("[I,s]", (json_int_t)objects[i].id, objects[i].name));
        else
            more++;
    }
    free(objects);
    return print(json_pack("{s:{s:s,s:I,s:o}}", "objects", "kind",
                           protocol_object_kind_text(request->assignment.kind), "more", (json_int_t)more, "list",
                           found),
                 error);
}

static json_t *words_of(const struct fl_field *field)
{
    json_t *words = json_array();
    for (unsigned i = 0; i < WORDS_MAX && field->form == FL_FIELD_WORD && fl_field_word(field, i); i++)
        json_array_append_new(words, json_string(fl_field_word(field, i)));
    return words;
}

static json_t *field_object(const struct fl_field_value *value)
{
    static const char *const forms[] = {[FL_FIELD_NUMBERS] = "numbers",
                                        [FL_FIELD_COLOUR] = "colour",
                                        [FL_FIELD_FLAG] = "flag",
                                        [FL_FIELD_WORD] = "word"};
    const struct fl_field *field = &value->field;
    json_t *values = json_array();
    for (unsigned i = 0; i < field->count; i++)
        json_array_append_new(values, json_real(value->values[i]));
    return json_pack("{s:s,s:s,s:s,s:s,s:f,s:f,s:o,s:o}", "name", field->name, "form", forms[field->form], "unit",
                     field->unit ? field->unit : "", "doc", field->doc ? field->doc : "", "min", field->min, "max",
                     field->max, "words", words_of(field), "values", values);
}

/* True if the scene's colours are display values; without an environment they are linear. */
static bool has_display_values(struct fl_scene *scene, struct fl_object_state *state)
{
    struct fl_error ignored = {0};
    if (fl_scene_read(scene, PROTOCOL_OBJECT_ENVIRONMENT, 1, state, &ignored))
        for (size_t i = 0; i < state->count; i++)
            if (strcmp(state->fields[i].field.name, "display_values") == 0)
                return state->fields[i].values[0] > 0;
    return false;
}

static char *read_one(struct fl_scene *scene, const struct web_request *request, struct fl_error *error)
{
    struct fl_object_state *state = malloc(sizeof(*state));
    char *text = NULL;
    const bool display_values = state && has_display_values(scene, state);
    if (!state)
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    else if (fl_scene_read(scene, request->assignment.kind, request->assignment.id, state, error)) {
        json_t *fields = json_array();
        for (size_t i = 0; i < state->count; i++)
            json_array_append_new(fields, field_object(&state->fields[i]));
        text = print(json_pack("{s:{s:s,s:I,s:s,s:I,s:b,s:o}}", "object", "kind",
                               protocol_object_kind_text(state->kind), "id", (json_int_t)state->id, "name",
                               state->name, "revision", (json_int_t)state->revision, "display_values",
                               display_values, "fields", fields),
                     error);
    }
    free(state);
    return text;
}

/* ---- changing ---- */

static char *describe_edited(const struct edit_history *history, const struct fl_edited *edited,
                             struct fl_error *error)
{
    return print(json_pack("{s:{s:I,s:I,s:I,s:I}}", "edited", "revision", (json_int_t)edited->revision, "objects",
                           (json_int_t)edited->objects, "undos", (json_int_t)history->undo_count, "redos",
                           (json_int_t)history->redo_count),
                 error);
}

static char *edit(struct edit_history *history, struct fl_scene *scene, const struct web_request *request,
                  struct fl_error *error)
{
    struct fl_edited edited = {0};
    if (!fl_scene_edit(scene, &request->assignment, 1, &edited, error)) {
        free(edited.undo);
        return NULL;
    }
    edit_history_add(history, edited.undo, edited.undo_count);
    return describe_edited(history, &edited, error);
}

/* Undoes or redoes a change. A change that cannot be undone, because its object was removed, is dropped. */
static char *undo(struct edit_history *history, struct fl_scene *scene, bool redo, struct fl_error *error)
{
    struct fl_edited edited = {0};
    struct edit_change change;
    if (!edit_history_take(history, redo, &change)) {
        fl_error_set(error, FL_ERROR_ARGUMENT, redo ? "redo" : "undo", "there is no change to %s",
                     redo ? "redo" : "undo");
        return NULL;
    }
    const bool is_done = fl_scene_edit(scene, change.list, change.count, &edited, error);
    free(change.list);
    edit_history_took(history, redo, edited.undo, edited.undo_count);
    return is_done ? describe_edited(history, &edited, error) : NULL;
}

char *web_editing_answer(struct edit_history *history, struct fl_scene *scene, const struct web_request *request,
                         struct fl_error *error)
{
    switch (request->kind) {
    case WEB_LIST:
        return list(scene, request, error);
    case WEB_READ:
        return read_one(scene, request, error);
    case WEB_EDIT:
        return edit(history, scene, request, error);
    case WEB_UNDO:
    case WEB_REDO:
        return undo(history, scene, request->kind == WEB_REDO, error);
    default:
        fl_error_set(error, FL_ERROR_ARGUMENT, "edit", "this request changes and reads nothing of the scene");
        return NULL;
    }
}
