/* SPDX-License-Identifier: MIT */
/* Atomic writing and bounded reading of files. */
#include "file.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#define FILE_BYTES_MAX (UINT64_C(1) << 36)

static bool lacked_space;

bool file_is_lack_of_space(int number)
{
    return number == ENOSPC || number == EDQUOT;
}

bool file_lacked_space(void)
{
    return lacked_space;
}

static bool fail(char *reason, size_t reason_bytes, int number)
{
    lacked_space = file_is_lack_of_space(number);
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

/* Temporary name of the unfinished file, for the signal handler that removes it. */
static char unfinished[4200];
static volatile sig_atomic_t is_unfinished;

static void on_end(int number)
{
    if (is_unfinished)
        unlink(unfinished);
    _exit(128 + number);
}

void file_clean_up_on_end(void)
{
    signal(SIGTERM, on_end);
}

uint64_t file_bytes_limit(void)
{
    struct rlimit limit = {0};
    if (getrlimit(RLIMIT_FSIZE, &limit) < 0 || limit.rlim_cur > FILE_BYTES_MAX)
        return FILE_BYTES_MAX;
    return limit.rlim_cur;
}

int file_begin(const char *path, char *reason, size_t reason_bytes)
{
    lacked_space = false;
    const char *slash = strrchr(path, '/');
    const size_t folder_bytes = slash ? (size_t)(slash - path) + 1 : 0;
    const int length = snprintf(unfinished, sizeof(unfinished), "%.*s.farlight-XXXXXX", (int)folder_bytes, path);
    if (length < 0 || (size_t)length >= sizeof(unfinished)) {
        fail(reason, reason_bytes, ENAMETOOLONG);
        return -1;
    }
    /* A folder of that name would make the rename fail. */
    struct stat status;
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode)) {
        fail(reason, reason_bytes, EISDIR);
        return -1;
    }
    is_unfinished = 1;
    const int fd = mkostemp(unfinished, O_CLOEXEC);
    if (fd < 0) {
        is_unfinished = 0;
        fail(reason, reason_bytes, errno);
        return -1;
    }
    /* mkostemp grants rights to the owner alone; this is an ordinary file. */
    const mode_t mask = umask(0);
    umask(mask);
    if (fchmod(fd, 0666 & ~mask) == 0)
        return fd;
    fail(reason, reason_bytes, errno);
    file_abandon(fd);
    return -1;
}

const char *file_temporary_name(void)
{
    const char *slash = strrchr(unfinished, '/');
    return slash ? slash + 1 : unfinished;
}

bool file_finish(int fd, const char *path, char *reason, size_t reason_bytes)
{
    /* Some file systems report only now that they were full. */
    int failure = close(fd) < 0 ? errno : 0;
    if (failure == 0 && rename(unfinished, path) < 0)
        failure = errno;
    if (failure != 0)
        unlink(unfinished);
    is_unfinished = 0;
    return failure == 0 || fail(reason, reason_bytes, failure);
}

void file_abandon(int fd)
{
    close(fd);
    unlink(unfinished);
    is_unfinished = 0;
}

bool file_write(const char *path, const uint8_t *bytes, size_t count, char *reason, size_t reason_bytes)
{
    const int fd = file_begin(path, reason, reason_bytes);
    if (fd < 0)
        return false;
    const int failure = write_all(fd, bytes, count);
    if (failure == 0)
        return file_finish(fd, path, reason, reason_bytes);
    file_abandon(fd);
    return fail(reason, reason_bytes, failure);
}

int file_open(const char *path, char *reason, size_t reason_bytes)
{
    struct stat status;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (fd < 0 || fstat(fd, &status) < 0) {
        snprintf(reason, reason_bytes, "cannot be read: %s", strerror(errno));
    } else if (!S_ISREG(status.st_mode)) {
        snprintf(reason, reason_bytes, "is not a file");
    } else {
        return fd;
    }
    if (fd >= 0)
        close(fd);
    return -1;
}

/* Reads until `capacity` bytes or the file's end; *count is the number of bytes read. */
static bool read_up_to(int fd, uint8_t *bytes, size_t capacity, size_t *count)
{
    *count = 0;
    while (*count < capacity) {
        const ssize_t got = pread(fd, bytes + *count, capacity - *count, (off_t)*count);
        if (got < 0 && errno != EINTR)
            return false;
        if (got == 0)
            break;
        if (got > 0)
            *count += (size_t)got;
    }
    return true;
}

bool file_read(int fd, size_t max_bytes, uint8_t **bytes, size_t *count, char *reason, size_t reason_bytes)
{
    struct stat status;
    *bytes = NULL;
    if (fstat(fd, &status) < 0) {
        snprintf(reason, reason_bytes, "cannot be read: %s", strerror(errno));
        return false;
    }
    if (status.st_size <= 0 || (uint64_t)status.st_size > max_bytes) {
        snprintf(reason, reason_bytes, status.st_size <= 0 ? "is empty" : "is larger than %zu MiB",
                 max_bytes >> 20);
        return false;
    }
    /* A file that grows meanwhile is read at its former size. */
    *bytes = malloc((size_t)status.st_size);
    if (*bytes && read_up_to(fd, *bytes, (size_t)status.st_size, count))
        return true;
    snprintf(reason, reason_bytes, "cannot be read: %s", strerror(errno));
    free(*bytes);
    *bytes = NULL;
    return false;
}
