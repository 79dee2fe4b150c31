/* SPDX-License-Identifier: MIT */
/* The conversation of a helper program with the program that started it: messages in, answers out. */
#ifndef FARLIGHT_CLIENT_HELPER_CHANNEL_H
#define FARLIGHT_CLIENT_HELPER_CHANNEL_H

#include "protocol/framing.h"
#include "protocol/messages.h"

struct channel {
    int fd;              /* connected stream socket */
    const char *program; /* for standard error */
    /* Called for each message; what it points at lives as long as the call. False: it does not belong here. */
    bool (*handle)(void *user, uint32_t request, const struct message *message);
    void *user;
    uint8_t *buffer; /* from here on: channel_run's */
    size_t start, end;
    struct scratch scratch;
};

/* Hands over one message after the other until the other side ends. False, with a line on standard error: it broke
 * the protocol, or there is no memory. */
bool channel_run(struct channel *channel);
/* Blocks until the kernel has it. False: nobody is there any more. */
bool channel_send(const struct channel *channel, uint32_t request, const struct message *message);
/* Answers with an error. The texts are shortened to what a message holds; `remedy` may be NULL. */
bool channel_send_failure(const struct channel *channel, uint32_t request, const char *field, const char *reason,
                          const char *remedy);

#endif
