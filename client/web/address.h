/* SPDX-License-Identifier: MIT */
/* Where the page is served, and by what names of this machine browsers may ask for it. No I/O. */
#ifndef FARLIGHT_CLIENT_WEB_ADDRESS_H
#define FARLIGHT_CLIENT_WEB_ADDRESS_H

#include "lib/farlight.h"

struct web_address {
    char host[64]; /* an address in digits, IPv6 without brackets */
    int port;      /* 0: the kernel chooses one */
    bool is_v6;
    bool is_loopback; /* only this machine can come there */
    bool is_any;      /* all addresses of this machine; of IPv6 those of IPv4 as well */
};

/* "127.0.0.1:8080", "[::1]:8080" or "localhost:8080", which is 127.0.0.1. */
bool web_address_read(const char *text, struct web_address *address, struct fl_error *error);
/* "127.0.0.1" or "[::1]", as a link has it. */
void web_address_print(const struct web_address *address, char *text, size_t text_bytes);

/* Whether a browser that sends this as Host cannot be another site's page whose name was made to lead here (DNS
 * rebinding): an address in digits, localhost, or one of the names; with or without a port. */
bool web_host_is_ours(const char *host, const char *const *names, size_t name_count);

#endif
