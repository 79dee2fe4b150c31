/* SPDX-License-Identifier: MIT */
/* Folder of a daemon: a store for each owner, named by 16 digits. */
#include "store/store.h"

#include "store/files.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define DIGITS 16
#define TRIES 40 /* for a folder whose former process is ending, .. */
#define TRY_US 50000

struct store_folder {
    int fd, lock_file;
};

struct store_folder *store_claim(const char *path, struct error *error)
{
    struct store_folder *folder = malloc(sizeof(*folder));
    if (!folder) {
        error_set(error, ERROR_OUT_OF_MEMORY, "scenes.store", "no memory");
        return NULL;
    }
    folder->fd = store_folder_open(AT_FDCWD, path, error);
    folder->lock_file = folder->fd < 0 ? -1 : store_folder_lock(folder->fd, path, error);
    if (folder->lock_file >= 0)
        return folder;
    store_release(folder);
    return NULL;
}

void store_release(struct store_folder *folder)
{
    if (!folder)
        return;
    if (folder->lock_file >= 0)
        close(folder->lock_file);
    if (folder->fd >= 0)
        close(folder->fd);
    free(folder);
}

/* ---- owners with records ---- */

struct listing {
    int fd;
    uint64_t *owners;
    size_t count, max;
};

static void count_record(void *context, const char *name)
{
    (void)name;
    ++*(size_t *)context;
}

static bool has_record(int folder, const char *name)
{
    char path[DIGITS + sizeof("/scenes")];
    size_t records = 0;
    snprintf(path, sizeof(path), "%.*s/scenes", DIGITS, name);
    const int scenes = openat(folder, path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    const bool has = scenes >= 0 && store_folder_each(scenes, count_record, &records, NULL) && records > 0;
    if (scenes >= 0)
        close(scenes);
    return has;
}

static void list_owner(void *context, const char *name)
{
    struct listing *listing = context;
    char *end;
    const uint64_t owner = strtoull(name, &end, 16);
    if (strspn(name, "0123456789abcdef") == DIGITS && *end == '\0' && listing->count < listing->max &&
        has_record(listing->fd, name))
        listing->owners[listing->count++] = owner;
}

size_t store_owners(const struct store_folder *folder, uint64_t *owners, size_t max)
{
    struct listing listing = {.fd = folder->fd, .owners = owners, .max = max};
    return store_folder_each(folder->fd, list_owner, &listing, NULL) ? listing.count : 0;
}

/* ---- single owners ---- */

bool store_owner_path(char path[PATH_MAX], const char *folder, uint64_t owner, struct error *error)
{
    return snprintf(path, PATH_MAX, "%s/%016" PRIx64, folder, owner) < PATH_MAX ||
           error_set(error, ERROR_INVALID, "scenes.store", "the path is too long");
}

struct store *store_open_owner(const char *folder, uint64_t owner, uint64_t limit_bytes, struct error *error)
{
    char own[PATH_MAX];
    if (!store_owner_path(own, folder, owner, error))
        return NULL;
    for (unsigned i = 0;; i++) {
        struct error busy = {0};
        struct store *store = store_open(own, limit_bytes, &busy);
        if (store)
            return store;
        if (busy.kind != ERROR_BUSY || i == TRIES) {
            if (error)
                *error = busy;
            return NULL;
        }
        usleep(TRY_US);
    }
}
