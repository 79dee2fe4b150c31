/* SPDX-License-Identifier: MIT */
/* Records and blobs in memory and on the disk, with eviction. */
#include "store/store.h"

#include "base/hashmap.h"
#include "base/log.h"
#include "protocol/reader.h"
#include "protocol/writer.h"
#include "store/files.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <pthread.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

/* File of a record: the magic, the hash of the rest, the head, a row for each blob, the content. */
#define MAGIC "farlight scene 1"
#define MAGIC_BYTES (sizeof(MAGIC) - 1)
#define SEAL_BYTES (MAGIC_BYTES + BLOB_HASH_BYTES)
#define HEAD_BYTES (4 * sizeof(uint64_t)) /* owner, number, count of blobs, bytes of content */
#define ROW_BYTES (BLOB_HASH_BYTES + sizeof(uint64_t))
#define TRYING_SUFFIX ".trying"

#define RECORD_TEXT_BYTES (2 * STORE_NAME_BYTES + 1)
#define BLOB_TEXT_BYTES (2 * BLOB_HASH_BYTES + 1)

/* A blob on the disk, or one about to be written. */
struct held {
    struct hashmap_link same_key;
    uint8_t hash[BLOB_HASH_BYTES];
    uint64_t size_bytes;
    size_t uses; /* number of records that use it */
    bool is_there;
    uint64_t counted_by; /* last entry that counted it: each does so once */
};

struct entry {
    uint8_t name[STORE_NAME_BYTES];
    uint64_t owner, number; /* ascending in the order of writing */
    uint64_t count_id;      /* unique in this process */
    uint64_t file_bytes, content_bytes;
    uint64_t blob_bytes; /* includes blobs that other entries also use */
    struct held **blobs; /* owned array, each once */
    size_t blob_count;
};

struct store {
    pthread_mutex_t lock;
    int folder, scenes, blobs, lock_file;
    uint64_t limit_bytes, bytes, last_number, last_count_id;
    struct entry **entries; /* owned, in the order of their numbers */
    size_t entry_count, entry_capacity;
    struct hashmap held; /* struct held *, owned, by the first bytes of the hash */
};

void store_record_finish(struct store_record *record)
{
    for (size_t i = 0; i < record->blob_count; i++)
        blob_unref(record->blobs[i]);
    free(record->blobs);
    free(record->content);
    record->blobs = NULL;
    record->content = NULL;
    record->blob_count = record->content_bytes = 0;
}

/* ---- names ------------------------------------------------------------------------------------------- */

static void print_name(const uint8_t name[STORE_NAME_BYTES], char text[RECORD_TEXT_BYTES])
{
    sodium_bin2hex(text, RECORD_TEXT_BYTES, name, STORE_NAME_BYTES);
}

static void print_hash(const uint8_t hash[BLOB_HASH_BYTES], char text[BLOB_TEXT_BYTES])
{
    sodium_bin2hex(text, BLOB_TEXT_BYTES, hash, BLOB_HASH_BYTES);
}

/* Parses exactly `count` bytes in their printed form. */
static bool parse_hex(const char *text, uint8_t *bytes, size_t count)
{
    char printed[BLOB_TEXT_BYTES];
    size_t parsed;
    return sodium_hex2bin(bytes, count, text, strlen(text), NULL, &parsed, NULL) == 0 && parsed == count &&
           strcmp(sodium_bin2hex(printed, sizeof(printed), bytes, count), text) == 0;
}

/* ---- blobs ------------------------------------------------------------------------------------------- */

static uint64_t key_of(const uint8_t hash[BLOB_HASH_BYTES])
{
    uint64_t key;
    memcpy(&key, hash, sizeof(key));
    return key;
}

static struct held *find_held(const struct store *store, const uint8_t hash[BLOB_HASH_BYTES])
{
    struct held *held = hashmap_get(&store->held, key_of(hash));
    while (held && memcmp(held->hash, hash, BLOB_HASH_BYTES) != 0)
        held = (struct held *)held->same_key.next;
    return held;
}

