/* SPDX-License-Identifier: MIT */
#include "file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool fail(char *reason, size_t reason_bytes, int number)
{
    snprintf(reason, reason_bytes, "cannot be written: %s", strerror(number));
    return false;
}

/* 0 or an errno value. */
static int write_all(int fd, const uint8_t *bytes, size_t count)
{
    while (count > 0) {
        const ssize_t written = write(fd, bytes, count);
        if (written < 0 && errno != EINTR)
            return errno;
        if (written > 0) {
            bytes += written;
            count -= (size_t)written;
        }
    }
    return 0;
}

bool file_write(const char *path, const uint8_t *bytes, size_t count, char *reason, size_t reason_bytes)
{
    char temporary[4200];
    const char *slash = strrchr(path, '/');
    const size_t folder_bytes = slash != NULL ? (size_t)(slash - path) + 1 : 0;
    const int length = snprintf(temporary, sizeof temporary, "%.*s.farlight-XXXXXX", (int)folder_bytes, path);
    if (length < 0 || (size_t)length >= sizeof temporary)
        return fail(reason, reason_bytes, ENAMETOOLONG);
    const int fd = mkostemp(temporary, O_CLOEXEC);
    if (fd < 0)
        return fail(reason, reason_bytes, errno);
    /* mkostemp lets nobody else in; the image is an ordinary file. */
    const mode_t mask = umask(0);
    umask(mask);
    int failure = fchmod(fd, 0666 & ~mask) < 0 ? errno : 0;
    if (failure == 0)
        failure = write_all(fd, bytes, count);
    /* Some file systems say only now that they were full. */
    if (close(fd) < 0 && failure == 0)
        failure = errno;
    if (failure == 0 && rename(temporary, path) < 0)
        failure = errno;
    if (failure == 0)
        return true;
    unlink(temporary);
    return fail(reason, reason_bytes, failure);
}
