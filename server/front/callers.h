/* SPDX-License-Identifier: MIT */
/* Clients from their first byte to their hello, with which they go to a worker. */
#ifndef FARLIGHT_FRONT_CALLERS_H
#define FARLIGHT_FRONT_CALLERS_H

#include "front/front.h"

struct worker;

/* Adds a client that connected to our address `own`; takes over the descriptor when it succeeds. */
bool callers_add(struct front *front, int fd, const struct address *own, const struct address *peer,
                 struct error *error);
/* The client at this connected socket, with which the daemon ends; takes over the descriptor when it succeeds. */
bool callers_add_owner(struct front *front, int fd, struct error *error);
/* Hands over the callers that wait for the worker, which is ready. */
void callers_hand_over(struct front *front, struct worker *worker);
/* Refuses the callers that wait for the worker, with the reason. */
void callers_refuse(struct front *front, const struct worker *worker, const char *why);
void callers_close(struct front *front);

#endif
