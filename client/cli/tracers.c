/* SPDX-License-Identifier: MIT */
/* farlight tracers: lists every tracer and its settings, for people, for scripts, and for the build, which
 * makes the manual and the schema of shot files from it. farlight complete: serves the shell's completion. */
#include "options/fields.h"
#include "commands.h"
#include "options/parse.h"
#include "options/talk.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define WHOLE_MAX 9007199254740992.0 /* largest number that JSON holds exactly */

/* ---- for people ---- */

static void print_setting(const struct cli_field *setting)
{
    printf("  --%-20s %s\n", setting->option, setting->help);
    if (setting->field->kind != FIELD_ENUM)
        return;
    for (size_t i = 0; i < setting->field->enumeration->value_count; i++) {
        const struct value_desc *value = &setting->field->enumeration->values[i];
        printf("    %-20s %s\n", value->text, value->doc);
    }
}

static void print_text(void)
{
    for (size_t i = 0; i < tracer_desc_count; i++) {
        const struct tracer_desc *tracer = &tracer_descs[i];
        printf("%s%s: %s%s%s\n", i > 0 ? "\n" : "", tracer->name, tracer->doc,
               tracer->needs[0] != '\0' ? "; in builds with " : "", tracer->needs);
        for (size_t k = 0; k < cli_field_count(); k++) {
            const struct cli_field *setting = cli_field_at(k);
            if (setting->field->tracer && strcmp(setting->field->tracer, tracer->name) == 0)
                print_setting(setting);
        }
    }
}

/* ---- for scripts ---- */

static json_t *numbers_json(const char *numbers)
{
    json_t *list = json_array();
    for (const char *at = numbers; *at != '\0'; at += strspn(at, ", ")) {
        char *end = NULL;
        json_array_append_new(list, json_integer(strtoll(at, &end, 10)));
        at = end;
    }
    return list;
}

static json_t *choices_json(const struct enum_desc *choices)
{
    json_t *list = json_array();
    for (size_t i = 0; i < choices->value_count; i++)
        json_array_append_new(
            list, json_pack("{s:s, s:s}", "name", choices->values[i].text, "doc", choices->values[i].doc));
    return list;
}

static json_t *setting_json(const struct cli_field *setting)
{
    char usual[32], option[64];
    const struct field_desc *field = setting->field;
    const bool is_auto = field->zero_is_default && field->default_int == 0;
    snprintf(option, sizeof(option), "--%s", setting->option);
    json_t *object = json_pack("{s:s, s:s, s:s, s:s}", "name", setting->member, "option", option, "unit",
                               field->unit ? field->unit : "", "doc", field->doc);
    field_default_text(field, usual, sizeof(usual));
    if (field->kind == FIELD_ENUM) {
        json_object_set_new(object, "choices", choices_json(field->enumeration));
        json_object_set_new(object, "default", json_string(usual));
    } else if (field->kind == FIELD_REAL) {
        json_object_set_new(object, "minimum", json_real((double)field->real_min));
        json_object_set_new(object, "maximum", json_real((double)field->real_max));
        json_object_set_new(object, "default", json_real((double)field->default_real));
    } else {
        json_object_set_new(object, "default",
                            is_auto ? json_string(usual) : json_integer((json_int_t)field->default_int));
        if (field->numbers) {
            json_object_set_new(object, "numbers", numbers_json(field->numbers));
        } else {
            json_object_set_new(object, "minimum", json_integer((json_int_t)field->min));
            json_object_set_new(object, "maximum", json_integer((json_int_t)field->max));
        }
    }
    return object;
}

static void print_json(json_t *value)
{
    json_dumpf(value, stdout, JSON_INDENT(2));
    putchar('\n');
    json_decref(value);
}

static json_t *tracers_json(void)
{
    json_t *tracers = json_array();
    for (size_t i = 0; i < tracer_desc_count; i++) {
        const struct tracer_desc *tracer = &tracer_descs[i];
        json_t *settings = json_array();
        for (size_t k = 0; k < cli_field_count(); k++) {
            const struct cli_field *setting = cli_field_at(k);
            if (setting->field->tracer && strcmp(setting->field->tracer, tracer->name) == 0)
                json_array_append_new(settings, setting_json(setting));
        }
        json_array_append_new(tracers, json_pack("{s:s, s:s, s:s, s:b, s:o}", "name", tracer->name, "doc",
                                                 tracer->doc, "needs", tracer->needs, "for_tests",
                                                 tracer->is_for_tests, "settings", settings));
    }
    return json_pack("{s:o}", "tracers", tracers);
}

/* ---- the schema of shot files ---- */

/* Names of values that a batch allows. */
static json_t *names_json(const struct field_desc *field)
{
    json_t *names = json_array();
    for (size_t i = 0; i < field->enumeration->value_count; i++)
        if (strcmp(field->name, "encoding") != 0 || field->enumeration->values[i].number != PROTOCOL_ENCODING_H264)
            json_array_append_new(names, json_string(field->enumeration->values[i].text));
    return names;
}

static json_t *whole_json(const struct field_desc *field)
{
    const double maximum = (double)field->max < WHOLE_MAX ? (double)field->max : WHOLE_MAX;
    return json_pack("{s:s, s:I, s:I}", "type", "integer", "minimum", (json_int_t)field->min, "maximum",
                     (json_int_t)maximum);
}

