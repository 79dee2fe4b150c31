/* SPDX-License-Identifier: MIT */
/* Environment variables of socket activation. */
#include "net/activation.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static unsigned long number_of(const char *name)
{
    const char *text = getenv(name);
    if (!text || text[0] < '0' || text[0] > '9')
        return 0;
    char *end;
    errno = 0;
    unsigned long number = strtoul(text, &end, 10);
    return errno || *end ? 0 : number;
}

size_t activation_take(void)
{
    /* The variables may be meant for the parent process, which passed on its environment. */
    bool ours = number_of("LISTEN_PID") == (unsigned long)getpid();
    unsigned long count = ours ? number_of("LISTEN_FDS") : 0;
    unsetenv("LISTEN_PID");
    unsetenv("LISTEN_FDS");
    unsetenv("LISTEN_FDNAMES");
    if (count > INT_MAX - ACTIVATION_FD_FIRST)
        return 0;
    for (unsigned long i = 0; i < count; i++)
        fcntl(ACTIVATION_FD_FIRST + (int)i, F_SETFD, FD_CLOEXEC);
    return count;
}

void activation_name(size_t index, char name[ACTIVATION_NAME_BYTES])
{
    const char *names = getenv("LISTEN_FDNAMES");
    for (size_t i = 0; names && i < index; i++) {
        names = strchr(names, ':');
        names = names ? names + 1 : NULL;
    }
    size_t bytes = names ? strcspn(names, ":") : 0;
    if (bytes)
        snprintf(name, ACTIVATION_NAME_BYTES, "%.*s", (int)bytes, names);
    else
        snprintf(name, ACTIVATION_NAME_BYTES, "descriptor %zu", ACTIVATION_FD_FIRST + index);
}
