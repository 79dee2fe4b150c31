/* SPDX-License-Identifier: MIT */
/* farlight stats: shows the statistics of a daemon. */
#include "commands.h"
#include "options/daemon.h"
#include "options/image_path.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/talk.h"
#include "metrics.h"
#include "lib/text.h"

#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "protocol/plain_text.h"

#define WATCH_DEFAULT_S 2.0
#define WATCH_MIN_S 0.1
#define WATCH_MAX_S 86400.0

enum { KEY_JSON = 0x400, KEY_LIMITS, KEY_WATCH, KEY_PROMETHEUS };

struct stats_options {
    struct cli_daemon daemon;
    bool json, limits, prometheus;
    const char *prometheus_path; /* NULL: standard output */
    double watch_s;              /* 0: once */
    struct cli_job job;          /* holds an option's error */
};

static const struct argp_option options[] = {
    {"json", KEY_JSON, NULL, 0, "Print one JSON object on one line", 0},
    {"limits", KEY_LIMITS, NULL, 0, "Show the daemon's limits too (JSON always contains them)", 0},
    {"watch", KEY_WATCH, "SECONDS", OPTION_ARG_OPTIONAL,
     "Repeat at this interval in seconds (default 2) until Ctrl-C; write --watch=10", 0},
    {"prometheus", KEY_PROMETHEUS, "FILE", OPTION_ARG_OPTIONAL,
     "Print statistics for Prometheus, or replace FILE by them for node_exporter; write --prometheus=FILE", 0},
    {0},
};

