/* SPDX-License-Identifier: MIT */
/* Files of the cache: reading, writing, and removal of the least recently used. */
#include "gpu/binary_cache.h"

#include "base/file_io.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include <xxhash.h>

#define BINARY_BYTES_MAX (64u << 20)
#define NAME_BYTES 64
#define ENDING ".program"
#define ENDING_FRESH ".fresh" /* incomplete */
/* Number of writes between trims. A frame has about twenty programs, so the limit is exceeded by the programs
 * of two frames at most. */
#define WRITES_BETWEEN_TRIMS 32
/* Maximum of entries that a trim reads, which bounds its time; the next trim continues. */
#define ENTRIES_MAX 8192u
/* Age in seconds above which an unfinished file is that of a killed process: writing one takes far less. */
#define FRESH_SECONDS_MAX 600

/* Header of a file; the driver's bytes follow. */
struct header {
    char magic[8];
    uint32_t format, size_bytes;
    struct gpu_binary_key key;
    uint64_t checksum;
};
static const char magic[8] = "FLPROG2";

struct gpu_binary_cache {
    int folder;
    uint64_t limit_bytes;
    atomic_uint writes;
};

bool gpu_cache_folder(char *path, size_t size)
{
    const char *cache = getenv("XDG_CACHE_HOME");
    const char *home = getenv("HOME");
    int n = -1;
    if (cache && cache[0] == '/')
        n = snprintf(path, size, "%s", cache);
    else if (home && home[0] == '/')
        n = snprintf(path, size, "%s/.cache", home);
    if (n < 0 || (size_t)n + sizeof("/farlight") > size)
        return false;
    (void)mkdir(path, 0700);
    memcpy(path + n, "/farlight", sizeof("/farlight"));
    return mkdir(path, 0700) == 0 || errno == EEXIST;
}

/* Whether only this user can write to the folder. Binaries are code: a folder that others may write to is
 * refused; one that they may read is closed to them. */
static bool is_ours_alone(int folder)
{
    struct stat found;
    if (fstat(folder, &found) != 0 || found.st_uid != geteuid() || (found.st_mode & (S_IWGRP | S_IWOTH)))
        return false;
    return (found.st_mode & 0777) == 0700 || fchmod(folder, 0700) == 0;
}

struct gpu_binary_cache *gpu_binary_cache_open(uint64_t limit_bytes)
{
    char path[4096];
    if (!gpu_cache_folder(path, sizeof(path)))
        return NULL;
    int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    struct gpu_binary_cache *cache = folder >= 0 && is_ours_alone(folder) ? malloc(sizeof(*cache)) : NULL;
    if (cache)
        *cache = (struct gpu_binary_cache){.folder = folder, .limit_bytes = limit_bytes};
    else if (folder >= 0)
        close(folder);
    return cache;
}

void gpu_binary_cache_close(struct gpu_binary_cache *cache)
{
    if (cache)
        close(cache->folder);
    free(cache);
}

static void file_name(char name[NAME_BYTES], const struct gpu_binary_key *key)
{
    snprintf(name, NAME_BYTES, "%016llx%016llx" ENDING, (unsigned long long)key->high,
             (unsigned long long)key->low);
}

static bool is_good(const struct stat *file)
{
    return S_ISREG(file->st_mode) && file->st_uid == geteuid() && !(file->st_mode & (S_IWGRP | S_IWOTH)) &&
           (uint64_t)file->st_size > sizeof(struct header) &&
           (uint64_t)file->st_size <= sizeof(struct header) + BINARY_BYTES_MAX;
}

bool gpu_binary_is_there(const struct gpu_binary_cache *cache, const struct gpu_binary_key *key)
{
    char name[NAME_BYTES];
    struct stat found;
    if (!cache)
        return false;
    file_name(name, key);
    return fstatat(cache->folder, name, &found, AT_SYMLINK_NOFOLLOW) == 0 && is_good(&found);
}

static bool read_file(int file, const struct gpu_binary_key *key, struct gpu_binary *binary)
{
    struct header header;
    struct stat found;
    if (fstat(file, &found) != 0 || !is_good(&found) || !file_read_all(file, &header, sizeof(header)) ||
        memcmp(header.magic, magic, sizeof(magic)) != 0 || header.key.low != key->low ||
        header.key.high != key->high || header.size_bytes != (uint64_t)found.st_size - sizeof(header))
        return false;
    *binary = (struct gpu_binary){header.format, header.size_bytes, malloc(header.size_bytes)};
    if (binary->data && file_read_all(file, binary->data, header.size_bytes) &&
        XXH3_64bits(binary->data, header.size_bytes) == header.checksum)
        return true;
    gpu_binary_finish(binary);
    return false;
}

