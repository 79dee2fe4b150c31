/* SPDX-License-Identifier: MIT */
/* farlight edit: changes objects of a shared scene, for all attached clients. */
#include "commands.h"
#include "options/daemon.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/talk.h"
#include "lib/text.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum key { KEY_SCENE = 0x400, KEY_FROM, KEY_LIST, KEY_JSON, KEY_PRINT_UNDO };

#define LINE_MAX_BYTES 1024u
#define ASSIGNMENTS_MAX 65536u
#define NARROW 4u      /* number of values of a field that a list shows */
#define NO_LIMIT 50000 /* wider ranges are not shown */

struct editing {
    struct cli_daemon daemon;
    const char *scene;
    const char **words; /* assignments as typed, or objects for `list`; owned */
    size_t word_count;
    const char *from; /* NULL: none */
    bool list, json, print_undo;
    struct fl_assignment *assignments; /* owned */
    size_t assignment_count;
    struct cli_job job; /* holds an option's error */
};

static const struct argp_option options[] = {
    {"scene", KEY_SCENE, "NAME", 0, "Edit this scene ('farlight scenes' lists them)", 0},
    {"from", KEY_FROM, "FILE", 0, "Read assignments from this file, one a line; '-' is standard input", 0},
    {"list", KEY_LIST, NULL, 0,
     "List the objects that can be edited, or the fields and values of the named objects", 0},
    {"json", KEY_JSON, NULL, 0, "With --list: print one JSON object per line", 0},
    {"print-undo", KEY_PRINT_UNDO, NULL, 0, "Print assignments that undo the edit, for --from", 0},
    {0}};

