/* SPDX-License-Identifier: MIT */
/* A hub with the recorder for an engine, and clients of it on socket pairs, all on one thread and in a time of
 * their own: what a test does not let happen does not happen. Programs that use it are linked with
 * --wrap=clock_now_ns. */
#ifndef FARLIGHT_TESTS_SERVING_H
#define FARLIGHT_TESTS_SERVING_H

#include "protocol/framing.h"
#include "session/hub.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SERVING_CLIENTS 3

struct serving_client {
    int fd;                /* -1: not connected */
    uint64_t number;       /* the hub's for it */
    bool greeted, stalled; /* a stalled one does not read */
    uint8_t *in;
    size_t in_used;
    uint64_t received_bytes;
    uint32_t answers[MESSAGE_FRAME_END +
                     1]; /* messages that came, by type; those that may be ignored are not counted */
    uint32_t errors;     /* set of enum protocol_error_code, as bits */
};

extern struct hub serving_hub;
extern struct serving_client serving_clients[SERVING_CLIENTS];

void serving_begin(void);
/* False: the hub did not let it in. */
bool serving_connect(unsigned client);
/* From now on it may only look. */
void serving_restrict(unsigned client);
/* The daemon reads as it comes. False: it has closed the connection. */
bool serving_send(unsigned client, const uint8_t *bytes, size_t count);
void serving_greet(unsigned client);
void serving_disconnect(unsigned client);
/* Until everybody has done what there is to do now. */
void serving_settle(void);
void serving_wait(uint64_t ns);
/* Everybody goes. Requires that nothing is left of them, and ends. */
void serving_end(void);
/* Nobody is connected: requires that nothing is left of them, and that the next one is served. */
void serving_check_empty(void);
void serving_check_next(void);

#endif
