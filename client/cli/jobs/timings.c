/* SPDX-License-Identifier: MIT */
/* Times of a command: a table for people (means over the frames), or every number as JSON. */
#include "timings.h"
#include "structure.h"
#include "options/talk.h"

#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>

#define STAGES PROTOCOL_STAGE_COUNT
#define CLOCKS PROTOCOL_CLOCK_COUNT
#define WAVES_SHOWN 32u
#define PARTS_SHOWN 8u

struct sum {
    uint64_t ns;
    bool measured; /* false differs from 0 */
};

struct part {
    bool seen;
    struct fl_structure_part last; /* from the last frame with this part */
    uint64_t builds;
    struct sum build[CLOCKS];
};

struct cli_timings {
    enum cli_timings_form form;
    FILE *out;
    uint64_t frames, primary_rays, shadow_rays, secondary_rays, splits, dispatches, barriers, waits, wire_bytes,
        uploaded_bytes, structure_bytes;
    uint64_t pixels_bytes, wait_ns, receive_ns, decode_ns;
    struct sum stages[STAGES][CLOCKS];
    struct sum waves[2][WAVES_SHOWN][CLOCKS]; /* trace, shade */
    struct part parts[PARTS_SHOWN];           /* parts of the structure, by number */
    char title[160];
};

struct cli_timings *cli_timings_create(enum cli_timings_form form, bool to_stderr)
{
    struct cli_timings *timings = calloc(1, sizeof(*timings));
    if (!timings)
        return NULL;
    timings->form = form;
    timings->out = to_stderr ? stderr : stdout;
    return timings;
}

void cli_timings_destroy(struct cli_timings *timings)
{
    free(timings);
}

/* ---- sums ---- */

static void add(struct sum *sum, uint64_t ns)
{
    sum->ns += ns;
    sum->measured = true;
}

static void add_stages(struct cli_timings *timings, const struct fl_frame *frame)
{
    for (size_t i = 0; i < frame->stage_count; i++) {
        const struct record_stage_time *time = &frame->stages[i];
        add(&timings->stages[time->stage][time->clock], time->duration_ns);
        const bool is_trace = time->stage == PROTOCOL_STAGE_TRACE;
        if ((is_trace || time->stage == PROTOCOL_STAGE_SHADE) && time->wave < WAVES_SHOWN)
            add(&timings->waves[is_trace ? 0 : 1][time->wave][time->clock], time->duration_ns);
    }
}

static void add_builds(struct part *part, const struct fl_frame *frame)
{
    for (size_t i = 0; i < frame->stage_count; i++) {
        const struct record_stage_time *time = &frame->stages[i];
        if (time->stage == PROTOCOL_STAGE_BUILD && time->wave == part->last.number)
            add(&part->build[time->clock], time->duration_ns);
    }
}

static void add_structure(struct cli_timings *timings, const struct fl_frame *frame)
{
    struct fl_structure_part next;
    for (size_t at = 0; fl_structure_next(frame, &at, &next);) {
        if (next.number >= PARTS_SHOWN)
            continue;
        struct part *part = &timings->parts[next.number];
        part->seen = true;
        part->last = next;
        if (!next.built)
            continue;
        part->builds++;
        add_builds(part, frame);
    }
}

static void add_frame(struct cli_timings *timings, const struct fl_frame *frame)
{
    if (timings->frames++ == 0)
        snprintf(timings->title, sizeof(timings->title), "%ux%u, %u sample%s, %s, %s, %s %s", frame->width,
                 frame->height, frame->samples, frame->samples == 1 ? "" : "s",
                 protocol_tracer_text(frame->tracer), protocol_integrator_text(frame->integrator),
                 protocol_pixel_format_text(frame->format), protocol_encoding_text(frame->encoding));
    timings->primary_rays += frame->primary_rays;
    timings->shadow_rays += frame->shadow_rays;
    timings->secondary_rays += frame->secondary_rays;
    timings->splits += frame->splits;
    timings->dispatches += frame->dispatches;
    timings->barriers += frame->barriers;
    timings->waits += frame->device_waits;
    timings->wire_bytes += frame->wire_bytes;
    timings->pixels_bytes += frame->pixels_bytes;
    timings->uploaded_bytes += frame->uploaded_bytes;
    timings->structure_bytes = frame->structure_bytes;
    timings->wait_ns += frame->wait_ns;
    timings->receive_ns += frame->receive_ns;
    timings->decode_ns += frame->decode_ns;
    add_stages(timings, frame);
    add_structure(timings, frame);
}

