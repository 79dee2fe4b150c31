/* SPDX-License-Identifier: MIT */
/* Members of a shot file that are also options: each is set as on the command line. */
#include "read.h"

#include "options/fields.h"
#include "options/arguments.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum type { WORD, WHOLE, REAL, SIZE, FLAG, WHOLE_OR_WORD, WORDS, GROUPS };

/* Settings that are no field of `render`. */
static const struct setting {
    const char *name, *option;
    enum type type;
    const char *example;
} settings[] = {
    {"frames", "frames", WORD, "\"1-240\""},
    {"fps", "fps", REAL, "24"},
    {"shard", "shard", WORD, "\"3/8\""},
    {"size", "size", SIZE, "[1920, 1080]"},
    {"denoise", "denoise", WORD, "\"on\""},
    {"layers", "layers", WORDS, "[\"beauty\", \"depth\"]"},
    {"light_groups", "light-group", GROUPS, "{\"key\": [\"Sun\", \"Lamp*\"]}"},
    {"format", "format", WORD, "\"exr\""},
    {"half", "half", FLAG, "true"},
    {"float", "float", FLAG, "true"},
    {"colour_space", "colour-space", WORD, "\"ACEScg\""},
    {"display_view", "display-view", WORD, "\"AgX\""},
    {"exr_compression", "exr-compression", WORD, "\"dwaa\""},
    {"stereo", "stereo", REAL, "0.065"},
    {"stereo_layout", "stereo-layout", WORD, "\"side\""},
    {"light_field", "light-field", SIZE, "[5, 5]"},
    {"baseline", "baseline", REAL, "0.1"},
    {"views", "views", WORD, "\"quadtree\""},
    {"lens", "lens", WORD, "\"quadtree\""},
    {"upsample", "upsample", WHOLE, "4"},
    {"lossless", "lossless", FLAG, "true"},
};
#define SETTING_COUNT (sizeof(settings) / sizeof(settings[0]))

static bool wrong_type(const struct shot_reader *reader, const struct shot_value *at,
                       const struct setting *setting)
{
    static const char *const wanted[] = {[WORD] = "a string",
                                         [WHOLE] = "a whole number, not less than 0",
                                         [REAL] = "a number",
                                         [SIZE] = "an array of two whole numbers",
                                         [FLAG] = "true or false",
                                         [WHOLE_OR_WORD] = "a whole number or a word",
                                         [WORDS] = "an array of strings",
                                         [GROUPS] = "an object of arrays of strings"};
    char remedy[80];
    snprintf(remedy, sizeof(remedy), "such as \"%s\": %s", setting->name, setting->example);
    return shot_wrong(reader, at, remedy, "must be %s", wanted[setting->type]);
}

/* 16.0 is a whole number, too. */
static bool is_whole(const json_t *value)
{
    const double number = json_number_value(value);
    return json_is_number(value) && number >= 0 && number <= 9007199254740992.0 && floor(number) == number;
}

/* Joins strings as "a,b"; NULL: an element is not a string, or there is none. */
static const char *joined(const json_t *array, char *text, size_t text_bytes)
{
    size_t used = 0;
    for (size_t i = 0; i < json_array_size(array); i++) {
        const char *word = json_string_value(json_array_get(array, i));
        if (!word || strchr(word, ',') || strlen(word) + 2 > text_bytes - used)
            return NULL;
        used += (size_t)snprintf(text + used, text_bytes - used, "%s%s", i > 0 ? "," : "", word);
    }
    return used > 0 ? text : NULL;
}

/* The value as it would be typed; NULL: it has the wrong type. */
static const char *typed(const struct setting *setting, const json_t *value, char *text, size_t text_bytes)
{
    const json_t *width = json_array_get(value, 0), *height = json_array_get(value, 1);
    switch (setting->type) {
    case WORD:
        return json_string_value(value);
    case WHOLE:
        snprintf(text, text_bytes, "%.0f", json_number_value(value));
        return is_whole(value) ? text : NULL;
    case REAL:
        snprintf(text, text_bytes, "%.17g", json_number_value(value));
        return json_is_number(value) ? text : NULL;
    case SIZE:
        snprintf(text, text_bytes, "%.0fx%.0f", json_number_value(width), json_number_value(height));
        return json_array_size(value) == 2 && is_whole(width) && is_whole(height) ? text : NULL;
    case WHOLE_OR_WORD:
        snprintf(text, text_bytes, "%.0f", json_number_value(value));
        if (json_is_string(value))
            return isdigit((unsigned char)json_string_value(value)[0]) ? NULL : json_string_value(value);
        return is_whole(value) ? text : NULL;
    case WORDS:
        return joined(value, text, text_bytes);
    default:
        return json_is_boolean(value) ? "" : NULL;
    }
}

