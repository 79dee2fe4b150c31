/* SPDX-License-Identifier: MIT */
/* Memory of a device as its driver reports it, and the default limit of its use. OpenGL itself has no such
 * query. */
#ifndef FARLIGHT_GPU_MEMORY_H
#define FARLIGHT_GPU_MEMORY_H

#include <stdbool.h>
#include <stdint.h>

/* Answers of a driver; 0: not reported. */
struct gpu_memory_answers {
    bool software;
    uint64_t host_bytes;
    uint64_t total_bytes; /* GL_NVX_gpu_memory_info */
    uint64_t free_bytes;  /* GL_ATI_meminfo: free at present */
};

enum gpu_memory_source { GPU_MEMORY_UNTOLD, GPU_MEMORY_HOST, GPU_MEMORY_TOTAL, GPU_MEMORY_FREE };

struct gpu_memory {
    enum gpu_memory_source source;
    uint64_t bytes; /* 0: unknown */
};

/* Asks the driver of the current context. */
struct gpu_memory_answers gpu_memory_ask(bool software);
struct gpu_memory gpu_memory_from(const struct gpu_memory_answers *answers);
/* Default limit of the memory in use. */
uint64_t gpu_memory_default_limit(const struct gpu_memory *memory, uint64_t host_bytes);
const char *gpu_memory_source_text(enum gpu_memory_source source); /* "of the host", .. */

#endif
