/* SPDX-License-Identifier: MIT */
/* farlight info: lists the contents of a model file. */
#include "commands.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/models.h"
#include "options/parse.h"
#include "options/talk.h"
#include "cli/info_camera.h"

#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#define KEY_JSON 0x400
#define KEY_VARIANT 0x401
#define KEY_CAMERA 0x402
#define LISTED_MAX 200u

struct info_options {
    const char *model, *environment, *variant;
    bool json, has_camera;
    struct cli_info_camera camera;
    struct cli_job job; /* holds an option's error */
};

static const struct argp_option options[] = {
    {"json", KEY_JSON, NULL, 0, "Print one JSON object on one line", 0},
    {"environment", 'e', "FILE", 0, "Check this environment image as well", 0},
    {"camera", KEY_CAMERA, NULL, 0,
     "Show the camera that 'farlight render' takes, as options to copy (starts a daemon)", 0},
    {"variant", KEY_VARIANT, "NAME", 0, "Show the materials of this variant of a glTF model", 0},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct info_options *wanted = state->input;
    switch (key) {
    case KEY_JSON:
        wanted->json = true;
        return 0;
    case 'e':
        wanted->environment = value;
        return 0;
    case KEY_CAMERA:
        wanted->has_camera = true;
        return 0;
    case KEY_VARIANT:
        wanted->variant = value;
        return 0;
    case ARGP_KEY_ARG:
        if (wanted->model)
            return cli_usage(&wanted->job, value, "only one model can be given");
        wanted->model = value;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static json_t *string(const char *text)
{
    json_t *made = json_string(text); /* NULL for text that is not UTF-8, which a cut name may be */
    return made ? made : json_string("");
}

static json_t *lists(const struct fl_model_info *info)
{
    json_t *cameras = json_array(), *clips = json_array(), *notes = json_array(), *variants = json_array();
    for (size_t i = 0; i < info->camera_count; i++)
        json_array_append_new(
            cameras, json_pack("{s:I,s:o}", "index", (json_int_t)i, "name", string(info->cameras[i].name)));
    for (size_t i = 0; i < info->clip_count; i++)
        json_array_append_new(clips, json_pack("{s:o,s:I,s:f}", "name", string(info->clips[i].name), "channels",
                                               (json_int_t)info->clips[i].channels, "duration_s",
                                               (double)info->clips[i].duration_s));
    for (size_t i = 0; i < info->variant_count; i++)
        json_array_append_new(variants, string(info->variants[i].name));
    for (size_t i = 0; i < info->note_count; i++)
        json_array_append_new(notes, json_pack("{s:s,s:o,s:o}", "severity",
                                               protocol_severity_text(info->notes[i].severity), "where",
                                               string(info->notes[i].where), "text", string(info->notes[i].text)));
    return json_pack("{s:o,s:o,s:o,s:o}", "cameras", cameras, "clips", clips, "variants", variants, "notes",
                     notes);
}

static json_t *bounds(const float lower[3], const float upper[3])
{
    return json_pack("{s:[f,f,f],s:[f,f,f]}", "lower", (double)lower[0], (double)lower[1], (double)lower[2],
                     "upper", (double)upper[0], (double)upper[1], (double)upper[2]);
}

static json_t *objects(const struct fl_model_object *list, size_t count)
{
    json_t *array = json_array();
    for (size_t i = 0; i < count; i++) {
        json_t *object = json_pack("{s:I,s:o}", "index", (json_int_t)i, "name", string(list[i].name));
        if (list[i].has_bounds)
            json_object_set_new(object, "bounds", bounds(list[i].lower_world, list[i].upper_world));
        json_array_append_new(array, object);
    }
    return array;
}

static void print_json(const struct info_options *wanted, const struct fl_model_info *info)
{
    json_t *object = lists(info);
    const struct {
        const char *name;
        uint64_t value;
    } numbers[] = {{"nodes", info->nodes},
                   {"meshes", info->meshes},
                   {"closed_meshes", info->closed_meshes},
                   {"triangles", info->triangles},
                   {"sphere_sets", info->sphere_sets},
                   {"spheres", info->spheres},
                   {"discs", info->discs},
                   {"materials", info->materials},
                   {"textures", info->textures},
                   {"lights", info->lights},
                   {"skins", info->skins},
                   {"joints", info->joints},
                   {"morph_targets", info->morph_targets},
                   {"notes_left_out", info->notes_left_out},
                   {"read_bytes", info->import.read_bytes},
                   {"blob_bytes", info->import.offered_bytes},
                   {"read_ns", info->import.read_ns},
                   {"parse_ns", info->import.parse_ns},
                   {"hash_ns", info->import.hash_ns},
                   {"import_ns", info->import.import_ns}};
    json_object_set_new(object, "node_list", objects(info->node_list, info->node_list_count));
    json_object_set_new(object, "material_list", objects(info->material_list, info->material_list_count));
    json_object_set_new(object, "light_list", objects(info->light_list, info->light_list_count));
    if (info->has_bounds)
        json_object_set_new(object, "bounds", bounds(info->lower_world, info->upper_world));
    if (wanted->has_camera)
        json_object_set_new(object, "camera", cli_info_camera_json(&wanted->camera));
    json_object_set_new(object, "model", string(wanted->model ? wanted->model : ""));
    for (size_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++)
        json_object_set_new(object, numbers[i].name, json_integer((json_int_t)numbers[i].value));
    json_dumpf(object, stdout, CLI_JSON | JSON_REAL_PRECISION(9));
    fputc('\n', stdout);
    json_decref(object);
}

static void print_bounds(const float lower[3], const float upper[3])
{
    printf("(%g %g %g) to (%g %g %g)", (double)lower[0], (double)lower[1], (double)lower[2], (double)upper[0],
           (double)upper[1], (double)upper[2]);
}

/* Prints a list, cut to a readable length. */
static void print_objects(const char *kind, const struct fl_model_object *list, size_t count)
{
    for (size_t i = 0; i < count && i < LISTED_MAX; i++) {
        printf("  %s %zu: ", kind, i);
        cli_print_name(list[i].name);
        if (list[i].has_bounds) {
            fputs(list[i].name[0] != '\0' ? ", " : "", stdout);
            print_bounds(list[i].lower_world, list[i].upper_world);
        }
        putchar('\n');
    }
    if (count > LISTED_MAX)
        printf("  %zu more %ss (--json lists all)\n", count - LISTED_MAX, kind);
}

static void print_table(const struct info_options *wanted, const struct fl_model_info *info)
{
    const struct {
        const char *name;
        uint64_t value;
    } rows[] = {{"nodes", info->nodes},          {"meshes", info->meshes},     {"closed", info->closed_meshes},
                {"triangles", info->triangles},  {"spheres", info->spheres},   {"discs", info->discs},
                {"materials", info->materials},  {"textures", info->textures}, {"lights", info->lights},
                {"cameras", info->camera_count}, {"skins", info->skins},       {"targets", info->morph_targets},
                {"clips", info->clip_count}};
    cli_print_name(wanted->model ? wanted->model : wanted->environment);
    printf("\n");
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++)
        printf("  %-10s %12" PRIu64 "\n", rows[i].name, rows[i].value);
    printf("  %-10s %12.3f MB in files, at most %.3f MB to upload\n", "bytes",
           (double)info->import.read_bytes * 1e-6, (double)info->import.offered_bytes * 1e-6);
    if (info->has_bounds) {
        printf("  %-10s ", "box");
        print_bounds(info->lower_world, info->upper_world);
        putchar('\n');
    }
    const struct message_render usual = fl_render_defaults();
    if (info->camera_count > 0)
        printf("  %-10s camera 0, or --view, --azimuth, --eye\n", "seen by");
    else
        printf("  %-10s a camera at azimuth %g and elevation %g degrees that sees all, or --view, --eye\n",
               "seen by", (double)usual.camera.auto_azimuth, (double)usual.camera.auto_elevation);
    if (wanted->has_camera)
        cli_info_print_camera(&wanted->camera);
    print_objects("node", info->node_list, info->node_list_count);
    print_objects("material", info->material_list, info->material_list_count);
    print_objects("light", info->light_list, info->light_list_count);
    for (size_t i = 0; i < info->camera_count; i++) {
        printf("  camera %zu: ", i);
        cli_print_name(info->cameras[i].name);
        printf("\n");
    }
    for (size_t i = 0; i < info->clip_count; i++) {
        printf("  clip %zu: ", i);
        cli_print_name(info->clips[i].name);
        printf(", %.3f s, %u channels\n", (double)info->clips[i].duration_s, info->clips[i].channels);
    }
    for (size_t i = 0; i < info->variant_count; i++) {
        printf("  variant %zu: ", i);
        cli_print_name(info->variants[i].name);
        putchar('\n');
    }
    for (size_t i = 0; i < info->note_count; i++) {
        printf("  %s: ", protocol_severity_text(info->notes[i].severity));
        cli_print_name(info->notes[i].where);
        printf(": ");
        cli_print_name(info->notes[i].text);
        printf("\n");
    }
    if (info->notes_left_out > 0)
        printf("  %" PRIu64 " more notes\n", info->notes_left_out);
}

int cli_info(int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL",
        .doc = "Show what a model file contains, and which parts of it are not supported.\v"
               "'-' is standard input."};
    struct info_options wanted = {0};
    if (cli_parse(&argp, argc, argv, 0, &wanted) != 0)
        return cli_report(&wanted.job.error);
    if (!wanted.model && !wanted.environment) {
        cli_usage(&wanted.job, "MODEL", "a model file is needed");
        return cli_report(&wanted.job.error);
    }
    struct fl_error error = {0};
    if (!cli_interrupt_begin(&error))
        return cli_report(&error);
    int input_fd = 0;
    if (wanted.model && strcmp(wanted.model, "-") == 0 && !cli_open_input(&input_fd, &error))
        return cli_report(&error);
    const struct fl_load_options load = {
        .model = wanted.model, .input_fd = input_fd, .environment = wanted.environment, .variant = wanted.variant};
    struct fl_model_info *info = fl_model_info(&load, cli_interrupt_fd(), &error);
    if (!info || (wanted.has_camera && !cli_info_find_camera(&load, info, &wanted.camera, &error))) {
        fl_model_info_destroy(info);
        return cli_report(&error);
    }
    if (wanted.json)
        print_json(&wanted, info);
    else
        print_table(&wanted, info);
    fl_model_info_destroy(info);
    return CLI_DONE;
}
