/* SPDX-License-Identifier: MIT */
/* Statistics in the text format of Prometheus. */
#include "metrics.h"

#include <inttypes.h>

#include "protocol/plain_text.h"

#define TEXT_BYTES 160

static void begin(FILE *out, const char *name, const char *type, const char *help)
{
    fprintf(out, "# HELP farlight_%s %s\n# TYPE farlight_%s %s\n", name, help, name, type);
}

static void print_count(FILE *out, const char *name, const char *type, const char *help, uint64_t value)
{
    begin(out, name, type, help);
    fprintf(out, "farlight_%s %" PRIu64 "\n", name, value);
}

static void print_label(FILE *out, const char *name, const char *text)
{
    char plain[TEXT_BYTES];
    plain_text_copy(plain, sizeof(plain), text);
    fprintf(out, "%s=\"", name);
    for (const char *c = plain; *c; c++)
        fprintf(out, *c == '\\' || *c == '"' ? "\\%c" : "%c", *c);
    fputc('"', out);
}

static void print_build(FILE *out, const struct message_stats_reply *reply)
{
    begin(out, "build_info", "gauge", "1; the labels name the daemon's version, its GPU and its driver.");
    fputs("farlight_build_info{", out);
    print_label(out, "version", reply->version);
    fputc(',', out);
    print_label(out, "device", reply->device);
    fputc(',', out);
    print_label(out, "driver", reply->driver);
    fputs("} 1\n", out);
}

static void print_job_kinds(FILE *out, const struct message_stats_reply *reply)
{
    begin(out, "jobs_by_kind", "gauge", "Jobs running or waiting, by kind; the first 256 of them.");
    for (int kind = 0; kind < PROTOCOL_JOB_COUNT; kind++) {
        uint32_t count = 0;
        for (uint32_t i = 0; i < reply->running_count; i++)
            count += (int)reply->running[i].kind == kind;
        fprintf(out, "farlight_jobs_by_kind{kind=\"%s\"} %u\n",
                protocol_job_kind_text((enum protocol_job_kind)kind), count);
    }
}

static void print_stage(FILE *out, const char *name, const struct record_stage_total *total)
{
    fprintf(out, "farlight_%s{stage=\"%s\",clock=\"%s\"} ", name, protocol_stage_text(total->stage),
            protocol_clock_text(total->clock));
}

static void print_stages(FILE *out, const struct message_stats_reply *reply)
{
    begin(out, "stage_seconds_total", "counter", "Time spent in a stage of frames since the daemon's start.");
    for (uint32_t i = 0; i < reply->stages_count; i++) {
        print_stage(out, "stage_seconds_total", &reply->stages[i]);
        fprintf(out, "%.9f\n", (double)reply->stages[i].total_ns * 1e-9);
    }
    begin(out, "stage_spans_total", "counter", "How many times a stage has run since the daemon's start.");
    for (uint32_t i = 0; i < reply->stages_count; i++) {
        print_stage(out, "stage_spans_total", &reply->stages[i]);
        fprintf(out, "%" PRIu64 "\n", reply->stages[i].count);
    }
    begin(out, "stage_seconds_max", "gauge", "The longest time that a stage took once since the daemon's start.");
    for (uint32_t i = 0; i < reply->stages_count; i++) {
        print_stage(out, "stage_seconds_max", &reply->stages[i]);
        fprintf(out, "%.9f\n", (double)reply->stages[i].max_ns * 1e-9);
    }
}

void metrics_print(FILE *out, const struct message_stats_reply *reply)
{
    print_count(out, "up", "gauge", "1: the daemon answers. 0: it does not.", reply ? 1 : 0);
    if (!reply)
        return;
    print_build(out, reply);
    begin(out, "uptime_seconds", "gauge", "Time since the daemon's start.");
    fprintf(out, "farlight_uptime_seconds %.3f\n", (double)reply->uptime_ns * 1e-9);
    print_count(out, "frames_total", "counter", "Frames rendered since the daemon's start.", reply->frames);
    print_count(out, "rays_total", "counter", "Rays traced since the daemon's start.", reply->rays);
    print_count(out, "jobs", "gauge", "Jobs running or waiting.", reply->jobs);
    print_job_kinds(out, reply);
    print_count(out, "clients", "gauge", "Connected clients, at most 256.", reply->clients_count);
    print_count(out, "scenes", "gauge", "Scenes in memory, at most 256.", reply->scenes_count);
    print_count(out, "host_memory_bytes", "gauge", "Memory of scenes on the host.", reply->host_bytes);
    print_count(out, "host_memory_limit_bytes", "gauge", "Its limit.", reply->host_limit_bytes);
    print_count(out, "device_memory_bytes", "gauge", "Memory on the GPU.", reply->device_bytes);
    print_count(out, "device_memory_limit_bytes", "gauge", "Its limit.", reply->device_limit_bytes);
    print_count(out, "device_objects", "gauge", "Live OpenGL objects except programs.", reply->device_objects);
    print_count(out, "blobs", "gauge", "Blobs held.", reply->blobs);
    print_count(out, "blob_bytes", "gauge", "Their size.", reply->blob_bytes);
    print_stages(out, reply);
}