/* Applies light groups, each as "key=Sun,Lamp*". */
static bool apply_groups(const struct shot_reader *reader, const struct shot_value *at,
                         const struct setting *setting)
{
    const char *name;
    json_t *nodes;
    if (!json_is_object(at->value))
        return wrong_type(reader, at, setting);
    json_object_foreach((json_t *)(uintptr_t)at->value, name, nodes)
    {
        char words[2048], text[2200];
        if (strchr(name, '=') || !joined(nodes, words, sizeof(words)))
            return wrong_type(reader, at, setting);
        snprintf(text, sizeof(text), "%s=%s", name, words);
        if (cli_job_set(reader->job, setting->option, text) != 0) {
            const struct fl_error why = reader->job->error;
            return shot_wrong(reader, at, why.remedy, "%s", why.text);
        }
    }
    return true;
}

static bool apply_setting(const struct shot_reader *reader, const struct shot_value *at,
                          const struct setting *setting)
{
    char text[256], remedy[sizeof(reader->job->error.remedy)];
    if (setting->type == GROUPS)
        return apply_groups(reader, at, setting);
    const char *value = typed(setting, at->value, text, sizeof(text));
    if (!value)
        return wrong_type(reader, at, setting);
    if (json_is_false(at->value))
        return true;
    value = setting->type == FLAG ? NULL : value;
    error_t status = reader->set(reader->user, setting->option, value);
    if (status == ARGP_ERR_UNKNOWN)
        status = cli_job_set(reader->job, setting->option, value);
    if (status == 0)
        return true;
    const struct fl_error why = reader->job->error;
    snprintf(remedy, sizeof(remedy), "such as \"%s\": %s", setting->name, setting->example);
    return shot_wrong(reader, at, why.remedy[0] != '\0' ? why.remedy : remedy, "%s", why.text);
}

/* Applies a member that is a field of `render`, with an example from its description. */
static bool apply_field(const struct shot_reader *reader, const struct shot_value *at,
                        const struct cli_field *field)
{
    char usual[32], quoted[40];
    const struct field_desc *desc = field->field;
    const bool is_auto = desc->zero_is_default && desc->default_int == 0;
    const bool is_word = desc->kind == FIELD_ENUM;
    field_default_text(desc, usual, sizeof(usual));
    snprintf(quoted, sizeof(quoted), is_word || is_auto ? "\"%s\"" : "%s", usual);
    const struct setting setting = {field->member, field->option,
                                    is_word                    ? WORD
                                    : desc->kind == FIELD_REAL ? REAL
                                    : is_auto                  ? WHOLE_OR_WORD
                                                               : WHOLE,
                                    quoted};
    return apply_setting(reader, at, &setting);
}

size_t shot_setting_names(const char **names)
{
    size_t count = 0;
    for (size_t i = 0; i < SETTING_COUNT; i++)
        names[count++] = settings[i].name;
    for (size_t i = 0; i < cli_field_count() && count < SHOT_SETTINGS_MAX; i++)
        if (cli_field_at(i)->is_of_shot)
            names[count++] = cli_field_at(i)->member;
    return count;
}

bool shot_settings(const struct shot_reader *reader, const struct shot_value *root)
{
    for (size_t i = 0; i < SETTING_COUNT; i++) {
        const struct shot_value at = shot_member(root, settings[i].name);
        if (at.value && !apply_setting(reader, &at, &settings[i]))
            return false;
    }
    for (size_t i = 0; i < cli_field_count(); i++) {
        const struct cli_field *field = cli_field_at(i);
        const struct shot_value at = shot_member(root, field->member);
        if (at.value && field->is_of_shot && !apply_field(reader, &at, field))
            return false;
    }
    return true;
}
