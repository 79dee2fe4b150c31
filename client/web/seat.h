/* SPDX-License-Identifier: MIT */
/* One browser's view of the scene: a thread with a connection of its own to the daemon. */
#ifndef FARLIGHT_CLIENT_WEB_SEAT_H
#define FARLIGHT_CLIENT_WEB_SEAT_H

#include "web/outage.h"
#include "web/queue.h"
#include "web/request.h"

struct cli_job;

struct seat_options {
    const char *server, *key_file, *scene; /* as of fl_connect and fl_scene_attach */
    const struct cli_job *job;             /* its camera, and its options, which views begin with */
    struct web_outage *outage;             /* NULL: what happens to the daemon is told elsewhere */
    bool may_edit;
    void (*changed)(void *user); /* there is a parcel, or it has ended; from the thread */
    void *user;
};

struct seat;

/* The options and what they point to must outlive it. It connects once the first WEB_SHOW has come. */
struct seat *seat_create(const struct seat_options *options, struct fl_error *error);
/* False: the browser may not ask that, or not yet. */
bool seat_tell(struct seat *seat, const struct web_request *request);
/* The next one, to be freed; NULL: none. *has_ended: and none will come. */
struct parcel *seat_take(struct seat *seat, bool *has_ended);
/* Leaves the daemon and waits for the thread. */
void seat_destroy(struct seat *seat);

#endif