/* ---- JSON ---- */

static void print_object(struct cli_timings *timings, json_t *object)
{
    if (object && json_dumpf(object, timings->out, CLI_JSON | JSON_REAL_PRECISION(9)) == 0)
        fputc('\n', timings->out);
    json_decref(object);
}

static json_t *stages_array(const struct fl_frame *frame)
{
    json_t *array = json_array();
    for (size_t i = 0; i < frame->stage_count; i++) {
        const struct record_stage_time *time = &frame->stages[i];
        json_array_append_new(array, json_pack("{s:s,s:s,s:I,s:I,s:I}", "stage", protocol_stage_text(time->stage),
                                               "clock", protocol_clock_text(time->clock), "wave",
                                               (json_int_t)time->wave, "start_ns", (json_int_t)time->start_ns,
                                               "duration_ns", (json_int_t)time->duration_ns));
    }
    return array;
}

static void set(json_t *object, const char *name, uint64_t value)
{
    json_object_set_new(object, name, json_integer((json_int_t)value));
}

static void print_frame(struct cli_timings *timings, const struct fl_frame *frame)
{
    char digest[20];
    snprintf(digest, sizeof(digest), "%016" PRIx64, frame->digest);
    json_t *object = json_pack(
        "{s:s,s:s,s:s,s:s,s:s,s:s}", "kind", "frame", "tracer", protocol_tracer_text(frame->tracer), "integrator",
        protocol_integrator_text(frame->integrator), "format", protocol_pixel_format_text(frame->format),
        "encoding", protocol_encoding_text(frame->encoding), "digest", digest);
    set(object, "frame", frame->frame);
    set(object, "width", frame->width);
    set(object, "height", frame->height);
    set(object, "samples", frame->samples);
    set(object, "revision", frame->revision);
    set(object, "primary_rays", frame->primary_rays);
    set(object, "shadow_rays", frame->shadow_rays);
    set(object, "secondary_rays", frame->secondary_rays);
    set(object, "splits", frame->splits);
    set(object, "device_waits", frame->device_waits);
    set(object, "dispatches", frame->dispatches);
    set(object, "barriers", frame->barriers);
    set(object, "uploaded_bytes", frame->uploaded_bytes);
    set(object, "structure_bytes", frame->structure_bytes);
    set(object, "pixels_bytes", frame->pixels_bytes);
    set(object, "wire_bytes", frame->wire_bytes);
    set(object, "wait_ns", frame->wait_ns);
    set(object, "receive_ns", frame->receive_ns);
    set(object, "decode_ns", frame->decode_ns);
    json_object_set_new(object, "stages", stages_array(frame));
    cli_structure_set_json(object, frame);
    print_object(timings, object);
}

