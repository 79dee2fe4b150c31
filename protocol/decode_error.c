/* SPDX-License-Identifier: MIT */
/* Errors of decoding. */
#include "protocol/decode_error.h"

#include <stdarg.h>
#include <stdio.h>

bool decode_error_set(struct decode_error *error, enum protocol_error_code code, const char *field,
                      const char *format, ...)
{
    if (!error || error->code != PROTOCOL_ERROR_NONE) {
        return false;
    }
    error->code = code;
    snprintf(error->field, sizeof(error->field), "%s", field ? field : "");
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof(error->text), format, arguments);
    va_end(arguments);
    return false;
}
