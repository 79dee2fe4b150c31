/* SPDX-License-Identifier: MIT */
/* Signals that end a command in order. */
#include "interrupt.h"
#include "protocol/common/standard.h"

#include <errno.h>
#include <signal.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

static volatile sig_atomic_t received;
static int event_fd; /* 0: none; descriptor 0 is never ours */

static void handle(int number)
{
    const int saved = errno;
    const uint64_t one = 1;
    received = number;
    /* The write fails only if the descriptor is readable already. */
    if (write(event_fd, &one, sizeof(one)) < 0)
        errno = saved;
    errno = saved;
}

bool cli_interrupt_begin(struct fl_error *error)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
    event_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (event_fd < 0)
        return fl_error_set(error, FL_ERROR_SYSTEM, "", "eventfd: %s", strerror(errno));
    /* SA_RESETHAND: a second signal gets the default action. */
    struct sigaction action = {.sa_handler = handle, .sa_flags = (int)SA_RESETHAND};
    sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++)
        if (!signal_is_ignored(numbers[i]))
            sigaction(numbers[i], &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    return true;
}

int cli_interrupt_fd(void)
{
    return event_fd;
}

int cli_interrupt_signal(void)
{
    return (int)received;
}
