/* SPDX-License-Identifier: MIT */
/* The first steps of every program: standard descriptors and inherited signals. */
#ifndef FARLIGHT_PROTOCOL_COMMON_STANDARD_H
#define FARLIGHT_PROTOCOL_COMMON_STANDARD_H

#include <fcntl.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <unistd.h>

/* Opens closed standard descriptors: files opened later would get their numbers, and a message for the terminal
 * would be written into a socket or a file. */
static inline void open_standard_descriptors(void)
{
    int fd = 0;
    while (fd >= 0 && fd <= STDERR_FILENO) /* open() returns the lowest free number */
        fd = open("/dev/null", O_RDWR);    /* NOLINT: programs that are started need it too */
    if (fd > STDERR_FILENO)
        close(fd);
}

/* True if the program was started with the signal ignored, as by nohup or as a shell's background command; it
 * then stays ignored. Must be called before a handler is set. */
static inline bool signal_is_ignored(int number)
{
    struct sigaction action;
    return sigaction(number, NULL, &action) == 0 && action.sa_handler == SIG_IGN;
}

#endif
