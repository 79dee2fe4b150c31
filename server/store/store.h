/* SPDX-License-Identifier: MIT */
/* Records and their blobs in a folder, for the next process. Any thread; a call waits for the one before. */
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
    uint8_t name[STORE_NAME_BYTES]; /* one of the same name takes its place */
    uint64_t owner;                 /* owners share the store: who has most gives way first */
    uint8_t *content;               /* owned, malloc'ed */
    size_t content_bytes;
    struct blob **blobs; /* owned: an array of references, each blob once or more */
    size_t blob_count;
};
void store_record_finish(struct store_record *record); /* releases what it holds, not the struct */

/* A folder of a daemon's, with a store of each owner in it. */
struct store_folder;
/* Takes the folder for this process, and makes it where its parent is there. NULL and *error: as for store_open().
 */
struct store_folder *store_claim(const char *path, struct error *error);
void store_release(struct store_folder *folder); /* accepts NULL */
/* Those who have a record in it, at most `max`. */
size_t store_owners(const struct store_folder *folder, uint64_t *owners, size_t max);
/* The path of the owner's store in such a folder. False and *error: it is too long. */
bool store_owner_path(char path[PATH_MAX], const char *folder, uint64_t owner, struct error *error);
/* That store. A process that is about to end may have it: its end is waited for. */
struct store *store_open_owner(const char *folder, uint64_t owner, uint64_t limit_bytes, struct error *error);

/* Opens the folder, and makes it where its parent is there. Records that cannot be used are removed, and the log
 * says so. NULL and *error: it is not the user's own, another process uses it, or it cannot be read. */
struct store *store_open(const char *folder, uint64_t limit_bytes, struct error *error);
void store_close(struct store *store); /* accepts NULL */

/* Writes the record and those of its blobs that are not there. False and *error: it is greater than the limit, the
 * disk fails, or *abandoned was set on the way (ERROR_CANCELLED); what was there under the name is there still
 * but for the first reason. */
bool store_put(struct store *store, const struct store_record *record, const atomic_bool *abandoned,
               struct error *error);
/* Removes a record, with the blobs that no other one names. */
void store_remove(struct store *store, const uint8_t name[STORE_NAME_BYTES]);

/* The names of all records, from the first written to the last: an array to free(). NULL: out of memory. */
uint8_t (*store_names(struct store *store, size_t *count))[STORE_NAME_BYTES];
/* Reads a record without its blobs, and marks it: if the process ends before store_tried(), the next one will not
 * have it. False and *error: it is not there, or not what was written. */
bool store_try(struct store *store, const uint8_t name[STORE_NAME_BYTES], struct store_record *record,
               struct error *error);
void store_tried(struct store *store, const uint8_t name[STORE_NAME_BYTES]);
/* A blob, verified; the reference is the caller's. NULL and *error: it is not there, or not what was written. */
struct blob *store_read_blob(struct store *store, const uint8_t hash[BLOB_HASH_BYTES], uint64_t size_bytes,
                             struct error *error);

#endif
