/* SPDX-License-Identifier: MIT */
/* A helper program's channel to its parent: messages in, answers out. */
#ifndef FARLIGHT_CLIENT_HELPER_CHANNEL_H
#define FARLIGHT_CLIENT_HELPER_CHANNEL_H

#include "protocol/framing.h"
#include "protocol/messages.h"

struct channel {
    int fd;              /* connected stream socket */
    const char *program; /* name for standard error */
    /* Called for each message, which is valid during the call. False: the message is not allowed here. */
    bool (*handle)(void *user, uint32_t request, const struct message *message);
    void *user;
    uint8_t *buffer; /* channel_run's, with all members below */
    size_t start, end;
    struct scratch scratch;
};

/* Passes each message to `handle` until the other side closes. False, with a line on standard error: it broke
 * the protocol, or there is no memory. */
bool channel_run(struct channel *channel);
/* Blocks until the kernel has the message. False: the other side has closed. */
bool channel_send(const struct channel *channel, uint32_t request, const struct message *message);
struct channel_failure {
    const char *field, *reason;
    const char *remedy; /* may be NULL */
    bool retryable;     /* a later request may succeed */
};
/* Answers with an error. The texts are shortened to fit into a message. */
bool channel_send_failure(const struct channel *channel, uint32_t request, const struct channel_failure *failure);

#endif
