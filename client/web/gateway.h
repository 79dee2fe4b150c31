/* SPDX-License-Identifier: MIT */
/* HTTP and WebSockets: the page for those who have the link, and a seat for each of its WebSockets. */
#ifndef FARLIGHT_CLIENT_WEB_GATEWAY_H
#define FARLIGHT_CLIENT_WEB_GATEWAY_H

#include "web/address.h"
#include "web/seat.h"

#define GATEWAY_LISTENS_MAX 4
#define GATEWAY_HOSTS_MAX 8

struct gateway_options {
    struct seat_options seat; /* without may_edit, changed and user */
    struct web_address listens[GATEWAY_LISTENS_MAX];
    size_t listen_count;
    const char *hosts[GATEWAY_HOSTS_MAX + 1]; /* names by which browsers may ask, beside addresses and localhost */
    size_t host_count;
    unsigned viewers; /* WebSockets at once */
    bool allow_edit;  /* there is a second link, and who has that may edit */
    int (*interrupt_signal)(void);
    bool (*has_failed)(void *user); /* what is shown is gone for good; NULL: it never is */
    void *user;
};

struct gateway;

/* Listens, and serves nothing yet. The options must outlive it. */
struct gateway *gateway_create(const struct gateway_options *options, struct fl_error *error);
/* Prints the link, or with allow_edit both, that for looking first, and serves until there is a signal, which is
 * FL_ERROR_INTERRUPTED, or has_failed, which leaves the error as it is. */
void gateway_run(struct gateway *gateway, struct fl_error *error);
void gateway_destroy(struct gateway *gateway);

#endif
