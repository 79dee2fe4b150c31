/* SPDX-License-Identifier: MIT */
/* Addresses at which the page is served, and names of this machine that browsers may use. No I/O. */
#ifndef FARLIGHT_CLIENT_WEB_ADDRESS_H
#define FARLIGHT_CLIENT_WEB_ADDRESS_H

#include "lib/farlight.h"

struct web_address {
    char host[64]; /* an address in digits, IPv6 without brackets */
    int port;      /* 0: the kernel chooses one */
    bool is_v6;
    bool is_loopback; /* reachable from this machine only */
    bool is_any;      /* every address of this machine; for IPv6 including those of IPv4 */
};

/* Reads "127.0.0.1:8080", "[::1]:8080" or "localhost:8080", which is 127.0.0.1. */
bool web_address_read(const char *text, struct web_address *address, struct fl_error *error);
/* Prints "127.0.0.1" or "[::1]", as in a link. */
void web_address_print(const struct web_address *address, char *text, size_t text_bytes);

/* True if a browser that sends this Host is safe from DNS rebinding, where another site's name leads to this
 * machine: the host is an address in digits, localhost, or one of the names; with or without a port. */
bool web_host_is_ours(const char *host, const char *const *names, size_t name_count);

#endif
