/* SPDX-License-Identifier: MIT */
/* Daemons that are lost, and may come back. */
#include "cli/cli.h"

#include <poll.h>
#include <sys/random.h>

#define FIRST_PAUSE_MS 500u
#define LONGEST_PAUSE_MS 30000u
#define DOUBLINGS_MAX 6u

bool cli_is_temporary(const struct fl_error *error)
{
    return error->code == FL_ERROR_CONNECTION || error->retryable;
}

uint32_t cli_retry_pause_ms(unsigned failures, uint32_t min_ms)
{
    const unsigned doublings = failures <= DOUBLINGS_MAX ? failures - 1 : DOUBLINGS_MAX;
    uint32_t pause_ms = FIRST_PAUSE_MS << doublings;
    unsigned chance = 0;
    if (getrandom(&chance, sizeof(chance), GRND_NONBLOCK) == (ssize_t)sizeof(chance))
        pause_ms = pause_ms * 3 / 4 + chance % (pause_ms / 2);
    pause_ms = pause_ms > min_ms ? pause_ms : min_ms;
    return pause_ms < LONGEST_PAUSE_MS ? pause_ms : LONGEST_PAUSE_MS;
}

bool cli_retry_wait(uint32_t pause_ms, struct fl_error *error)
{
    struct pollfd polled = {.fd = cli_interrupt_fd(), .events = POLLIN};
    return poll(&polled, 1, (int)pause_ms) <= 0 || fl_error_set(error, FL_ERROR_INTERRUPTED, "", "interrupted");
}
