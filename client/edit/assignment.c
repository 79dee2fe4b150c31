/* SPDX-License-Identifier: MIT */
/* Assignments in the syntax that people write. Names may have any characters: the object of
 * "material.A.B=C.roughness=1" is "A.B=C", as the field is the last word before the first equals sign that
 * follows a field. */
#include "edit/field.h"
#include "lib/text.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#define TEXT_MAX 1024u

static const enum protocol_object_kind kinds[] = {PROTOCOL_OBJECT_MATERIAL, PROTOCOL_OBJECT_NODE,
                                                  PROTOCOL_OBJECT_LIGHT, PROTOCOL_OBJECT_CAMERA,
                                                  PROTOCOL_OBJECT_ENVIRONMENT};

/* ---- reading ---- */

/* The parts of an assignment, cut in place. */
struct parts {
    char text[TEXT_MAX];
    const char *kind, *name, *field, *value;
    enum fl_assignment_way way;
};

static char *trimmed(char *text)
{
    size_t length;
    while (isspace((unsigned char)*text))
        text++;
    length = strlen(text);
    while (length > 0 && isspace((unsigned char)text[length - 1]))
        text[--length] = '\0';
    return text;
}

static bool wrong_form(struct fl_error *error)
{
    fl_error_set(error, FL_ERROR_ARGUMENT, "", "is no assignment");
    return fl_error_remedy(error, "write it like material.Steel.roughness=0.2, node.Door.rotate=0,30,0, "
                                  "light.Sun.intensity=5, environment.rotation=90, hide=Roof or show=Roof");
}

/* The operator of an assignment at its equals sign, and the end of the text before it. */
static enum fl_assignment_way way_of(char *text, char *equals, char **end)
{
    const bool has_sign = equals > text && (equals[-1] == '+' || equals[-1] == '*');
    *end = has_sign ? equals - 1 : equals;
    while (*end > text && isspace((unsigned char)(*end)[-1]))
        (*end)--;
    return !has_sign ? FL_ASSIGN : equals[-1] == '+' ? FL_ASSIGN_SUM : FL_ASSIGN_PRODUCT;
}

/* The last dot before `end`, or NULL. */
static char *dot_before(char *text, char *end)
{
    while (end > text && end[-1] != '.')
        end--;
    return end > text ? end - 1 : NULL;
}

/* Splits "intensity=2" of the environment, which has no name. */
static void split_nameless(struct parts *parts, char *text)
{
    char *equals = strchr(text, '='), *end;
    parts->way = way_of(text, equals, &end);
    parts->value = trimmed(equals + 1);
    *end = '\0';
    parts->name = "";
    parts->field = trimmed(text);
}

/* Finds the value's equals sign: the first one after a known field, else the first one. */
static char *find_equals(enum protocol_object_kind kind, char *text)
{
    for (char *equals = strchr(text, '='); equals; equals = strchr(equals + 1, '=')) {
        char *end;
        struct fl_field field;
        char name[sizeof(field.name)];
        way_of(text, equals, &end);
        const char *dot = dot_before(text, end);
        if (!dot || end - dot > (ptrdiff_t)sizeof(name))
            continue;
        snprintf(name, sizeof(name), "%.*s", (int)(end - dot - 1), dot + 1);
        if (edit_field_find(kind, name, &field, NULL))
            return equals;
    }
    return strchr(text, '=');
}

static bool find_kind(const char *text, enum protocol_object_kind *kind, struct fl_error *error)
{
    struct fl_nearest nearest = {0};
    for (size_t i = 0; i < sizeof(kinds) / sizeof(kinds[0]); i++) {
        if (strcmp(protocol_object_kind_text(kinds[i]), text) == 0) {
            *kind = kinds[i];
            return true;
        }
        fl_nearest_try(&nearest, text, protocol_object_kind_text(kinds[i]));
    }
    fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is no kind of object that can be edited", text);
    if (nearest.name)
        return fl_error_remedy(error, "did you mean '%s'?", nearest.name);
    return fl_error_remedy(error, "material, node, light, camera and environment can");
}

