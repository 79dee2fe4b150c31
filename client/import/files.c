/* SPDX-License-Identifier: MIT */
#include "files.h"

#include "import.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/openat2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#define OPEN_FLAGS (O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY) /* nonblocking: a FIFO must not hold us */

static bool is_regular(int descriptor, char reason[FILES_REASON_BYTES])
{
    struct stat status;

    if (fstat(descriptor, &status) != 0) {
        snprintf(reason, FILES_REASON_BYTES, "%s", strerror(errno));
        return false;
    }
    if (S_ISREG(status.st_mode))
        return true;
    snprintf(reason, FILES_REASON_BYTES, "is %s, not a regular file",
             S_ISDIR(status.st_mode)    ? "a folder"
             : S_ISFIFO(status.st_mode) ? "a FIFO"
             : S_ISSOCK(status.st_mode) ? "a socket"
                                        : "a device");
    return false;
}

static int open_regular(const char *path, char reason[FILES_REASON_BYTES])
{
    int descriptor = open(path, OPEN_FLAGS);

    if (descriptor < 0) {
        snprintf(reason, FILES_REASON_BYTES, "%s", strerror(errno));
    } else if (!is_regular(descriptor, reason)) {
        close(descriptor);
        descriptor = -1;
    }
    return descriptor;
}

char *files_folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');

    if (!slash)
        return strdup(".");
    return slash == path ? strdup("/") : strndup(path, (size_t)(slash - path));
}

bool files_open(struct files *files, const char *model_path, const char *environment_path,
                char reason[FILES_REASON_BYTES])
{
    *files = (struct files){.folder = -1, .model = -1, .environment = -1};
    if (model_path) {
        char *folder;

        files->model = open_regular(model_path, reason);
        if (files->model < 0)
            return false;
        folder = files_folder_of(model_path);
        if (folder)
            files->folder = open(folder, O_PATH | O_DIRECTORY | O_CLOEXEC);
        free(folder);
        if (files->folder < 0) {
            snprintf(reason, FILES_REASON_BYTES, "its folder cannot be opened: %s", strerror(errno));
            return false;
        }
    }
    if (environment_path) {
        files->environment = open_regular(environment_path, reason);
        return files->environment >= 0;
    }
    return true;
}

void files_finish(struct files *files)
{
    if (files->folder >= 0)
        close(files->folder);
    if (files->model >= 0)
        close(files->model);
    if (files->environment >= 0)
        close(files->environment);
    files->folder = files->model = files->environment = -1;
}

/* Reads until the end; the size that the file system states is only where the buffer begins. */
static unsigned char *read_all(int descriptor, uint64_t room_bytes, size_t *size_bytes,
                               char reason[FILES_REASON_BYTES])
{
    struct stat status;
    size_t capacity = 0, used = 0;
    unsigned char *bytes = NULL;

    if (fstat(descriptor, &status) == 0 && status.st_size > 0)
        capacity = ((uint64_t)status.st_size < room_bytes ? (size_t)status.st_size : (size_t)room_bytes) + 1;
    for (;;) {
        ssize_t got;

        if (!bytes || used == capacity) {
            unsigned char *grown;

            if (used > room_bytes) {
                snprintf(reason, FILES_REASON_BYTES, "is larger than %llu MiB",
                         (unsigned long long)(room_bytes >> 20));
                break;
            }
            if (bytes || capacity == 0)
                capacity += capacity / 2 + 4096;
            grown = realloc(bytes, capacity + 1);
            if (!grown) {
                snprintf(reason, FILES_REASON_BYTES, "out of memory");
                break;
            }
            bytes = grown;
        }
        got = read(descriptor, bytes + used, capacity - used);
        if (got == 0 || (got < 0 && errno != EINTR)) {
            if (got == 0 && used <= room_bytes) {
                bytes[used] = '\0';
                *size_bytes = used;
                return bytes;
            }
            snprintf(reason, FILES_REASON_BYTES, "%s", got == 0 ? "is too large" : strerror(errno));
            break;
        }
        if (got > 0)
            used += (size_t)got;
    }
    free(bytes);
    return NULL;
}

unsigned char *files_read_descriptor(struct files *files, int descriptor, size_t *size_bytes,
                                     char reason[FILES_REASON_BYTES])
{
    uint64_t start_ns = monotonic_now_ns();
    uint64_t room = files->read_bytes < FILES_TOTAL_MAX ? FILES_TOTAL_MAX - files->read_bytes : 0;
    unsigned char *bytes =
        read_all(descriptor, room < FILES_BYTES_MAX ? room : FILES_BYTES_MAX, size_bytes, reason);

    if (bytes)
        files->read_bytes += *size_bytes;
    files->read_ns += monotonic_now_ns() - start_ns;
    return bytes;
}

/* For kernels and containers without openat2: one part at a time, following no link, never upwards. */
static int open_by_parts(int folder, const char *name)
{
    int at = dup(folder);

    while (at >= 0) {
        size_t length = strcspn(name, "/");
        char part[256];
        bool last = name[length] == '\0';
        int next;

        if (length >= sizeof(part)) {
            errno = ENAMETOOLONG;
            break;
        }
        memcpy(part, name, length);
        part[length] = '\0';
        if (strcmp(part, "..") == 0) {
            errno = EXDEV;
            break;
        }
        if (length == 0 && !last) {
            name++;
            continue;
        }
        next =
            openat(at, length == 0 ? "." : part, last ? OPEN_FLAGS | O_NOFOLLOW : O_PATH | O_NOFOLLOW | O_CLOEXEC);
        close(at);
        at = next;
        if (last)
            return at;
        name += length + 1;
    }
    if (at >= 0) {
        int error = errno;

        close(at);
        errno = error;
    }
    return -1;
}

static int open_beneath(int folder, const char *name)
{
    struct open_how how = {.flags = OPEN_FLAGS, .resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS};
    int descriptor = (int)syscall(SYS_openat2, folder, name, &how, sizeof(how));

    if (descriptor < 0 && (errno == ENOSYS || errno == EPERM)) {
        if (name[0] == '/') {
            errno = EXDEV;
            return -1;
        }
        return open_by_parts(folder, name);
    }
    return descriptor;
}

unsigned char *files_read(struct files *files, const char *name, size_t *size_bytes,
                          char reason[FILES_REASON_BYTES])
{
    unsigned char *bytes = NULL;
    int descriptor = open_beneath(files->folder, name);

    if (descriptor < 0 && strchr(name, '\\')) {
        char *slashed = strdup(name);

        for (char *at = slashed; at && *at; at++)
            if (*at == '\\')
                *at = '/';
        if (slashed)
            descriptor = open_beneath(files->folder, slashed);
        free(slashed);
    }
    if (descriptor < 0) {
        snprintf(reason, FILES_REASON_BYTES, "%s",
                 errno == EXDEV ? "lies outside the model's folder" : strerror(errno));
        return NULL;
    }
    if (is_regular(descriptor, reason))
        bytes = files_read_descriptor(files, descriptor, size_bytes, reason);
    close(descriptor);
    return bytes;
}
