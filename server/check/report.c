/* SPDX-License-Identifier: MIT */
/* Prints rows as a table or as JSON. */
#include "check/report.h"

#include "protocol/plain_text.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

static const char *const verdict_texts[] = {"ok", "note", "FAILED"};
static const char *const verdict_words[] = {"ok", "note", "failed"};

/* Writes a string; names come from drivers, so only plain characters are kept. */
static void put_string(FILE *stream, const char *text)
{
    char shown[UTF8_BYTES_MAX];
    putc('"', stream);
    while (*text) {
        size_t bytes = plain_text_next(&text, shown);
        if (bytes == 1 && (shown[0] == '"' || shown[0] == '\\'))
            putc('\\', stream);
        fwrite(shown, 1, bytes, stream);
    }
    putc('"', stream);
}

static void put_member(FILE *stream, const char *name, const char *text)
{
    fprintf(stream, ",\"%s\":", name);
    if (text)
        put_string(stream, text);
    else
        fputs("null", stream);
}

static void put_number(FILE *stream, const char *name, double value)
{
    if (isfinite(value))
        fprintf(stream, ",\"%s\":%.9g", name, value);
    else
        fprintf(stream, ",\"%s\":null", name);
}

static void put_json(FILE *stream, const struct check_row *row, const char *text)
{
    fputs("{\"check\":", stream);
    put_string(stream, row->check);
    put_member(stream, "name", row->name);
    put_member(stream, "verdict", verdict_words[row->verdict]);
    put_number(stream, "value", row->unit ? row->value : NAN);
    put_number(stream, "bound", row->unit ? row->bound : NAN);
    put_member(stream, "unit", row->unit);
    put_member(stream, "text", text);
    put_member(stream, "remedy", row->verdict == CHECK_FAILED ? row->remedy : NULL);
    fputs("}\n", stream);
}

static void put_line(FILE *stream, const struct check_row *row, const char *text)
{
    fprintf(stream, "%-6s  %-10s  %-52s  ", verdict_texts[row->verdict], row->check, row->name);
    plain_text_print(stream, text);
    putc('\n', stream);
    if (row->verdict == CHECK_FAILED && row->remedy && row->remedy[0]) {
        fputs("        -> ", stream);
        plain_text_print(stream, row->remedy);
        putc('\n', stream);
    }
}

void check_report_row(struct check_report *report, const struct check_row *row, const char *format, ...)
{
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof(text), format, arguments);
    va_end(arguments);
    report->rows++;
    report->failed += row->verdict == CHECK_FAILED;
    if (report->json)
        put_json(report->stream, row, text);
    else
        put_line(report->stream, row, text);
    fflush(report->stream); /* the next check may take seconds, or crash the driver */
}

void check_report_error(struct check_report *report, const char *check, const char *name,
                        const struct error *error)
{
    const struct check_row row = {
        .verdict = CHECK_FAILED, .check = check, .name = name, .bound = NAN, .remedy = error->remedy};
    check_report_row(report, &row, "%s%s%s", error->field, error->field[0] ? ": " : "", error->text);
}

bool check_report_end(struct check_report *report)
{
    const struct check_row row = {.verdict = report->failed ? CHECK_FAILED : CHECK_OK,
                                  .check = "all",
                                  .name = "failed checks",
                                  .unit = "",
                                  .value = report->failed,
                                  .bound = 0};
    const unsigned rows = report->rows;
    check_report_row(report, &row, "%u of %u", report->failed, rows);
    return fflush(report->stream) == 0 && !ferror(report->stream);
}