/* Splits "hide=Roof" and "show=Roof". */
static bool split_visibility(struct parts *parts, char *text)
{
    const size_t length = strcspn(text, "=");
    const bool hides = strncmp(text, "hide", 4) == 0;
    if (text[length] != '=' || length < 4 || (!hides && strncmp(text, "show", 4) != 0) ||
        strspn(text + 4, " \t") != length - 4)
        return false;
    parts->kind = "node";
    parts->name = trimmed(text + length + 1);
    parts->field = "hidden";
    parts->value = hides ? "1" : "0";
    return true;
}

static bool split(struct parts *parts, enum protocol_object_kind *kind, struct fl_error *error)
{
    char *text = trimmed(parts->text);
    *kind = PROTOCOL_OBJECT_NODE;
    if (split_visibility(parts, text))
        return true;
    char *first = strchr(text, '.');
    if (!first || !strchr(text, '=') || strchr(text, '=') < first)
        return wrong_form(error);
    *first = '\0';
    parts->kind = trimmed(text);
    if (!find_kind(parts->kind, kind, error))
        return false;
    if (*kind == PROTOCOL_OBJECT_ENVIRONMENT) {
        split_nameless(parts, first + 1);
        return true;
    }
    char *rest = first + 1, *equals = find_equals(*kind, rest), *end;
    parts->way = way_of(rest, equals, &end);
    char *last = dot_before(rest, end);
    if (!last)
        return wrong_form(error);
    parts->value = trimmed(equals + 1);
    *end = *last = '\0';
    parts->name = trimmed(rest);
    parts->field = last + 1;
    return true;
}

static bool read_flag(const char *text, double *value)
{
    static const char *const words[] = {"0", "1", "false", "true", "no", "yes", "off", "on"};
    for (size_t i = 0; i < sizeof(words) / sizeof(words[0]); i++)
        if (strcmp(text, words[i]) == 0) {
            *value = i % 2 == 1 ? 1 : 0;
            return true;
        }
    return false;
}

static bool read_word(const struct fl_field *field, const char *text, double *value, struct fl_error *error)
{
    char list[200];
    size_t used = 0;
    list[0] = '\0';
    for (unsigned number = 0; number <= (unsigned)field->max; number++) {
        const char *word = fl_field_word(field, number);
        if (word && strcmp(word, text) == 0) {
            *value = number;
            return true;
        }
        if (word && used < sizeof(list))
            used += (size_t)snprintf(list + used, sizeof(list) - used, "%s%s", used > 0 ? ", " : "", word);
    }
    fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is no %s", text, field->name);
    return fl_error_remedy(error, "use one of %s", list);
}

static bool read_numbers(const struct fl_field *field, const char *text, struct fl_assignment *assignment,
                         struct fl_error *error)
{
    unsigned count = 0;
    for (const char *at = text;; at++) {
        char number[64];
        const size_t length = strcspn(at, ",");
        snprintf(number, sizeof(number), "%.*s", (int)(length < sizeof(number) ? length : sizeof(number)), at);
        if (count == FL_FIELD_VALUES_MAX || length >= sizeof(number) ||
            !fl_text_real(trimmed(number), -1e15, 1e15, &assignment->values[count++], NULL))
            break;
        at += length;
        if (*at != '\0')
            continue;
        assignment->count = count;
        if (edit_field_takes(field, count))
            return true;
        break;
    }
    fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is not a valid value of %s", text, field->name);
    if (field->count == 1)
        return fl_error_remedy(error, "give a number");
    return fl_error_remedy(error, "give %u numbers, with commas in between%s%s", field->count,
                           edit_field_takes(field, 1) ? ", or one for all" : "",
                           field->form == FL_FIELD_COLOUR ? ", or a colour such as #ff8000" : "");
}

static bool read_values(const struct fl_field *field, const char *text, struct fl_assignment *assignment,
                        struct fl_error *error)
{
    float colour[3];
    assignment->count = 1;
    if (field->form == FL_FIELD_WORD)
        return read_word(field, text, &assignment->values[0], error);
    if (field->form == FL_FIELD_FLAG) {
        if (read_flag(text, &assignment->values[0]))
            return true;
        fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' does not say whether it is %s", text, field->name);
        return fl_error_remedy(error, "use true or false");
    }
    if (field->form != FL_FIELD_COLOUR || text[0] != '#')
        return read_numbers(field, text, assignment, error);
    if (!fl_text_colour(text, colour, error))
        return false;
    assignment->count = 3;
    for (int i = 0; i < 3; i++)
        assignment->values[i] = (double)colour[i];
    return true;
}