/* Finds or adds a blob. NULL: no memory. */
static struct held *need_held(struct store *store, const uint8_t hash[BLOB_HASH_BYTES], uint64_t size_bytes)
{
    struct held *held = find_held(store, hash);
    if (held)
        return held;
    held = calloc(1, sizeof(*held));
    if (!held)
        return NULL;
    memcpy(held->hash, hash, BLOB_HASH_BYTES);
    held->size_bytes = size_bytes;
    if (hashmap_chain(&store->held, key_of(hash), &held->same_key))
        return held;
    free(held);
    return NULL;
}

static void release_held(struct store *store, struct held *held)
{
    if (--held->uses)
        return;
    if (held->is_there) {
        char text[BLOB_TEXT_BYTES];
        print_hash(held->hash, text);
        unlinkat(store->blobs, text, 0);
        store->bytes -= held->size_bytes;
    }
    hashmap_unchain(&store->held, key_of(held->hash), &held->same_key);
    free(held);
}

/* ---- entries ----------------------------------------------------------------------------------------- */

/* Frees an entry that is not in the list; blobs that no other entry uses are removed. Accepts NULL. */
static void entry_free(struct store *store, struct entry *entry)
{
    for (size_t i = 0; entry && i < entry->blob_count; i++)
        release_held(store, entry->blobs[i]);
    if (entry)
        free(entry->blobs);
    free(entry);
}

/* Adds a blob to an entry. False: no memory, or the same hash has another size. */
static bool add_blob(struct store *store, struct entry *entry, const uint8_t hash[BLOB_HASH_BYTES],
                     uint64_t size_bytes)
{
    struct held *held = need_held(store, hash, size_bytes);
    if (!held || held->counted_by == entry->count_id)
        return held && held->size_bytes == size_bytes;
    held->counted_by = entry->count_id;
    held->uses++;
    entry->blobs[entry->blob_count++] = held;
    entry->blob_bytes += held->size_bytes;
    return held->size_bytes == size_bytes;
}

static struct entry *entry_create(struct store *store, const uint8_t name[STORE_NAME_BYTES], uint64_t owner,
                                  size_t blob_capacity)
{
    struct entry *entry = calloc(1, sizeof(*entry));
    if (!entry)
        return NULL;
    entry->blobs = calloc(blob_capacity + 1, sizeof(struct held *));
    if (!entry->blobs) {
        free(entry);
        return NULL;
    }
    memcpy(entry->name, name, STORE_NAME_BYTES);
    entry->owner = owner;
    entry->count_id = ++store->last_count_id;
    return entry;
}

static size_t find_entry(const struct store *store, const uint8_t name[STORE_NAME_BYTES])
{
    size_t place = 0;
    while (place < store->entry_count && memcmp(store->entries[place]->name, name, STORE_NAME_BYTES) != 0)
        place++;
    return place;
}

/* Inserts an entry into the list. False: no memory. */
static bool insert_entry(struct store *store, struct entry *entry)
{
    if (store->entry_count == store->entry_capacity) {
        size_t capacity = store->entry_capacity ? 2 * store->entry_capacity : 16;
        struct entry **entries = realloc(store->entries, capacity * sizeof(struct entry *));
        if (!entries)
            return false;
        store->entries = entries;
        store->entry_capacity = capacity;
    }
    size_t place = store->entry_count++;
    for (; place && store->entries[place - 1]->number > entry->number; place--)
        store->entries[place] = store->entries[place - 1];
    store->entries[place] = entry;
    if (entry->number > store->last_number)
        store->last_number = entry->number;
    store->bytes += entry->file_bytes;
    return true;
}

static struct entry *take_entry(struct store *store, size_t place)
{
    struct entry *entry = store->entries[place];
    memmove(&store->entries[place], &store->entries[place + 1],
            (--store->entry_count - place) * sizeof(struct entry *));
    store->bytes -= entry->file_bytes;
    return entry;
}

static void remove_entry(struct store *store, size_t place)
{
    struct entry *entry = take_entry(store, place);
    char text[RECORD_TEXT_BYTES + sizeof(TRYING_SUFFIX)];
    print_name(entry->name, text);
    unlinkat(store->scenes, text, 0);
    strcat(text, TRYING_SUFFIX);
    unlinkat(store->scenes, text, 0);
    entry_free(store, entry);
}

