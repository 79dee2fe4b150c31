/* SPDX-License-Identifier: MIT */
/* The mistakes of a job as typed. */
#include "job.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>

error_t cli_usage(struct cli_job *job, const char *field, const char *format, ...)
{
    char text[600];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof(text), format, arguments);
    va_end(arguments);
    fl_error_set(&job->error, FL_ERROR_ARGUMENT, field, "%s", text);
    return EINVAL;
}