bool gpu_binary_read(const struct gpu_binary_cache *cache, const struct gpu_binary_key *key,
                     struct gpu_binary *binary)
{
    char name[NAME_BYTES];
    *binary = (struct gpu_binary){0};
    if (!cache)
        return false;
    file_name(name, key);
    /* O_NONBLOCK: opening a pipe of that name must not wait. */
    const int file = openat(cache->folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (file < 0)
        return false;
    const bool good = read_file(file, key, binary);
    if (good)
        (void)futimens(file, NULL); /* marks it as used */
    close(file);
    return good;
}

/* ---- the limit ---- */

struct entry {
    struct timespec used;
    uint64_t bytes;
    char name[NAME_BYTES];
};

static int compare_use(const void *a, const void *b)
{
    const struct timespec *x = &((const struct entry *)a)->used, *y = &((const struct entry *)b)->used;
    if (x->tv_sec != y->tv_sec)
        return x->tv_sec < y->tv_sec ? -1 : 1;
    return (x->tv_nsec > y->tv_nsec) - (x->tv_nsec < y->tv_nsec);
}

static bool ends_with(const char *name, const char *ending)
{
    const size_t length = strlen(name), ending_length = strlen(ending);
    return length < NAME_BYTES && length > ending_length && strcmp(name + length - ending_length, ending) == 0;
}

/* Lists the programs; removes files that were never finished. */
static size_t list_entries(int folder, DIR *listing, struct entry *entries)
{
    const time_t now = time(NULL);
    size_t count = 0;
    for (size_t seen = 0; seen < ENTRIES_MAX; seen++) {
        const struct dirent *at = readdir(listing);
        struct stat found;
        if (!at)
            break;
        const bool fresh = ends_with(at->d_name, ENDING_FRESH);
        if ((!fresh && !ends_with(at->d_name, ENDING)) ||
            fstatat(folder, at->d_name, &found, AT_SYMLINK_NOFOLLOW) != 0 || S_ISDIR(found.st_mode))
            continue;
        if (fresh && now - found.st_mtim.tv_sec > FRESH_SECONDS_MAX)
            (void)unlinkat(folder, at->d_name, 0);
        if (fresh)
            continue;
        entries[count] = (struct entry){found.st_mtim, (uint64_t)found.st_size, ""};
        memcpy(entries[count++].name, at->d_name, strlen(at->d_name) + 1);
    }
    return count;
}

static void trim(const struct gpu_binary_cache *cache)
{
    const int folder = openat(cache->folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *listing = folder >= 0 ? fdopendir(folder) : NULL;
    struct entry *entries = malloc(ENTRIES_MAX * sizeof(*entries));
    if (listing && entries) {
        const size_t count = list_entries(cache->folder, listing, entries);
        uint64_t bytes = 0;
        for (size_t i = 0; i < count; i++)
            bytes += entries[i].bytes;
        qsort(entries, count, sizeof(*entries), compare_use);
        for (size_t i = 0; i < count && bytes > cache->limit_bytes; i++) {
            (void)unlinkat(cache->folder, entries[i].name, 0);
            bytes -= entries[i].bytes;
        }
    }
    free(entries);
    if (listing)
        closedir(listing); /* closes its descriptor, too */
    else if (folder >= 0)
        close(folder);
}

/* ---- writing ---- */

void gpu_binary_write(struct gpu_binary_cache *cache, const struct gpu_binary_key *key,
                      const struct gpu_binary *binary)
{
    char name[NAME_BYTES], fresh[NAME_BYTES];
    if (!cache || binary->size_bytes == 0 || binary->size_bytes > BINARY_BYTES_MAX)
        return;
    const unsigned number = atomic_fetch_add(&cache->writes, 1);
    struct header header = {.format = binary->format, .size_bytes = binary->size_bytes, .key = *key};
    memcpy(header.magic, magic, sizeof(magic));
    header.checksum = XXH3_64bits(binary->data, binary->size_bytes);
    file_name(name, key);
    /* The file gets its name when it is complete: another process may read at any moment. */
    snprintf(fresh, sizeof(fresh), "%ld-%llx-%u" ENDING_FRESH, (long)getpid(),
             (unsigned long long)(uintptr_t)cache, number);
    const int file = openat(cache->folder, fresh, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (file < 0)
        return;
    bool written =
        file_write_all(file, &header, sizeof(header)) && file_write_all(file, binary->data, binary->size_bytes);
    written = close(file) == 0 && written && renameat(cache->folder, fresh, cache->folder, name) == 0;
    if (!written)
        (void)unlinkat(cache->folder, fresh, 0);
    if (cache->limit_bytes && number % WRITES_BETWEEN_TRIMS == 0)
        trim(cache);
}

void gpu_binary_finish(struct gpu_binary *binary)
{
    free(binary->data);
    *binary = (struct gpu_binary){0};
}