static uint64_t bytes_of_owner(const struct store *store, uint64_t owner)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < store->entry_count; i++) {
        const struct entry *entry = store->entries[i];
        bytes += entry->owner == owner ? entry->file_bytes + entry->blob_bytes : 0;
    }
    return bytes;
}

/* The record to be evicted: the oldest one of the owner with the most bytes. There is one. */
static size_t record_to_evict(const struct store *store)
{
    size_t first = 0;
    uint64_t most_bytes = 0;
    for (size_t i = 0; i < store->entry_count; i++) {
        uint64_t bytes = bytes_of_owner(store, store->entries[i]->owner);
        if (bytes > most_bytes) {
            most_bytes = bytes;
            first = i;
        }
    }
    return first;
}

/* ---- opening ----------------------------------------------------------------------------------------- */

static bool is_what_was_written(const uint8_t *bytes, size_t size_bytes)
{
    uint8_t hash[BLOB_HASH_BYTES];
    if (size_bytes < SEAL_BYTES + HEAD_BYTES || memcmp(bytes, MAGIC, MAGIC_BYTES) != 0)
        return false;
    blob_hash(hash, bytes + SEAL_BYTES, size_bytes - SEAL_BYTES);
    return memcmp(hash, bytes + MAGIC_BYTES, BLOB_HASH_BYTES) == 0;
}

/* Parses a whole file; *entry is not in the list. False: it is damaged. */
static bool parse_record(struct store *store, const uint8_t name[STORE_NAME_BYTES], const uint8_t *bytes,
                         size_t size_bytes, struct entry **entry)
{
    *entry = NULL;
    if (!is_what_was_written(bytes, size_bytes))
        return false;
    struct reader reader;
    reader_init(&reader, bytes + SEAL_BYTES, size_bytes - SEAL_BYTES);
    uint64_t owner = reader_u64(&reader), number = reader_u64(&reader);
    uint64_t blob_count = reader_u64(&reader), content_bytes = reader_u64(&reader);
    if (blob_count > reader_left(&reader) / ROW_BYTES ||
        content_bytes != reader_left(&reader) - blob_count * ROW_BYTES)
        return false;
    *entry = entry_create(store, name, owner, (size_t)blob_count);
    if (!*entry)
        return false;
    (*entry)->number = number;
    (*entry)->file_bytes = size_bytes;
    (*entry)->content_bytes = content_bytes;
    for (uint64_t i = 0; i < blob_count; i++) {
        uint8_t blob[BLOB_HASH_BYTES];
        reader_bytes(&reader, blob, sizeof(blob));
        if (!add_blob(store, *entry, blob, reader_u64(&reader)))
            return false;
    }
    return true;
}

/* Reads a file no larger than the limit; NULL and *error: it cannot be read. */
static uint8_t *read_whole(const struct store *store, const char *name, uint64_t *size_bytes, struct error *error)
{
    uint8_t *bytes = NULL;
    if (!store_file_size(store->scenes, name, size_bytes) || *size_bytes > store->limit_bytes)
        error_set(error, ERROR_INVALID, name, "not a file of a size that was written");
    else if (!(bytes = malloc((size_t)*size_bytes + 1)))
        error_set(error, ERROR_OUT_OF_MEMORY, name, "no memory for %" PRIu64 " bytes", *size_bytes);
    else if (store_file_read(store->scenes, name, bytes, (size_t)*size_bytes, error))
        return bytes;
    free(bytes);
    return NULL;
}

static void find_record(void *context, const char *file)
{
    struct store *store = context;
    uint8_t name[STORE_NAME_BYTES];
    struct entry *entry = NULL;
    uint64_t size_bytes;
    struct error error = {0};
    size_t length = strlen(file);
    bool was_tried =
        length > strlen(TRYING_SUFFIX) && strcmp(file + length - strlen(TRYING_SUFFIX), TRYING_SUFFIX) == 0;
    uint8_t *bytes = parse_hex(file, name, sizeof(name)) ? read_whole(store, file, &size_bytes, &error) : NULL;
    bool found =
        bytes && parse_record(store, name, bytes, (size_t)size_bytes, &entry) && insert_entry(store, entry);
    free(bytes);
    if (found)
        return;
    entry_free(store, entry);
    if (was_tried)
        log_write(LOG_ERROR, "store", "the daemon ended while it restored the scene %s, which is removed", file);
    else
        log_write(LOG_WARNING, "store", "%s is no scene that can be restored, and is removed%s%s", file,
                  error.text[0] ? ": " : "", error.text);
    unlinkat(store->scenes, file, 0);
}

