/* SPDX-License-Identifier: MIT */
/* How much memory a device has, from what a driver tells, and how much of it is used where nothing is configured.
 * OpenGL itself has no such query. */
#ifndef FARLIGHT_GPU_MEMORY_H
#define FARLIGHT_GPU_MEMORY_H

#include <stdbool.h>
#include <stdint.h>

/* What a driver was asked; 0: it does not tell. */
struct gpu_memory_answers {
    bool software;
    uint64_t host_bytes;
    uint64_t total_bytes; /* GL_NVX_gpu_memory_info */
    uint64_t free_bytes;  /* GL_ATI_meminfo: what is free now */
};

enum gpu_memory_source { GPU_MEMORY_UNTOLD, GPU_MEMORY_HOST, GPU_MEMORY_TOTAL, GPU_MEMORY_FREE };

struct gpu_memory {
    enum gpu_memory_source source;
    uint64_t bytes; /* 0: untold */
};

/* Of the context that is current. */
struct gpu_memory_answers gpu_memory_ask(bool software);
struct gpu_memory gpu_memory_from(const struct gpu_memory_answers *answers);
/* What is used of it where nothing is configured. */
uint64_t gpu_memory_default_limit(const struct gpu_memory *memory, uint64_t host_bytes);
const char *gpu_memory_source_text(enum gpu_memory_source source); /* "of the host", .. */

#endif