static bool read_parts(const struct parts *parts, struct fl_assignment *assignment, struct fl_error *error)
{
    struct fl_field field;
    if (parts->name[0] == '\0' && assignment->kind != PROTOCOL_OBJECT_ENVIRONMENT)
        return wrong_form(error);
    if (strlen(parts->name) >= sizeof(assignment->which))
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "the name has more than %zu bytes",
                            sizeof(assignment->which) - 1);
    snprintf(assignment->which, sizeof(assignment->which), "%s", parts->name);
    if (!edit_field_find(assignment->kind, parts->field, &field, error))
        return false;
    snprintf(assignment->field, sizeof(assignment->field), "%s", field.name);
    assignment->way = parts->way;
    if (!read_values(&field, parts->value, assignment, error))
        return false;
    if (assignment->way == FL_ASSIGN)
        return edit_field_check(&field, assignment->values, assignment->count, error);
    if (field.form != FL_FIELD_FLAG && field.form != FL_FIELD_WORD)
        return true;
    return fl_error_set(error, FL_ERROR_ARGUMENT, "", "%s is no number: it can only be set", field.name);
}

bool fl_assignment_parse(const char *text, struct fl_assignment *assignment, struct fl_error *error)
{
    struct parts parts = {.way = FL_ASSIGN};
    struct fl_error why = {0};
    *assignment = (struct fl_assignment){0};
    if (strlen(text) >= sizeof(parts.text))
        fl_error_set(&why, FL_ERROR_ARGUMENT, "", "has more than %u bytes", TEXT_MAX - 1);
    else
        snprintf(parts.text, sizeof(parts.text), "%s", text);
    if (why.code == FL_ERROR_NONE && split(&parts, &assignment->kind, &why) &&
        read_parts(&parts, assignment, &why))
        return true;
    fl_text_utf8(text, why.field, sizeof(why.field));
    if (error)
        *error = why;
    return false;
}

/* ---- writing ---- */

struct line {
    char *text;
    size_t bytes, used;
};

static void append(struct line *line, const char *text)
{
    for (; *text != '\0' && line->used + 1 < line->bytes; text++)
        line->text[line->used++] = *text;
    line->text[line->used] = '\0';
}

/* Prints as few digits as the float needs, with a point in every locale. */
static void append_number(struct line *line, double value)
{
    char number[32];
    double read = 0;
    for (int digits = 6; digits <= 9; digits++) {
        snprintf(number, sizeof(number), "%.*g", digits, value + 0.0); /* avoids -0 */
        if (strchr(number, ','))
            *strchr(number, ',') = '.';
        if (fl_text_real(number, -1e30, 1e30, &read, NULL) && (float)read == (float)value)
            break;
    }
    append(line, number);
}

static void append_values(struct line *line, const struct fl_assignment *assignment)
{
    struct fl_field field;
    const bool known = edit_field_find(assignment->kind, assignment->field, &field, NULL);
    for (unsigned i = 0; i < assignment->count && i < FL_FIELD_VALUES_MAX; i++) {
        const char *word = known ? fl_field_word(&field, (unsigned)assignment->values[i]) : NULL;
        append(line, i > 0 ? "," : "");
        if (word)
            append(line, word);
        else
            append_number(line, assignment->values[i]);
    }
}

const char *fl_assignment_print(const struct fl_assignment *assignment, char *text, size_t text_bytes)
{
    static const char *const signs[] = {[FL_ASSIGN] = "=", [FL_ASSIGN_SUM] = "+=", [FL_ASSIGN_PRODUCT] = "*="};
    struct line line = {.text = text, .bytes = text_bytes};
    char id[16];
    if (text_bytes == 0)
        return text;
    text[0] = '\0';
    snprintf(id, sizeof(id), "#%u", assignment->id);
    append(&line, protocol_object_kind_text(assignment->kind));
    append(&line, ".");
    if (assignment->kind != PROTOCOL_OBJECT_ENVIRONMENT) {
        append(&line, assignment->id > 0 ? id : assignment->which);
        append(&line, ".");
    }
    append(&line, assignment->field);
    append(&line, (unsigned)assignment->way <= FL_ASSIGN_PRODUCT ? signs[assignment->way] : "=");
    append_values(&line, assignment);
    return text;
}