static void print_client(struct cli_timings *timings, const struct cli_client_times *times)
{
    const struct fl_import_stats *import = times->import;
    json_t *object = json_pack("{s:s}", "kind", "client");
    set(object, "frames", timings->frames);
    set(object, "start_ns", times->start_ns);
    set(object, "import_read_bytes", import->read_bytes);
    set(object, "import_read_ns", import->read_ns);
    set(object, "import_parse_ns", import->parse_ns);
    set(object, "import_hash_ns", import->hash_ns);
    set(object, "import_ns", import->import_ns);
    set(object, "load_ns", import->load_ns);
    set(object, "offered_bytes", import->offered_bytes);
    set(object, "uploaded_bytes", import->uploaded_bytes);
    set(object, "upload_ns", import->upload_ns);
    set(object, "commit_ns", import->commit_ns);
    set(object, "wait_ns", timings->wait_ns);
    set(object, "receive_ns", timings->receive_ns);
    set(object, "decode_ns", timings->decode_ns);
    set(object, "export_ns", times->export_ns);
    set(object, "total_ns", times->total_ns);
    print_object(timings, object);
}

/* ---- table ---- */

static double ms(uint64_t ns)
{
    return (double)ns * 1e-6;
}

static void print_row(const struct cli_timings *timings, const char *indent, const char *name,
                      const struct sum sums[CLOCKS])
{
    if (!sums[PROTOCOL_CLOCK_CPU].measured && !sums[PROTOCOL_CLOCK_GPU].measured)
        return;
    fprintf(timings->out, "  %s%-*s", indent, indent[0] != '\0' ? 14 : 16, name);
    static const enum protocol_clock order[] = {PROTOCOL_CLOCK_CPU, PROTOCOL_CLOCK_GPU};
    for (size_t i = 0; i < 2; i++) {
        if (sums[order[i]].measured)
            fprintf(timings->out, "%12.3f", ms(sums[order[i]].ns) / (double)timings->frames);
        else
            fprintf(timings->out, "%12s", "-");
    }
    fputc('\n', timings->out);
}

/* Prints rows of parts; a structure without parts has everything in the row above. */
static void print_part_rows(const struct cli_timings *timings)
{
    for (unsigned i = 0; i < PARTS_SHOWN; i++)
        if (timings->parts[i].last.name[0] != '\0')
            print_row(timings, "  ", timings->parts[i].last.name, timings->parts[i].build);
}

static void print_stages(const struct cli_timings *timings)
{
    fprintf(timings->out, "  %-16s%12s%12s\n", "daemon", "CPU ms", "GPU ms");
    for (unsigned stage = 0; stage < STAGES; stage++) {
        print_row(timings, "", protocol_stage_text((enum protocol_stage)stage), timings->stages[stage]);
        if (stage == PROTOCOL_STAGE_BUILD)
            print_part_rows(timings);
        if (stage != PROTOCOL_STAGE_TRACE && stage != PROTOCOL_STAGE_SHADE)
            continue;
        for (unsigned wave = 0; wave < WAVES_SHOWN; wave++) {
            char name[24];
            snprintf(name, sizeof(name), "wave %u", wave);
            print_row(timings, "  ", name, timings->waves[stage == PROTOCOL_STAGE_TRACE ? 0 : 1][wave]);
        }
    }
}

/* GPU time if it was measured, else CPU time. */
static uint64_t best_ns(const struct cli_timings *timings, enum protocol_stage stage)
{
    const struct sum *gpu = &timings->stages[stage][PROTOCOL_CLOCK_GPU];
    return gpu->measured ? gpu->ns : timings->stages[stage][PROTOCOL_CLOCK_CPU].ns;
}

static void print_rays(const struct cli_timings *timings)
{
    const double frames = (double)timings->frames;
    const uint64_t rays = timings->primary_rays + timings->shadow_rays + timings->secondary_rays;
    const uint64_t ns = best_ns(timings, PROTOCOL_STAGE_PRIMARY) + best_ns(timings, PROTOCOL_STAGE_TRACE);
    fprintf(timings->out, "  %-16s%12.0f primary, %.0f shadow, %.0f secondary", "rays",
            (double)timings->primary_rays / frames, (double)timings->shadow_rays / frames,
            (double)timings->secondary_rays / frames);
    if (ns > 0)
        fprintf(timings->out, "; %.2f Mray/s in primary and trace", (double)rays * 1e3 / (double)ns);
    if (timings->splits > 0)
        fprintf(timings->out, "; %" PRIu64 " slices repeated as halves", timings->splits);
    fprintf(timings->out, "\n  %-16s%12.0f dispatches, %.0f barriers, %.0f waits for it", "device",
            (double)timings->dispatches / frames, (double)timings->barriers / frames,
            (double)timings->waits / frames);
    fprintf(timings->out, "\n  %-16s%12.3f MB of %.3f MB pixels; to the device %.3f MB; structure %.3f MB\n",
            "bytes sent", (double)timings->wire_bytes * 1e-6 / frames,
            (double)timings->pixels_bytes * 1e-6 / frames, (double)timings->uploaded_bytes * 1e-6 / frames,
            (double)timings->structure_bytes * 1e-6);
}