static void find_blob(void *context, const char *file)
{
    struct store *store = context;
    uint8_t hash[BLOB_HASH_BYTES];
    uint64_t size_bytes;
    struct held *held = parse_hex(file, hash, sizeof(hash)) ? find_held(store, hash) : NULL;
    if (held && store_file_size(store->blobs, file, &size_bytes) && size_bytes == held->size_bytes) {
        held->is_there = true;
        store->bytes += size_bytes;
    } else {
        unlinkat(store->blobs, file, 0);
    }
}

static bool is_complete(const struct entry *entry)
{
    for (size_t i = 0; i < entry->blob_count; i++) {
        if (!entry->blobs[i]->is_there)
            return false;
    }
    return true;
}

static void drop_incomplete(struct store *store)
{
    for (size_t i = store->entry_count; i-- > 0;) {
        if (is_complete(store->entries[i]))
            continue;
        log_write(LOG_WARNING, "store", "blobs of a scene are missing, and it is removed");
        remove_entry(store, i);
    }
}

struct store *store_open(const char *folder, uint64_t limit_bytes, struct error *error)
{
    struct store *store = calloc(1, sizeof(*store));
    if (!store) {
        error_set(error, ERROR_OUT_OF_MEMORY, "scenes.store", "no memory");
        return NULL;
    }
    pthread_mutex_init(&store->lock, NULL);
    store->limit_bytes = limit_bytes;
    store->folder = store->scenes = store->blobs = store->lock_file = -1;
    store->folder = store_folder_open(AT_FDCWD, folder, error);
    store->lock_file = store->folder < 0 ? -1 : store_folder_lock(store->folder, folder, error);
    bool ok = store->lock_file >= 0;
    if (ok)
        store->scenes = store_folder_open(store->folder, "scenes", error);
    if (ok && store->scenes >= 0)
        store->blobs = store_folder_open(store->folder, "blobs", error);
    ok = ok && store->blobs >= 0 && store_folder_each(store->scenes, find_record, store, error) &&
         store_folder_each(store->blobs, find_blob, store, error);
    if (!ok) {
        store_close(store);
        return NULL;
    }
    drop_incomplete(store);
    while (store->bytes > store->limit_bytes && store->entry_count)
        remove_entry(store, record_to_evict(store));
    return store;
}

static void close_fd(int fd)
{
    if (fd >= 0)
        close(fd);
}

void store_close(struct store *store)
{
    if (!store)
        return;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&store->held, &cursor, NULL, &value)) {
        for (struct held *held = value, *next; held; held = next) {
            next = (struct held *)held->same_key.next;
            free(held);
        }
    }
    hashmap_finish(&store->held);
    for (size_t i = 0; i < store->entry_count; i++) {
        free(store->entries[i]->blobs);
        free(store->entries[i]);
    }
    free(store->entries);
    close_fd(store->blobs);
    close_fd(store->scenes);
    close_fd(store->folder);
    close_fd(store->lock_file);
    pthread_mutex_destroy(&store->lock);
    free(store);
}

/* ---- writing ----------------------------------------------------------------------------------------- */

static struct entry *entry_of(struct store *store, const struct store_record *record)
{
    struct entry *entry = entry_create(store, record->name, record->owner, record->blob_count);
    for (size_t i = 0; entry && i < record->blob_count; i++) {
        if (add_blob(store, entry, record->blobs[i]->hash, record->blobs[i]->size_bytes))
            continue;
        entry_free(store, entry);
        return NULL;
    }
    if (entry) {
        entry->number = store->last_number + 1;
        entry->content_bytes = record->content_bytes;
        entry->file_bytes = SEAL_BYTES + HEAD_BYTES + entry->blob_count * ROW_BYTES + record->content_bytes;
    }
    return entry;
}