static json_t *member_json(const struct cli_field *member)
{
    const struct field_desc *field = member->field;
    json_t *object = NULL;
    if (field->kind == FIELD_ENUM) {
        object = json_pack("{s:o}", "enum", names_json(field));
    } else if (field->kind == FIELD_REAL) {
        object = json_pack("{s:s, s:f, s:f}", "type", "number", "minimum", (double)field->real_min, "maximum",
                           (double)field->real_max);
    } else if (field->numbers) {
        json_t *numbers = numbers_json(field->numbers);
        json_array_insert_new(numbers, 0, json_integer(0));
        if (field->default_int == 0)
            json_array_insert_new(numbers, 0, json_string("auto"));
        object = json_pack("{s:o}", "enum", numbers);
    } else if (field->zero_is_default) {
        object = json_pack("{s:[{s:i}, o]}", "anyOf", "const", 0, whole_json(field));
    } else {
        object = whole_json(field);
    }
    json_object_set_new(object, "description", json_string(member->help));
    return object;
}

/* Prints a member of the object `properties`, each on a line. */
static void print_member(const char *name, json_t *object)
{
    char *text = json_dumps(object, 0);
    printf("    \"%s\": %s,\n", name, text ? text : "{}");
    free(text);
    json_decref(object);
}

/* Words of --layers. */
static json_t *layers_json(void)
{
    char list[512];
    char *rest;
    protocol_enum_list("layer", list, sizeof(list));
    json_t *names = json_pack("[s]", "light"); /* stands for all light layers */
    for (char *word = strtok_r(list, ", ", &rest); word; word = strtok_r(NULL, ", ", &rest))
        json_array_append_new(names, json_string(word));
    return json_pack("{s:s, s:s, s:i, s:{s:o}}", "description", "of an EXR file; default: beauty alone", "type",
                     "array", "minItems", 1, "items", "enum", names);
}

static void print_schema(void)
{
    print_member("layers", layers_json());
    for (size_t i = 0; i < cli_field_count(); i++) {
        const struct cli_field *member = cli_field_at(i);
        if (!member->is_of_shot)
            continue;
        print_member(member->member, member_json(member));
    }
}

/* ---- the manual ---- */

static void print_manual_setting(const struct cli_field *setting)
{
    printf(".It Fl -%s Ar %s\n%s.\n", setting->option, setting->argument, setting->help);
    if (setting->field->kind != FIELD_ENUM)
        return;
    printf(".Bl -tag -width overlap -compact\n");
    for (size_t i = 0; i < setting->field->enumeration->value_count; i++) {
        const struct value_desc *value = &setting->field->enumeration->values[i];
        printf(".It Cm %s\n%s\n", value->text, value->doc);
    }
    printf(".El\n");
}

/* Prints items of the list of options: all tracers, then settings. */
static void print_manual(void)
{
    printf(".It Fl -tracer Ar NAME\nAlgorithm that finds intersections; the default is\n.Cm %s .\n.Bl -tag -width "
           "reference -compact\n",
           tracer_descs[0].name);
    for (size_t i = 0; i < tracer_desc_count; i++)
        printf(".It Cm %s\n%s%s%s\n", tracer_descs[i].name, tracer_descs[i].doc,
               tracer_descs[i].needs[0] != '\0' ? "; in builds with " : "", tracer_descs[i].needs);
    printf(".El\n");
    for (size_t i = 0; i < cli_field_count(); i++)
        if (cli_field_at(i)->field->tracer)
            print_manual_setting(cli_field_at(i));
}

/* ---- the commands ---- */

enum key { KEY_JSON = 0x400, KEY_SCHEMA, KEY_MANUAL };

static const struct argp_option options[] = {
    {"json", KEY_JSON, NULL, 0, "Print one JSON object", 0},
    {"schema", KEY_SCHEMA, NULL, OPTION_HIDDEN, "For the build: members of the schema of shot files", 0},
    {"manual", KEY_MANUAL, NULL, OPTION_HIDDEN, "For the build: items of the manual page", 0},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    (void)value;
    if (key != KEY_JSON && key != KEY_SCHEMA && key != KEY_MANUAL)
        return ARGP_ERR_UNKNOWN;
    *(int *)state->input = key;
    return 0;
}

int cli_tracers(int argc, char **argv)
{
    static const struct argp argp = {.options = options,
                                     .parser = parse,
                                     .doc =
                                         "List the tracers and all their settings.\v"
                                         "Settings are options of render, animate, view and compare, members of "
                                         "shot files, and variables such as FARLIGHT_LDC_RESOLUTION."};
    int form = 0;
    if (cli_parse(&argp, argc, argv, 0, &form) != 0)
        return CLI_USAGE;
    if (form == KEY_JSON)
        print_json(tracers_json());
    else if (form == KEY_SCHEMA)
        print_schema();
    else if (form == KEY_MANUAL)
        print_manual();
    else
        print_text();
    return CLI_DONE;
}

/* Prints every pair, "bvh,reference" and so on. */
static void print_pairs(void)
{
    for (size_t a = 0; a < tracer_desc_count; a++)
        for (size_t b = 0; b < tracer_desc_count; b++)
            if (a != b)
                printf("%s,%s\n", tracer_descs[a].name, tracer_descs[b].name);
}

int cli_complete(int argc, char **argv)
{
    const char *option = argc > 1 && strncmp(argv[1], "--", 2) == 0 ? argv[1] + 2 : "";
    const struct cli_field *field = cli_field_find(option);
    char text[256];
    if (strcmp(option, "tracers") == 0)
        print_pairs();
    if (!field)
        return CLI_DONE;
    if (field->field->kind == FIELD_ENUM || field->field->numbers) {
        field_allowed_text(field->field, text, sizeof(text));
        for (char *rest = text, *word; (word = strtok_r(rest, ", ", &rest));)
            puts(word);
    } else {
        puts(field_default_text(field->field, text, sizeof(text)));
    }
    return CLI_DONE;
}
