/* SPDX-License-Identifier: MIT */
/* Application of a shot file to a job. */
#include "script.h"
#include "read.h"
#include "lib/text.h"
#include "options/arguments.h"
#include "options/image_path.h"
#include "options/job.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FILE_BYTES_MAX (16u << 20)
#define OBJECTS_MAX 4096u

/* ---- scene ---- */

static const struct shot_property light_properties[] = {
    {"colour", PROTOCOL_CHANNEL_LIGHT_COLOUR, SHOT_NUMBERS, 3, 0, 1e12, 1, "[10, 9, 8]"},
    {"size", PROTOCOL_CHANNEL_LIGHT_SIZE, SHOT_SIZE, 2, 0, 1e12, 1, "[0.5, 0.5]"},
    {0}};
static const struct shot_property material_properties[] = {
    {"base_colour", PROTOCOL_CHANNEL_MATERIAL_BASE_COLOUR, SHOT_COLOUR, 4, 0, 1, 1, "[1, 0.5, 0.2]"},
    {"emission", PROTOCOL_CHANNEL_MATERIAL_EMISSION, SHOT_NUMBERS, 3, 0, 1e6, 1, "[1, 1, 1]"},
    {"metallic", PROTOCOL_CHANNEL_MATERIAL_METALLIC, SHOT_NUMBERS, 1, 0, 1, 1, "1"},
    {"roughness", PROTOCOL_CHANNEL_MATERIAL_ROUGHNESS, SHOT_NUMBERS, 1, 0, 1, 1, "0.3"},
    {"transmission", PROTOCOL_CHANNEL_MATERIAL_TRANSMISSION, SHOT_NUMBERS, 1, 0, 1, 1, "1"},
    {"ior", PROTOCOL_CHANNEL_MATERIAL_IOR, SHOT_NUMBERS, 1, 1, 10, 1, "1.5"},
    {0}};
static const struct shot_property node_properties[] = {
    {"translation", PROTOCOL_CHANNEL_NODE_TRANSLATION, SHOT_NUMBERS, 3, -1e12, 1e12, 1, "[0, 1, 0]"},
    {"rotation", PROTOCOL_CHANNEL_NODE_ROTATION, SHOT_TURN, 4, -1, 1, 1, "[0, 0, 0, 1]"},
    {"rotation_degrees", PROTOCOL_CHANNEL_NODE_ROTATION, SHOT_ANGLES, 3, -3.6e6, 3.6e6, 1, "[0, 90, 0]"},
    {"scale", PROTOCOL_CHANNEL_NODE_SCALE, SHOT_NUMBERS, 3, -1e6, 1e6, 1, "[1, 1, 1]"},
    {"hidden", PROTOCOL_CHANNEL_NODE_HIDDEN, SHOT_FLAG, 1, 0, 1, 1, "true"},
    {0}};

static const struct group {
    const char *name;
    enum protocol_object_kind kind;
    const struct shot_property *properties;
} groups[] = {
    {"lights", PROTOCOL_OBJECT_LIGHT, light_properties},
    {"materials", PROTOCOL_OBJECT_MATERIAL, material_properties},
    {"nodes", PROTOCOL_OBJECT_NODE, node_properties},
};
#define GROUP_COUNT (sizeof(groups) / sizeof(groups[0]))

static bool apply_object(const struct shot_reader *reader, const struct shot_value *at, const struct group *group)
{
    const char *known[8] = {"target"}, *target = NULL;
    for (size_t i = 0; group->properties[i].name; i++)
        known[i + 1] = group->properties[i].name;
    if (!shot_is_object(reader, at, known))
        return false;
    const struct shot_value name = shot_member(at, "target");
    if (!name.value)
        return shot_wrong(reader, at, "\"target\": a name or a number; 'farlight info' lists them",
                          "\"target\" is missing");
    if (!shot_name(reader, &name, &target))
        return false;
    if (json_object_get(at->value, "rotation") && json_object_get(at->value, "rotation_degrees"))
        return shot_wrong(reader, at, "leave one of them out",
                          "\"rotation\" and \"rotation_degrees\" set the same value");
    for (const struct shot_property *property = group->properties; property->name; property++) {
        const struct shot_value value = shot_member(at, property->name);
        struct fl_channel channel;
        if (value.value && (!shot_channel(reader, &value, property, &channel) ||
                            !shot_add_channel(reader, &value, &channel, group->kind, target)))
            return false;
    }
    return true;
}

static bool apply_group(const struct shot_reader *reader, const struct shot_value *at, const struct group *group)
{
    if (!shot_is_array(reader, at, OBJECTS_MAX))
        return false;
    for (size_t i = 0; i < json_array_size(at->value); i++) {
        const struct shot_value object = shot_element(at, i);
        if (!apply_object(reader, &object, group))
            return false;
    }
    return true;
}

/* ---- clips ---- */