/* Evicts until the entry fits; its predecessor goes first. False: it never does. */
static bool evict_for(struct store *store, const struct entry *entry, struct error *error)
{
    uint64_t all_bytes = entry->file_bytes + entry->blob_bytes, new_bytes = entry->file_bytes;
    for (size_t i = 0; i < entry->blob_count; i++)
        new_bytes += entry->blobs[i]->is_there ? 0 : entry->blobs[i]->size_bytes;
    size_t before = find_entry(store, entry->name);
    if (before < store->entry_count && store->bytes + new_bytes > store->limit_bytes)
        remove_entry(store, before);
    if (all_bytes > store->limit_bytes) {
        error_set(error, ERROR_LIMIT, "", "the scene has %" PRIu64 " bytes, the limit is %" PRIu64, all_bytes,
                  store->limit_bytes);
        return error_remedy(error, "raise scenes.store_bytes in the daemon's configuration");
    }
    while (store->bytes + new_bytes > store->limit_bytes && store->entry_count)
        remove_entry(store, record_to_evict(store));
    return true;
}

static bool write_blobs(struct store *store, const struct store_record *record, const atomic_bool *abandoned,
                        struct error *error)
{
    for (size_t i = 0; i < record->blob_count; i++) {
        const struct blob *blob = record->blobs[i];
        struct held *held = find_held(store, blob->hash);
        char text[BLOB_TEXT_BYTES];
        if (held->is_there)
            continue;
        print_hash(blob->hash, text);
        if (!store_file_write(store->blobs, text, blob->data, blob->size_bytes, abandoned, error))
            return false;
        held->is_there = true;
        store->bytes += held->size_bytes;
    }
    return true;
}

static bool write_record(struct store *store, const struct entry *entry, const struct store_record *record,
                         const atomic_bool *abandoned, struct error *error)
{
    size_t size_bytes = (size_t)entry->file_bytes;
    uint8_t *bytes = malloc(size_bytes);
    if (!bytes)
        return error_set(error, ERROR_OUT_OF_MEMORY, "", "no memory for %zu bytes", size_bytes);
    struct writer writer;
    writer_init(&writer, bytes + SEAL_BYTES, size_bytes - SEAL_BYTES);
    writer_put_u64(&writer, entry->owner);
    writer_put_u64(&writer, entry->number);
    writer_put_u64(&writer, entry->blob_count);
    writer_put_u64(&writer, entry->content_bytes);
    for (size_t i = 0; i < entry->blob_count; i++) {
        writer_put_bytes(&writer, entry->blobs[i]->hash, BLOB_HASH_BYTES);
        writer_put_u64(&writer, entry->blobs[i]->size_bytes);
    }
    writer_put_bytes(&writer, record->content, record->content_bytes);
    memcpy(bytes, MAGIC, MAGIC_BYTES);
    blob_hash(bytes + MAGIC_BYTES, bytes + SEAL_BYTES, size_bytes - SEAL_BYTES);
    char text[RECORD_TEXT_BYTES];
    print_name(entry->name, text);
    bool written = !writer.failed && store_file_write(store->scenes, text, bytes, size_bytes, abandoned, error);
    free(bytes);
    return written;
}

static bool put(struct store *store, const struct store_record *record, const atomic_bool *abandoned,
                struct error *error)
{
    struct entry *entry = entry_of(store, record);
    if (!entry)
        return error_set(error, ERROR_OUT_OF_MEMORY, "", "no memory");
    bool written = evict_for(store, entry, error) && write_blobs(store, record, abandoned, error) &&
                   write_record(store, entry, record, abandoned, error);
    size_t before = find_entry(store, entry->name);
    if (written && before < store->entry_count)
        entry_free(store, take_entry(store, before)); /* its file has been replaced */
    if (written && insert_entry(store, entry))
        return true;
    entry_free(store, entry);
    return written ? error_set(error, ERROR_OUT_OF_MEMORY, "", "no memory") : false;
}

bool store_put(struct store *store, const struct store_record *record, const atomic_bool *abandoned,
               struct error *error)
{
    pthread_mutex_lock(&store->lock);
    bool done = put(store, record, abandoned, error);
    pthread_mutex_unlock(&store->lock);
    return done;
}

