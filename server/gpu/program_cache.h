/* SPDX-License-Identifier: MIT */
/* Table of a device's programs, which live as long as it. */
#ifndef FARLIGHT_GPU_PROGRAM_CACHE_H
#define FARLIGHT_GPU_PROGRAM_CACHE_H

struct gpu_program_cache;

struct gpu_program_cache *gpu_program_cache_create(void); /* NULL: out of memory */
/* Destroys the table; the GL programs are the registry's. Accepts NULL. */
void gpu_program_cache_destroy(struct gpu_program_cache *cache);

#endif
