/* SPDX-License-Identifier: MIT */
/* Files of keys. */
#include "protocol/sealed/key.h"

#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/sealed/secret.h"

static bool invalid(struct decode_error *error, const char *path, const char *what)
{
    return decode_error_set(error, PROTOCOL_ERROR_INVALID, path, "%s", what);
}

static bool denied(struct decode_error *error, const char *path, const char *what)
{
    return decode_error_set(error, PROTOCOL_ERROR_DENIED, path, "%s", what);
}

/* Checks the open file, so that its name cannot lead elsewhere meanwhile. */
static bool check(int fd, const char *path, struct decode_error *error)
{
    struct stat status;
    if (fstat(fd, &status) < 0) {
        return invalid(error, path, strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) {
        return invalid(error, path, "is not a regular file, so it cannot hold a key");
    }
    if (status.st_uid != geteuid()) {
        return denied(error, path, "belongs to another user");
    }
    if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
        return decode_error_set(error, PROTOCOL_ERROR_DENIED, path,
                                "is open to others (mode %04o): 'chmod 600' closes it",
                                (unsigned)status.st_mode & 07777);
    }
    if (status.st_size != SEALED_KEY_BYTES) {
        return decode_error_set(error, PROTOCOL_ERROR_INVALID, path, "has %lld bytes in place of the 32 of a key",
                                (long long)status.st_size);
    }
    return true;
}

static bool read_whole(int fd, struct sealed_key *key)
{
    size_t used = 0;
    while (used < sizeof(key->bytes)) {
        const ssize_t got = read(fd, key->bytes + used, sizeof(key->bytes) - used);
        if (got > 0) {
            used += (size_t)got;
        } else if (got == 0 || errno != EINTR) {
            return false;
        }
    }
    return true;
}

bool sealed_key_read(struct sealed_key *key, const char *path, struct decode_error *error)
{
    memset(key, 0, sizeof(*key));
    /* O_NONBLOCK avoids waiting for the writer of a pipe. */
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
    if (fd < 0) {
        return invalid(error, path, strerror(errno));
    }
    bool ok = check(fd, path, error);
    if (ok && !read_whole(fd, key)) {
        ok = invalid(error, path, "cannot be read");
    }
    close(fd);
    if (!ok) {
        sodium_memzero(key, sizeof(*key));
    }
    return ok;
}

static bool write_whole(int fd, const struct sealed_key *key)
{
    size_t used = 0;
    while (used < sizeof(key->bytes)) {
        const ssize_t put = write(fd, key->bytes + used, sizeof(key->bytes) - used);
        if (put >= 0) {
            used += (size_t)put;
        } else if (errno != EINTR) {
            return false;
        }
    }
    return fsync(fd) == 0 || errno == EINVAL; /* a file system may have nothing to sync */
}

bool sealed_key_create(const char *path, struct decode_error *error)
{
    if (sodium_init() < 0) {
        return invalid(error, path, "there are no random numbers");
    }
    const int fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR);
    if (fd < 0) {
        return invalid(error, path, errno == EEXIST ? "is there already, and is left alone" : strerror(errno));
    }
    struct sealed_key *key = secret_create(sizeof(*key));
    if (key) {
        randombytes_buf(key->bytes, sizeof(key->bytes));
    }
    errno = ENOMEM;
    bool ok = key && fchmod(fd, S_IRUSR | S_IWUSR) == 0 && write_whole(fd, key);
    const int why = errno;
    secret_destroy(key);
    if (close(fd) < 0 || !ok) {
        unlink(path);
        return invalid(error, path, strerror(why));
    }
    return true;
}
