/* SPDX-License-Identifier: MIT */
/* Addresses in the form that people write: "unix:/run/farlight/farlight.sock", "tcp:127.0.0.1:4170",
 * "tcp:[::1]:0". */
#ifndef FARLIGHT_NET_ADDRESS_H
#define FARLIGHT_NET_ADDRESS_H

#include "base/error.h"

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>

#define ADDRESS_TEXT_BYTES 160

struct address {
    struct sockaddr_storage storage;
    socklen_t storage_bytes;
};

/* Parses an address; looks up a host name and uses the first answer. Error field: the text. */
bool address_parse(struct address *address, const char *text, struct error *error);
/* Prints an address in its written form. */
void address_print(const struct address *address, char text[ADDRESS_TEXT_BYTES]);
bool address_is_unix(const struct address *address);
bool address_is_loopback(const struct address *address); /* false for unix */
const char *address_path(const struct address *address); /* unix only */
/* Number of the network that one owner usually has: an IPv4 address, the first half of an IPv6 address. 0 for
 * Unix. */
uint64_t address_network(const struct address *address);

#endif
