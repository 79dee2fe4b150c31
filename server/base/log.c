/* SPDX-License-Identifier: MIT */
/* Lines of the log on stderr. */
#include "base/log.h"

#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <unistd.h>

#include "protocol/plain_text.h"

/* Maximum length; longer lines are cut: a line must be written in one call to stay whole beside other threads'
 * lines. */
#define LINE_BYTES_MAX 1024

static atomic_int current_level = LOG_INFO;

void log_set_level(enum log_level level)
{
    atomic_store_explicit(&current_level, (int)level, memory_order_relaxed);
}

static bool log_enabled(enum log_level level)
{
    return (int)level <= atomic_load_explicit(&current_level, memory_order_relaxed);
}

const char *log_level_name(enum log_level level)
{
    static const char *const names[LOG_LEVEL_COUNT] = {"error", "warning", "info", "debug"};
    return (unsigned)level < LOG_LEVEL_COUNT ? names[level] : "unknown";
}

void log_write(enum log_level level, const char *module, const char *format, ...)
{
    if (!log_enabled(level))
        return;
    char line[LINE_BYTES_MAX];
    int head = snprintf(line, sizeof(line) - 1, "%s %s: ", log_level_name(level), module);
    size_t used = head < 0 ? 0 : (size_t)head;
    if (used > sizeof(line) - 2)
        used = sizeof(line) - 2;
    va_list arguments;
    va_start(arguments, format);
    int tail = vsnprintf(line + used, sizeof(line) - 1 - used, format, arguments);
    va_end(arguments);
    if (tail < 0)
        line[used] = '\0';
    /* The line may contain text from outside, which must not control a terminal or fake a line. */
    used = plain_text_copy(line, sizeof(line) - 1, line);
    line[used++] = '\n';
    /* A failure of standard error cannot be reported anywhere. */
    ssize_t written = write(STDERR_FILENO, line, used);
    (void)written;
}
