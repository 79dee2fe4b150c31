/* SPDX-License-Identifier: MIT */
#include "cli/cli.h"

#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>

#define KEY_JSON 0x400
#define KEY_KEY 0x401

struct scenes_options {
    const char *server, *key_file;
    bool json;
    struct cli_job job; /* holds the error of what was typed */
};

static const struct argp_option options[] = {
    {"server", 's', "ADDRESS", 0, "unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET] (default: FARLIGHT_SERVER)", 0},
    {"key", KEY_KEY, "FILE", 0, "Key of a daemon that is reached over TCP (default: FARLIGHT_KEY)", 0},
    {"json", KEY_JSON, NULL, 0, "One JSON object a line", 0},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct scenes_options *wanted = state->input;
    switch (key) {
    case 's':
        wanted->server = value;
        return 0;
    case KEY_KEY:
        wanted->key_file = value;
        return 0;
    case KEY_JSON:
        wanted->json = true;
        return 0;
    case ARGP_KEY_ARG:
        return cli_usage(&wanted->job, value, "is not expected");
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static void print_json(const struct fl_scene_entry *scene)
{
    json_t *object = json_pack("{s:s,s:s,s:I,s:I,s:I}", "name", scene->name, "sharing",
                               protocol_sharing_text(scene->sharing), "clients", (json_int_t)scene->clients,
                               "revision", (json_int_t)scene->revision, "triangles", (json_int_t)scene->triangles);
    json_dumpf(object, stdout, JSON_COMPACT);
    fputc('\n', stdout);
    json_decref(object);
}

static void print_table(const struct fl_scene_entry *scenes, size_t count)
{
    if (count > 0)
        printf("%-7s %8s %9s %12s  name\n", "sharing", "clients", "revision", "triangles");
    for (size_t i = 0; i < count; i++) {
        const struct fl_scene_entry *scene = &scenes[i];
        printf("%-7s %8" PRIu32 " %9" PRIu64 " %12" PRIu64 "  ", protocol_sharing_text(scene->sharing),
               scene->clients, scene->revision, scene->triangles);
        cli_print_name(scene->name);
        putchar('\n');
    }
}

int cli_scenes(int argc, char **argv)
{
    static const struct argp argp = {.options = options,
                                     .parser = parse,
                                     .doc = "List the scenes of a daemon that others may come to: those that are "
                                            "shared, and those that are kept for whoever asks."};
    struct scenes_options wanted = {.server = getenv("FARLIGHT_SERVER")};
    if (argp_parse(&argp, argc, argv, 0, NULL, &wanted) != 0)
        return cli_report(&wanted.job.error);
    if (wanted.server == NULL || wanted.server[0] == '\0') {
        cli_usage(&wanted.job, "--server", "no daemon is named");
        fl_error_remedy(&wanted.job.error, "unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET]");
        return cli_report(&wanted.job.error);
    }
    struct fl_error error = {0};
    if (!cli_interrupt_begin(&error))
        return cli_report(&error);
    const struct fl_connect_options connect = {.server = wanted.server,
                                               .key_file = cli_key_file(wanted.server, wanted.key_file),
                                               .name = "farlight scenes",
                                               .interrupt_fd = cli_interrupt_fd()};
    struct fl_connection *connection = fl_connect(&connect, &error);
    struct fl_scene_entry *scenes = NULL;
    size_t count = 0;
    const bool done = connection != NULL && fl_scene_list(connection, &scenes, &count, &error);
    for (size_t i = 0; wanted.json && i < count; i++)
        print_json(&scenes[i]);
    if (!wanted.json)
        print_table(scenes, count);
    free(scenes);
    fl_connection_destroy(connection);
    return done ? CLI_DONE : cli_report(&error);
}
