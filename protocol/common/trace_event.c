/* SPDX-License-Identifier: MIT */
/* Writing of trace events as JSON. */
#include "protocol/common/trace_event.h"

#include "protocol/plain_text.h"

#include <inttypes.h>
#include <stdlib.h>

static void begin_event(struct trace_writer *writer)
{
    fputs(writer->before, writer->out);
    writer->before = TRACE_FILE_SEPARATOR;
}

static void write_text(FILE *out, const char *text)
{
    fputc('"', out);
    while (*text) {
        uint32_t code = 0xfffd; /* U+FFFD replaces bytes that are not UTF-8 */
        size_t length = utf8_read(text, UTF8_BYTES_MAX, &code);
        if (code == '"' || code == '\\')
            fprintf(out, "\\%c", (char)code);
        else if (length > 0 && plain_text_allows(code))
            fwrite(text, 1, length, out);
        else if (code > 0xffff)
            fprintf(out, "\\u%04x\\u%04x", 0xd800 + ((code - 0x10000) >> 10), 0xdc00 + (code & 0x3ff));
        else
            fprintf(out, "\\u%04x", code);
        text += length > 0 ? length : 1;
    }
    fputc('"', out);
}

static void write_name(struct trace_writer *writer, const char *kind, uint64_t process, uint64_t thread,
                       const char *name)
{
    begin_event(writer);
    fprintf(writer->out,
            "{\"name\":\"%s\",\"ph\":\"M\",\"pid\":%" PRIu64 ",\"tid\":%" PRIu64 ",\"args\":{\"name\":", kind,
            process, thread);
    write_text(writer->out, name);
    fputs("}}", writer->out);
}

void trace_write_process_name(struct trace_writer *writer, uint64_t process, const char *name)
{
    write_name(writer, "process_name", process, 0, name);
}

static void write_us(FILE *out, const char *name, uint64_t ns)
{
    fprintf(out, ",\"%s\":%" PRIu64 ".%03u", name, ns / 1000, (unsigned)(ns % 1000));
}

void trace_write_event(struct trace_writer *writer, const struct trace_event *event)
{
    FILE *out = writer->out;
    begin_event(writer);
    fputs("{\"name\":", out);
    write_text(out, event->name);
    fprintf(out, ",\"cat\":\"%s\",\"ph\":\"X\"", event->gpu ? "gpu" : "cpu");
    write_us(out, "ts", event->start_ns);
    write_us(out, "dur", event->duration_ns);
    fprintf(out, ",\"pid\":%" PRIu64 ",\"tid\":%" PRIu64 ",\"args\":{", event->process, event->thread);
    for (unsigned i = 0; i < TRACE_ARGUMENTS_MAX && event->arguments[i].name; i++)
        fprintf(out, "%s\"%s\":%" PRIu64, i ? "," : "", event->arguments[i].name, event->arguments[i].value);
    fputs("}}", out);
}

/* Adds the event to the lane if it nests within or follows the lane's events. False: it overlaps. */
static bool lane_add(struct trace_lane *lane, uint64_t start_ns, uint64_t end_ns)
{
    unsigned depth = lane->depth;
    if (start_ns < lane->last_start_ns)
        return false;
    while (depth > 0 && lane->ends_ns[depth - 1] <= start_ns)
        depth--;
    if (depth == TRACE_DEPTH_MAX || (depth > 0 && end_ns > lane->ends_ns[depth - 1]))
        return false;
    lane->ends_ns[depth] = end_ns;
    lane->depth = depth + 1;
    lane->last_start_ns = start_ns;
    return true;
}

void trace_place_event(struct trace_writer *writer, struct trace_track *track, const char *name,
                       struct trace_event *event)
{
    uint64_t end_ns = event->start_ns + event->duration_ns;
    unsigned i = 0;
    while (i < track->lane_count && !lane_add(&track->lanes[i], event->start_ns, end_ns))
        i++;
    if (i == track->lane_count && i < TRACE_LANES_MAX) {
        char numbered[96];
        snprintf(numbered, sizeof(numbered), i ? "%s (%u)" : "%s", name, i + 1);
        track->lanes[i].thread = ++*writer->threads;
        lane_add(&track->lanes[i], event->start_ns, end_ns);
        track->lane_count++;
        write_name(writer, "thread_name", event->process, track->lanes[i].thread, numbered);
    }
    event->thread = track->lanes[i < TRACE_LANES_MAX ? i : TRACE_LANES_MAX - 1].thread;
}

static int compare_events(const void *a, const void *b)
{
    const struct trace_event *first = a, *second = b;
    if (first->start_ns != second->start_ns)
        return first->start_ns < second->start_ns ? -1 : 1;
    if (first->duration_ns != second->duration_ns)
        return first->duration_ns > second->duration_ns ? -1 : 1;
    return (first->rank < second->rank) - (first->rank > second->rank);
}

void trace_sort_events(struct trace_event *events, size_t count)
{
    qsort(events, count, sizeof(*events), compare_events);
}