static const struct argp_child children[] = {{&cli_daemon_argp, 0, NULL, 0}, {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct editing *editing = state->input;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &editing->daemon;
        return 0;
    case KEY_SCENE:
        editing->scene = value;
        return 0;
    case KEY_FROM:
        editing->from = value;
        return 0;
    case KEY_LIST:
        editing->list = true;
        return 0;
    case KEY_JSON:
        editing->json = true;
        return 0;
    case KEY_PRINT_UNDO:
        editing->print_undo = true;
        return 0;
    case ARGP_KEY_ARG:
        editing->words[editing->word_count++] = value; /* has space for every argument */
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* ---- assignments ---- */

static bool add_assignment(struct editing *editing, const char *text, const char *file, unsigned line,
                           struct fl_error *error)
{
    struct fl_assignment *grown = NULL;
    if (editing->assignment_count == ASSIGNMENTS_MAX)
        return fl_error_set(error, FL_ERROR_ARGUMENT, file, "there are more than %u assignments", ASSIGNMENTS_MAX);
    if ((editing->assignment_count & (editing->assignment_count - 1)) == 0) {
        const size_t capacity = editing->assignment_count > 0 ? 2 * editing->assignment_count : 1;
        grown = realloc(editing->assignments, capacity * sizeof(*grown));
        if (!grown)
            return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        editing->assignments = grown;
    }
    if (fl_assignment_parse(text, &editing->assignments[editing->assignment_count], error)) {
        editing->assignment_count++;
        return true;
    }
    if (file[0] != '\0') {
        char field[sizeof(error->field)];
        memcpy(field, error->field, sizeof(field));
        snprintf(error->field, sizeof(error->field), "%.60s:%u: %.80s", file, line, field);
    }
    return false;
}

/* Cuts off the end of the line, and a comment: "#" at the beginning, or between blanks. */
static char *strip_line(char *line)
{
    char *start = line;
    while (isspace((unsigned char)*start))
        start++;
    for (char *at = start; *at != '\0'; at++)
        if (*at == '\n' || *at == '\r' ||
            (*at == '#' && (at == start || (isspace((unsigned char)at[-1]) && isspace((unsigned char)at[1])))))
            *at-- = '\0';
    return start;
}

static bool read_lines(struct editing *editing, FILE *stream, const char *name, struct fl_error *error)
{
    char line[LINE_MAX_BYTES + 2];
    for (unsigned number = 1; fgets(line, sizeof(line), stream); number++) {
        if (strlen(line) == sizeof(line) - 1 && line[sizeof(line) - 2] != '\n')
            return fl_error_set(error, FL_ERROR_ARGUMENT, name, "line %u has more than %u bytes", number,
                                LINE_MAX_BYTES);
        const char *text = strip_line(line);
        if (text[0] != '\0' && !add_assignment(editing, text, name, number, error))
            return false;
    }
    return !ferror(stream) || fl_error_set(error, FL_ERROR_FILE, name, "cannot be read: %s", strerror(errno));
}

static bool read_file(struct editing *editing, struct fl_error *error)
{
    if (strcmp(editing->from, "-") == 0)
        return read_lines(editing, stdin, "standard input", error);
    FILE *stream = fopen(editing->from, "re");
    if (!stream)
        return fl_error_set(error, FL_ERROR_FILE, editing->from, "cannot be read: %s", strerror(errno));
    const bool read = read_lines(editing, stream, editing->from, error);
    fclose(stream);
    return read;
}

static bool read_assignments(struct editing *editing, struct fl_error *error)
{
    if (editing->from && !read_file(editing, error))
        return false;
    for (size_t i = 0; i < editing->word_count; i++)
        if (!add_assignment(editing, editing->words[i], "", 0, error))
            return false;
    if (editing->assignment_count > 0)
        return true;
    fl_error_set(error, FL_ERROR_ARGUMENT, editing->from ? editing->from : "", "there is nothing to change");
    return fl_error_remedy(error, "write material.Steel.roughness=0.2 or hide=Roof; --list shows all objects");
}

static bool edit(const struct editing *editing, struct fl_scene *scene, struct fl_error *error)
{
    struct fl_edited edited;
    if (!fl_scene_edit(scene, editing->assignments, editing->assignment_count, &edited, error))
        return false;
    for (size_t i = 0; editing->print_undo && i < edited.undo_count; i++) {
        char text[LINE_MAX_BYTES];
        printf("%s\n", fl_assignment_print(&edited.undo[i], text, sizeof(text)));
    }
    free(edited.undo);
    return true;
}

/* ---- the list ---- */

static const enum protocol_object_kind listed_kinds[] = {PROTOCOL_OBJECT_MATERIAL, PROTOCOL_OBJECT_LIGHT,
                                                         PROTOCOL_OBJECT_CAMERA, PROTOCOL_OBJECT_NODE,
                                                         PROTOCOL_OBJECT_ENVIRONMENT};

static json_t *object_json(enum protocol_object_kind kind, uint32_t id, const char *name)
{
    json_t *text = json_string(name);
    return json_pack("{s:s,s:I,s:o}", "kind", protocol_object_kind_text(kind), "id", (json_int_t)id, "name",
                     text ? text : json_string(""));
}

static void print_json(json_t *object)
{
    json_dumpf(object, stdout, CLI_JSON | JSON_REAL_PRECISION(9));
    fputc('\n', stdout);
    json_decref(object);
}

static bool list_names(struct fl_scene *scene, bool json, struct fl_error *error)
{
    for (size_t k = 0; k < sizeof(listed_kinds) / sizeof(listed_kinds[0]); k++) {
        const enum protocol_object_kind kind = listed_kinds[k];
        struct fl_object *objects = NULL;
        size_t count = 0;
        if (!fl_scene_objects(scene, kind, &objects, &count, error))
            return false;
        for (size_t i = 0; i < count; i++) {
            if (json) {
                print_json(object_json(kind, objects[i].id, objects[i].name));
                continue;
            }
            printf("%-11s %6zu  #%-8" PRIu32 "  ", protocol_object_kind_text(kind), i, objects[i].id);
            cli_print_name(objects[i].name);
            putchar('\n');
        }
        free(objects);
    }
    return true;
}

static json_t *value_json(const struct fl_field_value *value)
{
    const struct fl_field *field = &value->field;
    if (field->form == FL_FIELD_FLAG)
        return json_boolean(value->values[0] != 0);
    if (field->form == FL_FIELD_WORD)
        return json_string(fl_field_word(field, (unsigned)value->values[0]));
    if (field->count == 1)
        return json_real(value->values[0]);
    json_t *array = json_array();
    for (unsigned i = 0; i < field->count; i++)
        json_array_append_new(array, json_real(value->values[i]));
    return array;
}

static void print_state_json(const struct fl_object_state *state)
{
    json_t *object = object_json(state->kind, state->id, state->name), *fields = json_object();
    for (size_t i = 0; i < state->count; i++) {
        const struct fl_field *field = &state->fields[i].field;
        json_t *one = json_pack("{s:o,s:s,s:s}", "value", value_json(&state->fields[i]), "unit", field->unit,
                                "doc", field->doc);
        if (field->form == FL_FIELD_NUMBERS || field->form == FL_FIELD_COLOUR) {
            json_object_set_new(one, "min", json_real(field->min));
            json_object_set_new(one, "max", json_real(field->max));
        }
        json_object_set_new(fields, field->name, one);
    }
    json_object_set_new(object, "fields", fields);
    print_json(object);
}

/* True if the name alone selects this object. */
static bool is_known_by_name(struct fl_scene *scene, const struct fl_object_state *state)
{
    const size_t length = strlen(state->name);
    uint32_t *ids = NULL;
    size_t count = 0;
    if (length == 0 || isspace((unsigned char)state->name[0]) || isspace((unsigned char)state->name[length - 1]) ||
        state->name[0] == '#' || strpbrk(state->name, "*=\n\r") || strstr(state->name, " # "))
        return false;
    const bool found = fl_scene_find_objects(scene, state->kind, state->name, &ids, &count, NULL) && count == 1 &&
                       ids[0] == state->id;
    free(ids);
    return found;
}

/* Prints the fields as assignments, so that the list can be edited and read by --from. */
static void print_state(struct fl_scene *scene, const struct fl_object_state *state)
{
    const bool by_name = is_known_by_name(scene, state);
    printf("# %s #%" PRIu32 " ", protocol_object_kind_text(state->kind), state->id);
    cli_print_name(state->name);
    putchar('\n');
    for (size_t i = 0; i < state->count; i++) {
        const struct fl_field_value *value = &state->fields[i];
        const struct fl_field *field = &value->field;
        struct fl_assignment assignment = {
            .kind = state->kind, .id = by_name ? 0 : state->id, .count = field->count};
        char text[LINE_MAX_BYTES];
        if (field->count > NARROW)
            continue;
        memcpy(assignment.which, state->name, sizeof(assignment.which));
        memcpy(assignment.field, field->name, sizeof(assignment.field));
        memcpy(assignment.values, value->values, sizeof(assignment.values));
        printf("%-48s", fl_assignment_print(&assignment, text, sizeof(text)));
        if (field->max < NO_LIMIT && (field->form == FL_FIELD_NUMBERS || field->form == FL_FIELD_COLOUR))
            printf(" # %g to %g%s%s", field->min, field->max, field->unit[0] != '\0' ? " " : "", field->unit);
        else if (field->unit[0] != '\0')
            printf(" # %s", field->unit);
        putchar('\n');
    }
}

/* Lists "material.Steel", "node.*", "environment". */
static bool list_fields(const struct editing *editing, struct fl_scene *scene, const char *word,
                        struct fl_error *error)
{
    const char *dot = strchr(word, '.');
    char kind_name[32];
    enum protocol_object_kind kind = PROTOCOL_OBJECT_COUNT;
    uint32_t *ids = NULL;
    size_t count = 0;
    snprintf(kind_name, sizeof(kind_name), "%.*s", (int)strcspn(word, "."), word);
    struct fl_field fields[FL_FIELDS_MAX];
    if (!protocol_object_kind_parse(kind_name, &kind) || fl_fields(kind, fields) == 0 ||
        (kind == PROTOCOL_OBJECT_ENVIRONMENT) == (dot != NULL)) {
        fl_error_set(error, FL_ERROR_ARGUMENT, word, "is no object that can be edited");
        return fl_error_remedy(error, "write it like material.Steel, node.*, light.#2, camera.0 or environment");
    }
    if (!fl_scene_find_objects(scene, kind, dot ? dot + 1 : "", &ids, &count, error)) {
        snprintf(error->field, sizeof(error->field), "%s", word);
        return false;
    }
    bool good = true;
    for (size_t i = 0; good && i < count; i++) {
        struct fl_object_state state;
        good = fl_scene_read(scene, kind, ids[i], &state, error);
        if (good && editing->json)
            print_state_json(&state);
        else if (good)
            print_state(scene, &state);
    }
    free(ids);
    return good;
}

static bool list(const struct editing *editing, struct fl_scene *scene, struct fl_error *error)
{
    if (editing->word_count == 0)
        return list_names(scene, editing->json, error);
    for (size_t i = 0; i < editing->word_count; i++)
        if (!list_fields(editing, scene, editing->words[i], error))
            return false;
    return true;
}

/* ---- the command ---- */

static bool complete(struct editing *editing, struct fl_error *error)
{
    if (!editing->scene) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--scene", "no scene is given");
        return fl_error_remedy(error, "'farlight scenes' lists them");
    }
    if (!editing->list)
        return read_assignments(editing, error);
    if (editing->from)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "--from", "cannot be combined with --list");
    return true;
}

