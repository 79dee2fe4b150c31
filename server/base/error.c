/* SPDX-License-Identifier: MIT */
/* Setting of errors and remedies. */
#include "base/error.h"

#include <stdarg.h>
#include <stdio.h>

bool error_set(struct error *error, enum error_code kind, const char *field, const char *format, ...)
{
    if (!error || error->kind != ERROR_NONE)
        return false;
    *error = (struct error){.kind = kind, .retryable = kind == ERROR_BUSY};
    if (field)
        snprintf(error->field, sizeof(error->field), "%s", field);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof(error->text), format, arguments);
    va_end(arguments);
    return false;
}

bool error_remedy(struct error *error, const char *format, ...)
{
    if (!error || error->remedy[0])
        return false;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->remedy, sizeof(error->remedy), format, arguments);
    va_end(arguments);
    return false;
}
