/* SPDX-License-Identifier: MIT */
/* Errors of the library. */
#include "lib/farlight.h"

#include <stdarg.h>
#include <stdio.h>

#include "protocol/plain_text.h"

bool fl_error_set(struct fl_error *error, enum fl_error_code code, const char *field, const char *format, ...)
{
    if (!error)
        return false;
    *error = (struct fl_error){.code = code};
    snprintf(error->field, sizeof(error->field), "%s", field);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof(error->text), format, arguments);
    va_end(arguments);
    return false;
}

bool fl_error_remedy(struct fl_error *error, const char *format, ...)
{
    if (!error)
        return false;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->remedy, sizeof(error->remedy), format, arguments);
    va_end(arguments);
    return false;
}

/* Texts may come from a peer or a file's name: nothing of theirs may control a terminal. */
static void append_harmless(char *line, size_t line_bytes, size_t *used, const char *text)
{
    *used += plain_text_copy(line + *used, line_bytes - *used, text);
}

void fl_error_print(const struct fl_error *error, char *line, size_t line_bytes)
{
    if (line_bytes == 0)
        return;
    size_t used = 0;
    line[0] = '\0';
    if (error->field[0] != '\0') {
        append_harmless(line, line_bytes, &used, error->field);
        append_harmless(line, line_bytes, &used, ": ");
    }
    append_harmless(line, line_bytes, &used, error->text[0] != '\0' ? error->text : "failed");
    if (error->remedy[0] != '\0') {
        append_harmless(line, line_bytes, &used, " (");
        append_harmless(line, line_bytes, &used, error->remedy);
        append_harmless(line, line_bytes, &used, ")");
    }
}
