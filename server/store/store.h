/* SPDX-License-Identifier: MIT */
/* Records and their blobs in a folder, kept for the next process. Any thread; a call waits for the one before. */
#ifndef FARLIGHT_STORE_STORE_H
#define FARLIGHT_STORE_STORE_H

#include "base/blob.h"
#include "base/error.h"

#include <limits.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define STORE_NAME_BYTES 16

struct store;

struct store_record {
    uint8_t name[STORE_NAME_BYTES]; /* replaces a record of the same name */
    uint64_t owner;                 /* owners share the store: the one with the most bytes is evicted from first */
    uint8_t *content;               /* owned, malloc'ed */
    size_t content_bytes;
    struct blob **blobs; /* owned: an array of references, each blob once or more */
    size_t blob_count;
};
void store_record_finish(struct store_record *record); /* releases its contents, not the struct */

/* A daemon's folder, with a store for each owner. */
struct store_folder;
/* Locks the folder for this process, and makes it if its parent exists. NULL and *error: as for store_open(). */
struct store_folder *store_claim(const char *path, struct error *error);
void store_release(struct store_folder *folder); /* accepts NULL */
/* Lists owners with a record in it, at most `max`. */
size_t store_owners(const struct store_folder *folder, uint64_t *owners, size_t max);
/* Path of the owner's store in such a folder. False and *error: it is too long. */
bool store_owner_path(char path[PATH_MAX], const char *folder, uint64_t owner, struct error *error);
/* Opens that store. If a process that is about to end still has it, the call waits. */
struct store *store_open_owner(const char *folder, uint64_t owner, uint64_t limit_bytes, struct error *error);

/* Opens the folder, and makes it if its parent exists. Records that cannot be used are removed, with a line in
 * the log. NULL and *error: it is not the user's own, another process uses it, or it cannot be read. */
struct store *store_open(const char *folder, uint64_t limit_bytes, struct error *error);
void store_close(struct store *store); /* accepts NULL */

/* Writes the record and those of its blobs that are missing. False and *error: it is greater than the limit,
 * the disk fails, or *abandoned was set on the way (ERROR_CANCELLED); except for the first reason the previous
 * record of that name stays. */
bool store_put(struct store *store, const struct store_record *record, const atomic_bool *abandoned,
               struct error *error);
/* Removes a record, with the blobs that no other one uses. */
void store_remove(struct store *store, const uint8_t name[STORE_NAME_BYTES]);

/* Lists the names of all records, the oldest first: an array to free(). NULL: out of memory. */
uint8_t (*store_names(struct store *store, size_t *count))[STORE_NAME_BYTES];
/* Reads a record without its blobs, and marks it: if the process ends before store_tried(), the next one will
 * skip it. False and *error: it does not exist, or is damaged. */
bool store_try(struct store *store, const uint8_t name[STORE_NAME_BYTES], struct store_record *record,
               struct error *error);
void store_tried(struct store *store, const uint8_t name[STORE_NAME_BYTES]);
/* Reads a blob and verifies it; the reference is the caller's. NULL and *error: it does not exist, or is
 * damaged. */
struct blob *store_read_blob(struct store *store, const uint8_t hash[BLOB_HASH_BYTES], uint64_t size_bytes,
                             struct error *error);

#endif
