/* SPDX-License-Identifier: MIT */
/* Messages to the service manager. */
#include "net/notify.h"

#include "base/log.h"

#include <errno.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

/* Timeout for a manager that does not read: clients wait meanwhile. */
#define WAIT_US 100000

void notify_manager(const char *state)
{
    const char *path = getenv("NOTIFY_SOCKET");
    if (!path || (path[0] != '/' && path[0] != '@'))
        return;
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    size_t bytes = strlen(path);
    if (bytes >= sizeof(address.sun_path))
        return;
    memcpy(address.sun_path, path, bytes);
    if (path[0] == '@')
        address.sun_path[0] = '\0'; /* abstract name: no file, and no NUL at its end */
    int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    socklen_t address_bytes = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + bytes);
    const struct timeval wait = {.tv_usec = WAIT_US};
    if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &wait, sizeof(wait)) < 0 ||
        sendto(fd, state, strlen(state), MSG_NOSIGNAL, (const struct sockaddr *)&address, address_bytes) < 0)
        log_write(LOG_WARNING, "net", "cannot tell the service manager %s: %s", state, strerror(errno));
    if (fd >= 0)
        close(fd);
}

uint64_t notify_watchdog_ns(void)
{
    const char *usec = getenv("WATCHDOG_USEC"), *pid = getenv("WATCHDOG_PID");
    /* Without $WATCHDOG_PID the watchdog is meant for any process. */
    if (!usec || (pid && strtoull(pid, NULL, 10) != (unsigned long long)getpid()))
        return 0;
    unsigned long long interval_us = strtoull(usec, NULL, 10);
    return interval_us < UINT64_MAX / 1000 ? interval_us * 1000 : 0;
}
