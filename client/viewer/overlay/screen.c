/* SPDX-License-Identifier: MIT */
/* Notices on the screen. */
#include "screen.h"
#include "protocol/common/clock.h"

#include <stdarg.h>
#include <stdio.h>

#define NOTICE_NS 4000000000ull

void screen_say(struct screen *screen, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(screen->notice, sizeof(screen->notice), format, arguments);
    va_end(arguments);
    screen->notice_ns = monotonic_now_ns() + NOTICE_NS;
    screen->must_draw = true;
}
