/* SPDX-License-Identifier: MIT */
/* The server for HTTP and WebSockets: serves the page to holders of the link, and a seat to each WebSocket. */
#ifndef FARLIGHT_CLIENT_WEB_GATEWAY_H
#define FARLIGHT_CLIENT_WEB_GATEWAY_H

#include "web/address.h"
#include "web/seat.h"

#define GATEWAY_LISTENS_MAX 4
#define GATEWAY_HOSTS_MAX 8

struct gateway_options {
    struct seat_options seat; /* may_edit, changed and user are ignored */
    struct web_address listens[GATEWAY_LISTENS_MAX];
    size_t listen_count;
    const char *hosts[GATEWAY_HOSTS_MAX + 1]; /* names that browsers may use, besides addresses and localhost */
    size_t host_count;
    unsigned viewers; /* maximum number of WebSockets */
    bool allow_edit;  /* creates a second link, whose holders may edit */
    int (*interrupt_signal)(void);
    bool (*has_failed)(void *user); /* true once the shown scene is gone for good; NULL: never */
    void *user;
};

struct gateway;

/* Listens, but serves nothing yet. The options must outlive the gateway. */
struct gateway *gateway_create(const struct gateway_options *options, struct fl_error *error);
/* Prints the link, or with allow_edit both, viewing first, and serves until a signal arrives, which is
 * FL_ERROR_INTERRUPTED, or until has_failed, which leaves the error unchanged. */
void gateway_run(struct gateway *gateway, struct fl_error *error);
void gateway_destroy(struct gateway *gateway);

#endif
