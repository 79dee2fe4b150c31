/* SPDX-License-Identifier: MIT */
/* Complete reads and writes. */
#include "base/file_io.h"

#include <errno.h>
#include <unistd.h>

bool file_read_all(int file, void *data, size_t bytes)
{
    for (char *at = data; bytes > 0;) {
        const ssize_t count = read(file, at, bytes);
        if (count < 0 && errno == EINTR)
            continue;
        if (count <= 0)
            return false;
        at += count;
        bytes -= (size_t)count;
    }
    return true;
}

bool file_write_all(int file, const void *data, size_t bytes)
{
    for (const char *at = data; bytes > 0;) {
        const ssize_t count = write(file, at, bytes);
        if (count < 0 && errno == EINTR)
            continue;
        if (count <= 0)
            return false;
        at += count;
        bytes -= (size_t)count;
    }
    return true;
}
