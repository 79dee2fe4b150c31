/* SPDX-License-Identifier: MIT */
/* farlight scenes: lists the scenes of a daemon. */
#include "commands.h"
#include "options/daemon.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/talk.h"

#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>

#define KEY_JSON 0x400

struct scenes_options {
    struct cli_daemon daemon;
    bool json;
    struct cli_job job; /* holds an option's error */
};

static const struct argp_option options[] = {{"json", KEY_JSON, NULL, 0, "Print one JSON object per line", 0},
                                             {0}};

static const struct argp_child children[] = {{&cli_daemon_argp, 0, NULL, 0}, {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct scenes_options *wanted = state->input;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &wanted->daemon;
        return 0;
    case KEY_JSON:
        wanted->json = true;
        return 0;
    case ARGP_KEY_ARG:
        return cli_usage(&wanted->job, value, "is an argument too many");
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static void print_json(const struct fl_scene_entry *scene)
{
    json_t *object = json_pack("{s:s,s:s,s:I,s:I,s:I}", "name", scene->name, "sharing",
                               protocol_sharing_text(scene->sharing), "clients", (json_int_t)scene->clients,
                               "revision", (json_int_t)scene->revision, "triangles", (json_int_t)scene->triangles);
    json_dumpf(object, stdout, CLI_JSON);
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
                                     .children = children,
                                     .doc =
                                         "List the scenes of a daemon to which clients may attach: those that are "
                                         "shared with all clients, and those kept for the same user or key."};
    struct scenes_options wanted = {0};
    if (cli_parse(&argp, argc, argv, 0, &wanted) != 0)
        return cli_report(&wanted.job.error);
    struct fl_error error = {0};
    struct fl_connection *connection = cli_daemon_connect(&wanted.daemon, "farlight scenes", true, &error);
    struct fl_scene_entry *scenes = NULL;
    size_t count = 0;
    const bool done = connection && fl_scene_list(connection, &scenes, &count, &error);
    for (size_t i = 0; wanted.json && i < count; i++)
        print_json(&scenes[i]);
    if (!wanted.json)
        print_table(scenes, count);
    free(scenes);
    fl_connection_destroy(connection);
    return done ? CLI_DONE : cli_report(&error);
}
