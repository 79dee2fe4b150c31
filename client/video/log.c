/* SPDX-License-Identifier: MIT */
/* Error texts, with the libraries' last log line. */
#include "log.h"

#include <libavutil/error.h>
#include <libavutil/log.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Encoders speak from threads of their own. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static char last_line[256];

static void keep(void *context, int level, const char *format, va_list arguments)
{
    (void)context;
    if (level > AV_LOG_ERROR)
        return;
    pthread_mutex_lock(&lock);
    vsnprintf(last_line, sizeof(last_line), format, arguments);
    last_line[strcspn(last_line, "\r\n")] = '\0';
    pthread_mutex_unlock(&lock);
}

void video_keep_log(void)
{
    av_log_set_callback(keep);
}

bool video_fail(struct video_failure *failure, const char *field, const char *remedy, const char *format, ...)
{
    va_list arguments;
    failure->field = field;
    failure->remedy = remedy;
    failure->lacks_space = false;
    va_start(arguments, format);
    vsnprintf(failure->reason, sizeof(failure->reason), format, arguments);
    va_end(arguments);
    return false;
}

bool video_fail_library(struct video_failure *failure, const char *field, const char *what, int number)
{
    char words[AV_ERROR_MAX_STRING_SIZE] = "";
    av_strerror(number, words, sizeof(words));
    pthread_mutex_lock(&lock);
    video_fail(failure, field, NULL, "%s: %s%s%s%s", what, words, last_line[0] != '\0' ? " (" : "", last_line,
               last_line[0] != '\0' ? ")" : "");
    last_line[0] = '\0';
    pthread_mutex_unlock(&lock);
    return false;
}