static bool apply_clip(const struct shot_reader *reader, const struct shot_value *at, struct cli_clip *clip)
{
    static const char *const known[] = {"clip", "start", "speed", "loop", NULL};
    const struct shot_value which = shot_member(at, "clip"), start = shot_member(at, "start"),
                            speed = shot_member(at, "speed"), loop = shot_member(at, "loop");
    double start_s = 0, factor = 1;
    *clip = (struct cli_clip){.speed = 1, .loop = true, .line = fl_json_line(&reader->shot->json, &at->place)};
    if (!json_is_object(at->value))
        return shot_name(reader, at, &clip->which);
    if (!shot_is_object(reader, at, known))
        return false;
    if (!which.value)
        return shot_wrong(reader, at, "\"clip\": a name or a number; 'farlight info' lists them",
                          "\"clip\" is missing");
    if (!shot_name(reader, &which, &clip->which) ||
        (start.value && !shot_number(reader, &start, -1e6, 1e6, &start_s)) ||
        (speed.value && !shot_number(reader, &speed, 0.001, 1000, &factor)))
        return false;
    if (loop.value && !json_is_boolean(loop.value))
        return shot_wrong(reader, &loop, "\"loop\": false", "must be true or false");
    clip->start_s = (float)start_s;
    clip->speed = (float)factor;
    clip->loop = !json_is_false(loop.value);
    return true;
}

static bool apply_clips(const struct shot_reader *reader, const struct shot_value *at)
{
    struct cli_job *job = reader->job;
    if (!shot_is_array(reader, at, CLI_CLIPS_MAX))
        return false;
    for (size_t i = 0; i < json_array_size(at->value); i++) {
        const struct shot_value clip = shot_element(at, i);
        if (!apply_clip(reader, &clip, &job->clips.list[job->clips.count++]))
            return false;
    }
    return true;
}

/* ---- outputs ---- */

/* Joins the file's folder and a pattern; a percent sign in the folder is doubled. */
static bool join_pattern(const struct shot_reader *reader, const char *pattern, const char **joined)
{
    const char *folder = pattern[0] == '/' ? "" : reader->shot->folder;
    char *out = shot_allocate(reader, 2 * strlen(folder) + strlen(pattern) + 1, 1);
    if (!out)
        return false;
    *joined = out;
    for (const char *at = folder; *at != '\0'; at++) {
        if (*at == '%')
            *out++ = '%';
        *out++ = *at;
    }
    memcpy(out, pattern, strlen(pattern) + 1);
    return true;
}

static bool apply_output(const struct shot_reader *reader, const struct shot_value *at)
{
    struct cli_job *job = reader->job;
    struct cli_output *output = &job->output.list[job->output.count];
    const char *written = json_string_value(at->value);
    struct fl_pattern pattern;
    struct fl_error why = {0};
    if (!shot_path(reader, at, &output->path))
        return false;
    output->image = cli_image_by_path(written);
    if (output->image == CLI_IMAGE_UNKNOWN)
        output->image = job->output.image;
    const bool to_stdout = strcmp(written, "-") == 0;
    if (output->image == CLI_IMAGE_UNKNOWN && !to_stdout)
        return shot_wrong(
            reader, at, "known: .png .jpg .jpeg .exr .hdr .webp .tiff .tif .gif .mp4 .mkv .y4m, or say \"format\"",
            "the ending belongs to no known format");
    output->image = cli_image_of_series(output->image, written);
    if (!to_stdout && !cli_image_is_video(output->image)) {
        if (!fl_pattern_parse(written, &pattern, &why))
            return shot_wrong(reader, at, why.remedy[0] != '\0' ? why.remedy : "write it like 'frames/%04d.exr'",
                              "%s", why.text);
        if (!join_pattern(reader, written, &output->path))
            return false;
    }
    for (size_t i = 0; i < job->output.count; i++)
        if (strcmp(job->output.list[i].path, output->path) == 0)
            return shot_wrong(reader, at, "leave one of them out", "occurs twice");
    job->output.count++;
    return true;
}

static bool apply_outputs(const struct shot_reader *reader, const struct shot_value *at)
{
    if (!shot_is_array(reader, at, CLI_OUTPUTS_MAX))
        return false;
    if (json_array_size(at->value) == 0)
        return shot_wrong(reader, at, "\"outputs\": [\"frames/%04d.exr\"]", "contains no file");
    for (size_t i = 0; i < json_array_size(at->value); i++) {
        const struct shot_value output = shot_element(at, i);
        if (!apply_output(reader, &output))
            return false;
    }
    return true;
}

static bool apply_background(const struct shot_reader *reader, const struct shot_value *at)
{
    const char *written = json_string_value(at->value);
    return (written && cli_set_background(reader->job, "", written) == 0) ||
           shot_wrong(reader, at, "use \"transparent\", \"environment\" or a colour: \"#ffffff\"",
                      "is no background");
}