static const struct argp_child children[] = {{&cli_daemon_argp, 0, NULL, 0}, {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct stats_options *wanted = state->input;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &wanted->daemon;
        return 0;
    case KEY_JSON:
        wanted->json = true;
        return 0;
    case KEY_LIMITS:
        wanted->limits = true;
        return 0;
    case KEY_PROMETHEUS:
        wanted->prometheus = true;
        wanted->prometheus_path = value;
        return 0;
    case KEY_WATCH:
        wanted->watch_s = WATCH_DEFAULT_S;
        if (!value || fl_text_real(value, WATCH_MIN_S, WATCH_MAX_S, &wanted->watch_s, &wanted->job.error))
            return 0;
        snprintf(wanted->job.error.field, sizeof(wanted->job.error.field), "--watch");
        return EINVAL;
    case ARGP_KEY_ARG:
        return cli_usage(&wanted->job, value, "is an argument too many");
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* ---- JSON ---- */

static void set(json_t *object, const char *name, uint64_t value)
{
    json_object_set_new(object, name, json_integer((json_int_t)value));
}

static json_t *clients_array(const struct message_stats_reply *reply)
{
    json_t *array = json_array();
    for (uint32_t i = 0; i < reply->clients_count; i++) {
        const struct record_client_stat *client = &reply->clients[i];
        json_t *object = json_pack("{s:s}", "name", client->name);
        set(object, "client", client->client);
        set(object, "connected_ns", client->connected_ns);
        set(object, "received_bytes", client->received_bytes);
        set(object, "sent_bytes", client->sent_bytes);
        set(object, "bulk_bytes", client->bulk_bytes);
        set(object, "requests", client->requests);
        set(object, "scenes", client->scenes);
        json_array_append_new(array, object);
    }
    return array;
}

static json_t *scenes_array(const struct message_stats_reply *reply)
{
    json_t *array = json_array();
    for (uint32_t i = 0; i < reply->scenes_count; i++) {
        const struct record_scene_stat *scene = &reply->scenes[i];
        json_t *object = json_pack("{s:s}", "name", scene->name);
        set(object, "client", scene->client);
        set(object, "scene", scene->scene);
        set(object, "revision", scene->revision);
        set(object, "nodes", scene->nodes);
        set(object, "instances", scene->instances);
        set(object, "triangles", scene->triangles);
        set(object, "spheres", scene->spheres);
        set(object, "host_bytes", scene->host_bytes);
        set(object, "device_bytes", scene->device_bytes);
        json_array_append_new(array, object);
    }
    return array;
}

static json_t *running_array(const struct message_stats_reply *reply)
{
    json_t *array = json_array();
    for (uint32_t i = 0; i < reply->running_count; i++) {
        const struct record_job_stat *job = &reply->running[i];
        json_t *object =
            json_pack("{s:s,s:s,s:s,s:s}", "owner", job->owner, "kind", protocol_job_kind_text(job->kind), "scene",
                      job->scene, "tracer", protocol_tracer_text(job->tracer));
        set(object, "client", job->client);
        set(object, "running_ns", job->running_ns);
        set(object, "frames_sent", job->frames_sent);
        if (job->frames_total > 0) {
            set(object, "frames_total", job->frames_total);
            set(object, "frame", job->frame);
        }
        json_array_append_new(array, object);
    }
    return array;
}

static json_t *stages_array(const struct message_stats_reply *reply)
{
    json_t *array = json_array();
    for (uint32_t i = 0; i < reply->stages_count; i++) {
        const struct record_stage_total *total = &reply->stages[i];
        json_t *object = json_pack("{s:s,s:s}", "stage", protocol_stage_text(total->stage), "clock",
                                   protocol_clock_text(total->clock));
        set(object, "count", total->count);
        set(object, "total_ns", total->total_ns);
        set(object, "max_ns", total->max_ns);
        json_array_append_new(array, object);
    }
    return array;
}

static json_t *limits_object(const struct fl_connection *connection)
{
    json_t *object = json_object();
    struct fl_limit limit;
    for (size_t i = 0; fl_connection_limit(connection, i, &limit); i++)
        set(object, limit.name, limit.value);
    return object;
}

static void print_json(const struct fl_connection *connection, const struct message_stats_reply *reply)
{
    json_t *object =
        json_pack("{s:s,s:s,s:s}", "version", reply->version, "device", reply->device, "driver", reply->driver);
    set(object, "uptime_ns", reply->uptime_ns);
    set(object, "frames", reply->frames);
    set(object, "rays", reply->rays);
    set(object, "jobs", reply->jobs);
    set(object, "host_bytes", reply->host_bytes);
    set(object, "host_limit_bytes", reply->host_limit_bytes);
    set(object, "device_bytes", reply->device_bytes);
    set(object, "device_limit_bytes", reply->device_limit_bytes);
    set(object, "device_objects", reply->device_objects);
    set(object, "blobs", reply->blobs);
    set(object, "blob_bytes", reply->blob_bytes);
    json_object_set_new(object, "limits", limits_object(connection));
    json_object_set_new(object, "clients", clients_array(reply));
    json_object_set_new(object, "scenes", scenes_array(reply));
    json_object_set_new(object, "running", running_array(reply));
    json_object_set_new(object, "stages", stages_array(reply));
    json_dumpf(object, stdout, CLI_JSON);
    fputc('\n', stdout);
    json_decref(object);
}

/* ---- table ---- */

static double mb(uint64_t bytes)
{
    return (double)bytes * 1e-6;
}

/* Copies a text of the daemon or another client, made harmless for a terminal. */
static const char *plain(const char *text, char out[130])
{
    plain_text_copy(out, 130, text);
    return out;
}

static void print_stages(const struct message_stats_reply *reply)
{
    if (reply->stages_count > 0)
        printf("stage        clock %12s %14s %12s %12s\n", "spans", "total ms", "mean ms", "maximum ms");
    for (uint32_t i = 0; i < reply->stages_count; i++) {
        const struct record_stage_total *total = &reply->stages[i];
        const double mean = total->count > 0 ? (double)total->total_ns * 1e-6 / (double)total->count : 0;
        printf("  %-10s %-5s %12" PRIu64 " %14.3f %12.3f %12.3f\n", protocol_stage_text(total->stage),
               protocol_clock_text(total->clock), total->count, (double)total->total_ns * 1e-6, mean,
               (double)total->max_ns * 1e-6);
    }
}

static void print_jobs(const struct message_stats_reply *reply)
{
    char text[130];
    for (uint32_t i = 0; i < reply->running_count; i++) {
        const struct record_job_stat *job = &reply->running[i];
        printf("job of %-5" PRIu64 " %s, ", job->client, plain(job->owner, text));
        printf("%s of %s, %s, for %.1f s, ", protocol_job_kind_text(job->kind),
               job->scene[0] != '\0' ? plain(job->scene, text) : "a private scene",
               protocol_tracer_text(job->tracer), (double)job->running_ns * 1e-9);
        if (job->frames_total == 0)
            printf("%" PRIu64 " frames sent\n", job->frames_sent);
        else
            printf("frame %u, %" PRIu64 " of %" PRIu64 " sent\n", job->frame, job->frames_sent, job->frames_total);
    }
}

static void print_table(const struct message_stats_reply *reply)
{
    char text[130];
    printf("farlightd %s", plain(reply->version, text));
    printf(", up %.1f s\n", (double)reply->uptime_ns * 1e-9);
    printf("device       %s\n", plain(reply->device, text));
    printf("driver       %s\n", plain(reply->driver, text));
    printf("work         %" PRIu64 " frames, %" PRIu64 " rays, %u jobs now\n", reply->frames, reply->rays,
           reply->jobs);
    printf("host memory  %.3f MB of %.0f MB\n", mb(reply->host_bytes), mb(reply->host_limit_bytes));
    printf("device mem.  %.3f MB of %.0f MB, %u objects\n", mb(reply->device_bytes), mb(reply->device_limit_bytes),
           reply->device_objects);
    printf("blobs        %u, %.3f MB\n", reply->blobs, mb(reply->blob_bytes));
    for (uint32_t i = 0; i < reply->clients_count; i++) {
        const struct record_client_stat *client = &reply->clients[i];
        printf("client %-5" PRIu64
               " %s, %.1f s, %.3f MB in (%.3f MB blobs), %.3f MB out, %u requests, %u scenes\n",
               client->client, plain(client->name, text), (double)client->connected_ns * 1e-9,
               mb(client->received_bytes), mb(client->bulk_bytes), mb(client->sent_bytes), client->requests,
               client->scenes);
    }
    for (uint32_t i = 0; i < reply->scenes_count; i++) { /* 0.0: nobody has it now */
        const struct record_scene_stat *scene = &reply->scenes[i];
        printf("scene %" PRIu64 ".%-4u %s, revision %" PRIu64 ", %u nodes, %" PRIu64 " triangles, %" PRIu64
               " spheres, %.3f MB host, %.3f MB device\n",
               scene->client, scene->scene, plain(scene->name, text), scene->revision, scene->nodes,
               scene->triangles, scene->spheres, mb(scene->host_bytes), mb(scene->device_bytes));
    }
    print_jobs(reply);
    print_stages(reply);
}

static void print_limits(const struct fl_connection *connection)
{
    struct fl_limit limit;
    for (size_t i = 0; fl_connection_limit(connection, i, &limit); i++)
        printf("limit  %-27s %14" PRIu64 "  %s\n", limit.name, limit.value, limit.what);
}

/* ---- metrics ---- */

static bool write_metrics(const char *path, const struct message_stats_reply *reply, struct fl_error *error)
{
    char *text = NULL;
    size_t length = 0;
    FILE *stream = open_memstream(&text, &length);
    if (stream)
        metrics_print(stream, reply);
    const bool done = stream && fclose(stream) == 0 ? cli_write_text(path, text, 0644, error)
                                                    : fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    free(text);
    return done;
}

/* Writes that the daemon is down into the metrics, so that a monitor notices; the error is reported as well. */
static void print_down(const struct stats_options *wanted, const struct fl_error *error)
{
    if (!wanted->prometheus || error->code == FL_ERROR_FILE || error->code == FL_ERROR_ARGUMENT)
        return;
    if (wanted->prometheus_path)
        write_metrics(wanted->prometheus_path, NULL, NULL);
    else
        metrics_print(stdout, NULL);
}

static bool show(struct fl_connection *connection, const struct stats_options *wanted, struct fl_error *error)
{
    const struct message_stats_reply *reply = NULL;
    if (!fl_stats(connection, &reply, error))
        return false;
    if (wanted->prometheus_path)
        return write_metrics(wanted->prometheus_path, reply, error);
    if (wanted->watch_s > 0 && !wanted->json && cli_is_terminal(STDOUT_FILENO))
        fputs("\033[H\033[J", stdout); /* clears the screen */
    if (wanted->prometheus)
        metrics_print(stdout, reply);
    else if (wanted->json)
        print_json(connection, reply);
    else
        print_table(reply);
    if (wanted->limits && !wanted->json && !wanted->prometheus)
        print_limits(connection);
    return true;
}

/* Repeats until an interruption, which is the normal end. */
static bool watch(struct fl_connection *connection, const struct stats_options *wanted, struct fl_error *error)
{
    while (show(connection, wanted, error)) {
        if (!wanted->json && !cli_is_terminal(STDOUT_FILENO))
            putchar('\n'); /* separates blocks */
        if (fflush(stdout) != 0)
            return true; /* the reader has closed or the disk is full; main() reports it */
        if (!fl_connection_wait(connection, (unsigned)(wanted->watch_s * 1e3), error))
            break;
    }
    if (error->code != FL_ERROR_INTERRUPTED)
        return false;
    *error = (struct fl_error){0};
    return true;
}

int cli_stats(int argc, char **argv)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .children = children,
        .doc = "Show a daemon's device, clients, scenes, jobs, memory, stage times and limits."};
    struct stats_options wanted = {0};
    if (cli_parse(&argp, argc, argv, 0, &wanted) != 0)
        return cli_report(&wanted.job.error);
    struct fl_error error = {0};
    if (wanted.json && wanted.prometheus) {
        fl_error_set(&error, FL_ERROR_ARGUMENT, "--prometheus", "cannot be combined with --json");
        return cli_report(&error);
    }
    struct fl_connection *connection = cli_daemon_connect(&wanted.daemon, "farlight stats", true, &error);
    const bool done = connection && (wanted.watch_s > 0 ? watch(connection, &wanted, &error)
                                                        : show(connection, &wanted, &error));
    fl_connection_destroy(connection);
    if (done)
        return CLI_DONE;
    print_down(&wanted, &error);
    return cli_report(&error);
}