static bool run(struct editing *editing, struct fl_error *error)
{
    if (!complete(editing, error))
        return false;
    struct fl_connection *connection = cli_daemon_connect(&editing->daemon, "farlight edit", true, error);
    struct fl_scene *scene = connection ? fl_scene_attach(connection, editing->scene, error) : NULL;
    const bool done = scene && (editing->list ? list(editing, scene, error) : edit(editing, scene, error));
    fl_scene_destroy(scene);
    fl_connection_destroy(connection);
    return done;
}

int cli_edit(int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .children = children,
        .args_doc = "--scene NAME ASSIGNMENT...\n--scene NAME --from FILE\n--scene NAME --list [OBJECT...]",
        .doc = "Change materials, nodes, lights, cameras and the environment of a shared scene, for all its "
               "clients, in one transaction.\v"
               "An ASSIGNMENT is material.Steel.roughness=0.2, node.Door.rotate=0,30,0, 'light.Sun.intensity*=2', "
               "environment.rotation=90, hide=Roof or show=Roof. Names may have '*'; numbers and #identifiers "
               "name objects, too."};
    struct editing editing = {0};
    struct fl_error error = {0};
    editing.words = calloc((size_t)argc + 1, sizeof(*editing.words));
    int status = CLI_DONE;
    if (!editing.words) {
        fl_error_set(&error, FL_ERROR_MEMORY, "", "out of memory");
        status = cli_report(&error);
    } else if (cli_parse(&argp, argc, argv, 0, &editing) != 0) {
        status = cli_report(&editing.job.error);
    } else if (!run(&editing, &error)) {
        status = cli_report(&error);
    }
    free(editing.assignments);
    free(editing.words);
    return status;
}
