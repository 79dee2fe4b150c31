/* SPDX-License-Identifier: MIT */
/* Files of a private folder: complete writes, verified reads, and a lock. */
#include "store/files.h"

#include "base/file_io.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* Bytes between two checks whether the work was abandoned. */
#define CHUNK_BYTES ((size_t)4 << 20)

static bool is_own_alone(int folder, const char *path, struct error *error)
{
    struct stat about;
    if (fstat(folder, &about) < 0)
        return error_set(error, ERROR_INTERNAL, path, "%s", strerror(errno));
    if (about.st_uid == geteuid() && !(about.st_mode & (S_IRWXG | S_IRWXO)))
        return true;
    error_set(error, ERROR_DENIED, path, "others may enter the folder, or it belongs to another user");
    return error_remedy(error, "give it to the daemon's user, with mode 0700");
}

int store_folder_open(int at, const char *path, struct error *error)
{
    if (mkdirat(at, path, S_IRWXU) < 0 && errno != EEXIST) {
        error_set(error, ERROR_INVALID, path, "the folder cannot be made: %s", strerror(errno));
        return -1;
    }
    int folder = openat(at, path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (folder < 0) {
        error_set(error, ERROR_INVALID, path, "the folder cannot be opened: %s", strerror(errno));
        return -1;
    }
    if (is_own_alone(folder, path, error))
        return folder;
    close(folder);
    return -1;
}

static bool write_chunks(int fd, const char *at, size_t size_bytes, const atomic_bool *abandoned,
                         struct error *error)
{
    for (size_t left_bytes = size_bytes; left_bytes;) {
        if (abandoned && atomic_load(abandoned))
            return error_set(error, ERROR_CANCELLED, "", "the daemon stops");
        const size_t chunk_bytes = left_bytes < CHUNK_BYTES ? left_bytes : CHUNK_BYTES;
        if (!file_write_all(fd, at, chunk_bytes))
            return error_set(error, ERROR_INTERNAL, "", "%s", strerror(errno));
        at += chunk_bytes;
        left_bytes -= chunk_bytes;
    }
    return true;
}

bool store_file_write(int folder, const char *name, const void *data, size_t size_bytes,
                      const atomic_bool *abandoned, struct error *error)
{
    char new_name[NAME_MAX + 1];
    snprintf(new_name, sizeof(new_name), "%s" STORE_FILE_NEW_SUFFIX, name);
    unlinkat(folder, new_name, 0);
    int fd = openat(folder, new_name, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
    if (fd < 0)
        return error_set(error, ERROR_INTERNAL, name, "%s", strerror(errno));
    bool written = write_chunks(fd, data, size_bytes, abandoned, error);
    if (written && fdatasync(fd) < 0)
        written = error_set(error, ERROR_INTERNAL, name, "%s", strerror(errno));
    if (close(fd) < 0 && written)
        written = error_set(error, ERROR_INTERNAL, name, "%s", strerror(errno));
    if (written && renameat(folder, new_name, folder, name) < 0)
        written = error_set(error, ERROR_INTERNAL, name, "%s", strerror(errno));
    if (!written)
        unlinkat(folder, new_name, 0);
    return written;
}

bool store_file_size(int folder, const char *name, uint64_t *size_bytes)
{
    struct stat about;
    if (fstatat(folder, name, &about, AT_SYMLINK_NOFOLLOW) < 0 || !S_ISREG(about.st_mode))
        return false;
    *size_bytes = (uint64_t)about.st_size;
    return true;
}

bool store_file_read(int folder, const char *name, void *data, size_t size_bytes, struct error *error)
{
    /* O_NONBLOCK: opening a pipe of that name must not wait. */
    int fd = openat(folder, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return error_set(error, ERROR_INTERNAL, name, "%s", strerror(errno));
    char beyond;
    const bool complete = file_read_all(fd, data, size_bytes) && read(fd, &beyond, 1) == 0;
    close(fd);
    return complete || error_set(error, ERROR_INTERNAL, name, "the file has not the %zu bytes that it should have",
                                 size_bytes);
}

bool store_folder_each(int folder, void (*each)(void *context, const char *name), void *context,
                       struct error *error)
{
    int copy = openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *entries = copy < 0 ? NULL : fdopendir(copy);
    if (!entries) {
        if (copy >= 0)
            close(copy);
        return error_set(error, ERROR_INTERNAL, "", "the folder cannot be read: %s", strerror(errno));
    }
    for (const struct dirent *entry; (entry = readdir(entries));) {
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            each(context, entry->d_name);
    }
    closedir(entries);
    return true;
}

int store_folder_lock(int folder, const char *path, struct error *error)
{
    int fd = openat(folder, "lock", O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, S_IRUSR | S_IWUSR);
    if (fd >= 0 && flock(fd, LOCK_EX | LOCK_NB) == 0)
        return fd;
    if (errno == EWOULDBLOCK)
        error_set(error, ERROR_BUSY, path, "another daemon uses the folder");
    else
        error_set(error, ERROR_INVALID, path, "%s", strerror(errno));
    error_remedy(error, "give each daemon a folder of its own in scenes.store");
    if (fd >= 0)
        close(fd);
    return -1;
}