static void print_structure(const struct cli_timings *timings)
{
    const char *title = "structure";
    for (unsigned i = 0; i < PARTS_SHOWN; i++) {
        const struct part *part = &timings->parts[i];
        if (!part->seen)
            continue;
        fprintf(timings->out, "  %-9s %-10s%s", title, part->last.name, part->last.text);
        if (part->last.is_kept)
            fprintf(timings->out, "; built for %" PRIu64 " of %" PRIu64 " frame%s", part->builds, timings->frames,
                    timings->frames == 1 ? "" : "s");
        fputc('\n', timings->out);
        title = "";
    }
}

static void print_part(const struct cli_timings *timings, const char *name, uint64_t ns, const char *doc)
{
    fprintf(timings->out, "  %-16s%12.3f  %s\n", name, ms(ns), doc);
}

static void print_import(const struct cli_timings *timings, const struct fl_import_stats *import)
{
    char upload[120];
    snprintf(upload, sizeof(upload), "%.3f MB of %.3f MB offered", (double)import->uploaded_bytes * 1e-6,
             (double)import->offered_bytes * 1e-6);
    print_part(timings, "load", import->load_ns, "waited for the scene; including or in parallel:");
    print_part(timings, "  read", import->read_ns, "importer: files");
    print_part(timings, "  parse", import->parse_ns, "importer: parsing and decoding");
    print_part(timings, "  hash", import->hash_ns, "importer: hashing");
    print_part(timings, "  upload", import->upload_ns, upload);
    print_part(timings, "  commit", import->commit_ns, "daemon: edits applied");
}

static void print_table(struct cli_timings *timings, const struct cli_client_times *times)
{
    if (timings->frames > 0) {
        fprintf(timings->out, "%s; %" PRIu64 " frame%s%s\n", timings->title, timings->frames,
                timings->frames == 1 ? "" : "s", timings->frames == 1 ? "" : ", means of one");
        print_stages(timings);
        print_rays(timings);
        print_structure(timings);
    }
    fprintf(timings->out, "  %-16s%12s  all frames together\n", "client", "ms");
    print_part(timings, "start", times->start_ns, "daemon started or reached");
    if (times->import->load_ns > 0) /* else the scene existed already */
        print_import(timings, times->import);
    print_part(timings, "wait", timings->wait_ns, "for frames; including:");
    print_part(timings, "  receive", timings->receive_ns, "first byte to last");
    print_part(timings, "  decode", timings->decode_ns, "and digest");
    print_part(timings, "export", times->export_ns, "waited for image files");
    print_part(timings, "total", times->total_ns, "of the command");
}

/* ---- both ---- */

void cli_timings_frame(struct cli_timings *timings, const struct fl_frame *frame)
{
    if (!timings)
        return;
    add_frame(timings, frame);
    if (timings->form == CLI_TIMINGS_JSON)
        print_frame(timings, frame);
}

void cli_timings_end(struct cli_timings *timings, const struct cli_client_times *times)
{
    if (!timings)
        return;
    if (timings->form == CLI_TIMINGS_JSON)
        print_client(timings, times);
    else
        print_table(timings, times);
    fflush(timings->out);
}
