/* SPDX-License-Identifier: MIT */
/* Daemons that are lost, and may come back. */
#include "cli/cli.h"

#include <poll.h>

#define FIRST_PAUSE_MS 500u
#define LONGEST_PAUSE_MS 30000u
#define DOUBLINGS_MAX 6u

bool cli_daemon_is_lost(const struct fl_error *error)
{
    /* Errors about the daemon's own state may be gone later, or with another daemon at the same address. */
    const bool is_passing = error->retryable || error->server_code == PROTOCOL_ERROR_SHUTTING_DOWN ||
                            error->server_code == PROTOCOL_ERROR_DEVICE_LOST ||
                            error->server_code == PROTOCOL_ERROR_BUSY;
    return error->code == FL_ERROR_CONNECTION || (error->code == FL_ERROR_REFUSED && is_passing);
}

uint32_t cli_retry_pause_ms(unsigned failures, uint32_t min_ms)
{
    const unsigned doublings = failures <= DOUBLINGS_MAX ? failures - 1 : DOUBLINGS_MAX;
    uint32_t pause_ms = FIRST_PAUSE_MS << doublings;
    pause_ms = pause_ms > min_ms ? pause_ms : min_ms;
    return pause_ms < LONGEST_PAUSE_MS ? pause_ms : LONGEST_PAUSE_MS;
}

bool cli_retry_wait(uint32_t pause_ms, struct fl_error *error)
{
    struct pollfd polled = {.fd = cli_interrupt_fd(), .events = POLLIN};
    return poll(&polled, 1, (int)pause_ms) <= 0 || fl_error_set(error, FL_ERROR_INTERRUPTED, "", "interrupted");
}
