/* SPDX-License-Identifier: MIT */
/* What a program does first with what it was started with: descriptors 0 to 2, and signals. */
#ifndef FARLIGHT_PROTOCOL_COMMON_STANDARD_H
#define FARLIGHT_PROTOCOL_COMMON_STANDARD_H

#include <fcntl.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <unistd.h>

/* Opens those of the standard descriptors that are closed: what is opened later would take their numbers, and a
 * message for the terminal would be written into a socket or a file. */
static inline void open_standard_descriptors(void)
{
    int fd = 0;
    while (fd >= 0 && fd <= STDERR_FILENO) /* the lowest free number is taken */
        fd = open("/dev/null", O_RDWR);    /* NOLINT: programs that are started need it too */
    if (fd > STDERR_FILENO)
        close(fd);
}

/* Whether the program was started with the signal ignored, as by nohup or as a shell's background command: then it
 * stays ignored. To be asked before a handler is set. */
static inline bool signal_is_ignored(int number)
{
    struct sigaction action;
    return sigaction(number, NULL, &action) == 0 && action.sa_handler == SIG_IGN;
}

#endif