static bool apply_variant(const struct shot_reader *reader, const struct shot_value *at)
{
    reader->job->input.variant = json_string_value(at->value);
    return reader->job->input.variant || shot_wrong(reader, at, "use the name of a variant", "must be a string");
}

/* ---- all of it ---- */

static bool apply_members(const struct shot_reader *reader, const struct shot_value *root)
{
    const struct cli_shot_given *given = reader->given;
    struct cli_job *job = reader->job;
    const struct shot_value model = shot_member(root, "model"), models = shot_member(root, "models"),
                            environment = shot_member(root, "environment"),
                            background = shot_member(root, "background"),
                            rotation = shot_member(root, "environment_rotation"),
                            variant = shot_member(root, "variant"), points = shot_member(root, "point_size"),
                            camera = shot_member(root, "camera"), clips = shot_member(root, "clips"),
                            output = shot_member(root, "output"), outputs = shot_member(root, "outputs"),
                            about = shot_member(root, "description"), schema = shot_member(root, "$schema");
    const struct shot_value *const texts[] = {&about, &schema};
    for (size_t i = 0; i < 2; i++)
        if (texts[i]->value && !json_is_string(texts[i]->value))
            return shot_wrong(reader, texts[i], "leave it out", "must be a string");
    if (model.value && models.value)
        return shot_wrong(reader, &model, "leave one of them out", "\"model\" and \"models\" cannot be combined");
    if ((model.value && !shot_path(reader, &model, &job->input.model)) ||
        (models.value && !shot_models(reader, &models)) ||
        (environment.value && !shot_path(reader, &environment, &job->input.environment)) ||
        (background.value && !apply_background(reader, &background)) ||
        (rotation.value && !shot_number(reader, &rotation, -360, 360, &job->input.environment_degrees)) ||
        (variant.value && !apply_variant(reader, &variant)) ||
        (points.value && !shot_number(reader, &points, 1e-6, 1e6, &job->input.point_size)) ||
        (camera.value && !shot_camera(reader, &camera)) || (clips.value && !apply_clips(reader, &clips)))
        return false;
    for (size_t i = 0; i < GROUP_COUNT; i++) {
        const struct shot_value group = shot_member(root, groups[i].name);
        if (group.value && !apply_group(reader, &group, &groups[i]))
            return false;
    }
    if (output.value && outputs.value)
        return shot_wrong(reader, &output, "leave one of them out",
                          "\"output\" and \"outputs\" cannot be combined");
    if ((output.value && !apply_output(reader, &output)) || (outputs.value && !apply_outputs(reader, &outputs)))
        return false;
    /* The whole file has been read, so that every mistake in it is reported. */
    if (given->output) {
        job->output.count = 0;
        job->output.image = CLI_IMAGE_UNKNOWN; /* set by the file's outputs */
    }
    job->clips.count = given->clips ? 0 : job->clips.count;
    return true;
}

bool cli_shot_apply(struct cli_shot *shot, struct cli_job *job, const struct cli_shot_given *given,
                    cli_shot_set *set, void *user)
{
    static const char *const others[] = {
        "$schema", "description", "model",   "models",     "environment", "environment_rotation",
        "variant", "background",  "camera",  "clips",      "lights",      "materials",
        "nodes",   "output",      "outputs", "point_size", NULL};
    const struct shot_reader reader = {.shot = shot, .job = job, .given = given, .set = set, .user = user};
    const struct shot_value root = {.value = shot->json.root};
    const char *known[SHOT_SETTINGS_MAX + sizeof(others) / sizeof(others[0])];
    size_t count = 0;
    for (size_t i = 0; others[i]; i++)
        known[count++] = others[i];
    count += shot_setting_names(known + count);
    known[count] = NULL;
    job->script = shot->path;
    job->script_json = &shot->json;
    return shot_is_object(&reader, &root, known) && shot_settings(&reader, &root) && apply_members(&reader, &root);
}

bool cli_shot_load(struct cli_shot *shot, const char *path, struct fl_error *error)
{
    const char *slash = strrchr(path, '/');
    const size_t folder_bytes = slash ? (size_t)(slash - path) + 1 : 0;
    *shot = (struct cli_shot){.path = path};
    if (folder_bytes >= sizeof(shot->folder))
        return fl_error_set(error, FL_ERROR_ARGUMENT, "--script", "the path of the script is too long");
    memcpy(shot->folder, path, folder_bytes);
    if (fl_json_load(&shot->json, path, FILE_BYTES_MAX, error))
        return true;
    return error->remedy[0] != '\0' ? false : fl_error_remedy(error, "see farlight-shot(5)");
}

void cli_shot_finish(struct cli_shot *shot)
{
    for (size_t i = 0; i < shot->owned_count; i++)
        free(shot->owned[i]);
    free(shot->owned);
    fl_json_finish(&shot->json);
    *shot = (struct cli_shot){0};
}
