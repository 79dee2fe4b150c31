/* SPDX-License-Identifier: MIT */
/* Compiled programs: in memory for the life of a device, on the disk between runs. */
#ifndef FARLIGHT_GPU_PROGRAM_CACHE_H
#define FARLIGHT_GPU_PROGRAM_CACHE_H

#include "gpu/device.h"
#include "gpu/program.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct gpu_program_cache;

struct gpu_program_cache *gpu_program_cache_create(void); /* NULL: out of memory */
/* The table; the GL programs are the registry's. Accepts NULL. */
void gpu_program_cache_destroy(struct gpu_program_cache *cache);

/* Where files are kept between runs; made if it is not there. False: nowhere. */
bool gpu_cache_folder(char *path, size_t size);

/* A program's binary on the disk, under a hash of its sources and of the driver's vendor, renderer and version.
 * Both do nothing without a cache: no binaries, a home that cannot be written, a full disk. */
struct gpu_binary_key {
    uint64_t low, high;
};
bool gpu_binary_load(const struct gpu_binary_key *key, unsigned program); /* true: linked from the disk */
void gpu_binary_store(const struct gpu_binary_key *key, unsigned program);

#endif
