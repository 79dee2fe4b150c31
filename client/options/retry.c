/* SPDX-License-Identifier: MIT */
/* Retries after the loss of a daemon. */
#include "retry.h"
#include "interrupt.h"

#include "lib/text.h"

#include <poll.h>
#include <sys/random.h>

#define FIRST_PAUSE_MS 500u
#define LONGEST_PAUSE_MS 30000u
#define DOUBLINGS_MAX 6u
#define RETRY_MAX_S 2592000.0 /* 30 days */
#define LOST_AFTER_MIN_S 3.0
#define USUAL_TIMEOUT_S 30.0 /* the library's default */

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

bool cli_read_retry_for(const char *value, struct cli_retries *retries, struct fl_error *error)
{
    retries->has_duration = true;
    return fl_text_duration(value, RETRY_MAX_S, &retries->for_s, error);
}

bool cli_read_lost_after(const char *value, struct cli_retries *retries, struct fl_error *error)
{
    double seconds;
    if (!fl_text_duration(value, RETRY_MAX_S, &seconds, error))
        return false;
    if (seconds < LOST_AFTER_MIN_S)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is too short for two pings: at least %g seconds",
                            value, LOST_AFTER_MIN_S);
    retries->lost_after_ms = (unsigned)(seconds * 1e3);
    return true;
}

unsigned cli_connect_timeout_ms(double left_s)
{
    return left_s >= USUAL_TIMEOUT_S ? 0 : left_s > 1 ? (unsigned)(left_s * 1e3) : 1000u;
}

bool cli_retry_wait(uint32_t pause_ms, struct fl_error *error)
{
    struct pollfd polled = {.fd = cli_interrupt_fd(), .events = POLLIN};
    return poll(&polled, 1, (int)pause_ms) <= 0 || fl_error_set(error, FL_ERROR_INTERRUPTED, "", "interrupted");
}
