/* SPDX-License-Identifier: MIT */
/* Cache of program binaries on the disk, below $XDG_CACHE_HOME/farlight or ~/.cache/farlight. Knows no GL.
 *
 * A file's name is its key, a hash of everything that the binary depends on, so files of other versions of
 * farlight or of the driver lie beside it and are never read. A file of another owner, a link, and a file that was
 * cut short or changed are ignored and replaced. Several processes may use one folder, and several threads one
 * cache. */
#ifndef FARLIGHT_GPU_BINARY_CACHE_H
#define FARLIGHT_GPU_BINARY_CACHE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct gpu_binary_key {
    uint64_t low, high;
};

struct gpu_binary {
    uint32_t format, size_bytes;
    void *data; /* owned; NULL: none */
};

struct gpu_binary_cache;

/* Gets the folder of files that are kept between runs; creates it if it is missing. False: there is none. */
bool gpu_cache_folder(char *path, size_t size);

/* Opens the cache. NULL, and no binary is kept: others may write to the folder, or it cannot be created. The
 * other functions accept NULL. */
struct gpu_binary_cache *gpu_binary_cache_open(uint64_t limit_bytes); /* 0: no limit */
void gpu_binary_cache_close(struct gpu_binary_cache *cache);

bool gpu_binary_is_there(const struct gpu_binary_cache *cache, const struct gpu_binary_key *key);
bool gpu_binary_read(const struct gpu_binary_cache *cache, const struct gpu_binary_key *key,
                     struct gpu_binary *binary);
/* Writes a binary; sometimes also removes the files that were read longest ago, until the rest is within the
 * limit. */
void gpu_binary_write(struct gpu_binary_cache *cache, const struct gpu_binary_key *key,
                      const struct gpu_binary *binary);
void gpu_binary_finish(struct gpu_binary *binary);

#endif
