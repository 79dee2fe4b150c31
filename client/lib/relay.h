/* SPDX-License-Identifier: MIT */
/* The messages that an importer may send to a daemon, decided without any I/O.
 *
 * The importer is a separate, distrusted program: it may offer and send blobs and edit the one scene that is
 * being loaded, nothing else. Its requests are numbered from 1 upwards; the daemon sees them shifted by
 * `request_base`, so that they cannot be mistaken for ours. */
#ifndef FARLIGHT_CLIENT_LIB_RELAY_H
#define FARLIGHT_CLIENT_LIB_RELAY_H

#include "lib/farlight.h"
#include "protocol/framing.h"

struct fl_relay {
    uint32_t scene;        /* the daemon's; the importer knows it as 1 */
    uint32_t request_base; /* our last request before the import */
    uint32_t max_request;  /* the importer's highest request so far */
    uint64_t upload_base;  /* bytes sent on the upload channel before the import */
};

enum fl_relay_verdict {
    FL_RELAY_FORWARD, /* pass to the daemon, as *request */
    FL_RELAY_LOCAL,   /* meant for the client */
    FL_RELAY_REFUSE,  /* not allowed: *error has the reason; the importer must be ended */
};

/* May change message->edit_begin.scene to the daemon's number. */
enum fl_relay_verdict fl_relay_from_importer(struct fl_relay *relay, const struct framing_header *header,
                                             struct message *message, uint32_t *request, struct fl_error *error);
/* True if a daemon's message answers the importer; *request is then the importer's own number. */
bool fl_relay_from_daemon(const struct fl_relay *relay, const struct framing_header *header, uint32_t *request);
/* The daemon's total for the upload channel in the importer's count. */
uint64_t fl_relay_credit(const struct fl_relay *relay, uint64_t daemon_total);

#endif
