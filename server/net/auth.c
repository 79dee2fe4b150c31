/* SPDX-License-Identifier: MIT */
#include "net/auth.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>

bool auth_identify(struct auth_identity *identity, int fd, const struct address *peer, bool insecure,
                   struct error *error)
{
    *identity = (struct auth_identity){0};
    if (address_is_unix(peer)) {
        struct ucred credentials = {0};
        socklen_t bytes = sizeof credentials;
        if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &bytes) < 0)
            return error_set(error, ERROR_DENIED, "peer", "the kernel does not say who it is: %s",
                             strerror(errno));
        identity->known = true;
        identity->user = credentials.uid;
        snprintf(identity->name, sizeof identity->name, "user %u", (unsigned)credentials.uid);
        return true;
    }
    char text[ADDRESS_TEXT_BYTES];
    address_print(peer, text);
    snprintf(identity->name, sizeof identity->name, "%.39s", text);
    if (insecure || address_is_loopback(peer))
        return true;
    return error_set(error, ERROR_DENIED, "peer", "%s is not on this host", text);
}