void store_remove(struct store *store, const uint8_t name[STORE_NAME_BYTES])
{
    pthread_mutex_lock(&store->lock);
    size_t place = find_entry(store, name);
    if (place < store->entry_count)
        remove_entry(store, place);
    pthread_mutex_unlock(&store->lock);
}

/* ---- reading ----------------------------------------------------------------------------------------- */

uint8_t (*store_names(struct store *store, size_t *count))[STORE_NAME_BYTES]
{
    pthread_mutex_lock(&store->lock);
    uint8_t(*names)[STORE_NAME_BYTES] = calloc(store->entry_count + 1, STORE_NAME_BYTES);
    *count = names ? store->entry_count : 0;
    for (size_t i = 0; i < *count; i++)
        memcpy(names[i], store->entries[i]->name, STORE_NAME_BYTES);
    pthread_mutex_unlock(&store->lock);
    return names;
}

static void rename_record(struct store *store, const uint8_t name[STORE_NAME_BYTES], bool is_tried)
{
    char plain[RECORD_TEXT_BYTES], trying[RECORD_TEXT_BYTES + sizeof(TRYING_SUFFIX)];
    print_name(name, plain);
    snprintf(trying, sizeof(trying), "%s" TRYING_SUFFIX, plain);
    renameat(store->scenes, is_tried ? plain : trying, store->scenes, is_tried ? trying : plain);
}

static bool try_record(struct store *store, const uint8_t name[STORE_NAME_BYTES], struct store_record *record,
                       struct error *error)
{
    size_t place = find_entry(store, name);
    if (place == store->entry_count)
        return error_set(error, ERROR_UNKNOWN_ID, "", "the scene is not there any more");
    const struct entry *entry = store->entries[place];
    char text[RECORD_TEXT_BYTES];
    uint64_t size_bytes;
    print_name(name, text);
    uint8_t *bytes = read_whole(store, text, &size_bytes, error);
    if (!bytes)
        return false;
    if (size_bytes != entry->file_bytes || !is_what_was_written(bytes, (size_t)size_bytes)) {
        free(bytes);
        return error_set(error, ERROR_INVALID, text, "the file has changed");
    }
    memcpy(record->name, name, STORE_NAME_BYTES);
    record->owner = entry->owner;
    record->content_bytes = (size_t)entry->content_bytes;
    memmove(bytes, bytes + (size_bytes - entry->content_bytes), record->content_bytes);
    record->content = bytes;
    rename_record(store, name, true);
    return true;
}

bool store_try(struct store *store, const uint8_t name[STORE_NAME_BYTES], struct store_record *record,
               struct error *error)
{
    *record = (struct store_record){0};
    pthread_mutex_lock(&store->lock);
    bool tried = try_record(store, name, record, error);
    pthread_mutex_unlock(&store->lock);
    return tried;
}

void store_tried(struct store *store, const uint8_t name[STORE_NAME_BYTES])
{
    pthread_mutex_lock(&store->lock);
    if (find_entry(store, name) < store->entry_count)
        rename_record(store, name, false);
    pthread_mutex_unlock(&store->lock);
}

struct blob *store_read_blob(struct store *store, const uint8_t hash[BLOB_HASH_BYTES], uint64_t size_bytes,
                             struct error *error)
{
    char text[BLOB_TEXT_BYTES];
    uint64_t found_bytes;
    print_hash(hash, text);
    if (!store_file_size(store->blobs, text, &found_bytes) || found_bytes != size_bytes) {
        error_set(error, ERROR_INVALID, text, "no file of %" PRIu64 " bytes", size_bytes);
        return NULL;
    }
    struct blob *blob = blob_create((size_t)size_bytes);
    if (!blob) {
        error_set(error, ERROR_OUT_OF_MEMORY, text, "no memory for %" PRIu64 " bytes", size_bytes);
        return NULL;
    }
    if (store_file_read(store->blobs, text, blob->data, blob->size_bytes, error)) {
        blob_hash(blob->hash, blob->data, blob->size_bytes);
        if (memcmp(blob->hash, hash, BLOB_HASH_BYTES) == 0)
            return blob;
        error_set(error, ERROR_HASH_MISMATCH, text, "the file has changed");
    }
    blob_unref(blob);
    return NULL;
}
