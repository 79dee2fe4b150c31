/* SPDX-License-Identifier: MIT */
/* A browser's seat: its view of the scene, in a thread with its own connection to the daemon. */
#ifndef FARLIGHT_CLIENT_WEB_SEAT_H
#define FARLIGHT_CLIENT_WEB_SEAT_H

#include "web/outage.h"
#include "web/queue.h"
#include "web/request.h"

struct cli_job;

struct seat_options {
    const char *server, *key_file, *scene; /* see fl_connect and fl_scene_attach */
    const struct cli_job *job;             /* camera and options of the first view */
    struct web_outage *outage;             /* NULL: outages are reported elsewhere */
    bool may_edit;
    void (*changed)(void *user); /* called from the thread: there is a parcel, or the seat has ended */
    void *user;
};

struct seat;

/* Creates a seat, which connects after the first WEB_SHOW. The options and the objects that they point to must
 * outlive it. */
struct seat *seat_create(const struct seat_options *options, struct fl_error *error);
/* Passes a request on. False: the browser may not make it, or not yet. */
bool seat_request(struct seat *seat, const struct web_request *request);
/* The next parcel, which the caller frees; NULL: none. *has_ended: no more will follow. */
struct parcel *seat_take(struct seat *seat, bool *has_ended);
/* Disconnects from the daemon and waits for the thread. */
void seat_destroy(struct seat *seat);

#endif
