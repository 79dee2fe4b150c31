/* SPDX-License-Identifier: MIT */
/* Extensions that report memory, and shares of it. */
#include "gpu/memory.h"

#include "base/host.h"

#include <epoxy/gl.h>

/* Share of a device's own memory: the rest is for other programs, and for the driver's own use. */
#define SHARE_PERCENT 70
/* Share of the host's memory for software GL. Scenes, blobs, edits and frames have 50 % of it (server/config.c); a
 * quarter is left for memory that none of these limits counts, and for other programs. */
#define HOST_SHARE_PERCENT 25
/* Share of the free memory: other programs have theirs already. */
#define FREE_SHARE_PERCENT 85
/* Default where nothing is reported. Devices with OpenGL 4.5 and less memory of their own are rare; an
 * integrated one shares the host's, of which this is at most a quarter. */
#define UNTOLD_BYTES ((uint64_t)2 << 30)
#define UNTOLD_HOST_PARTS 4

struct gpu_memory_answers gpu_memory_ask(bool software)
{
    struct gpu_memory_answers answers = {.software = software, .host_bytes = host_memory_bytes()};
    GLint kibibytes[4] = {0};
    if (epoxy_has_gl_extension("GL_NVX_gpu_memory_info")) {
        glGetIntegerv(GL_GPU_MEMORY_INFO_TOTAL_AVAILABLE_MEMORY_NVX, kibibytes);
        answers.total_bytes = kibibytes[0] > 0 ? (uint64_t)kibibytes[0] * 1024 : 0;
    }
    if (epoxy_has_gl_extension("GL_ATI_meminfo")) {
        glGetIntegerv(GL_VBO_FREE_MEMORY_ATI, kibibytes); /* free, largest block, the same of the host's part */
        answers.free_bytes = kibibytes[0] > 0 ? (uint64_t)kibibytes[0] * 1024 : 0;
    }
    return answers;
}

struct gpu_memory gpu_memory_from(const struct gpu_memory_answers *answers)
{
    /* A driver over software GL reports a constant: lavapipe's is 2 GiB. */
    if (answers->software)
        return (struct gpu_memory){GPU_MEMORY_HOST, answers->host_bytes};
    if (answers->total_bytes)
        return (struct gpu_memory){GPU_MEMORY_TOTAL, answers->total_bytes};
    if (answers->free_bytes)
        return (struct gpu_memory){GPU_MEMORY_FREE, answers->free_bytes};
    return (struct gpu_memory){GPU_MEMORY_UNTOLD, 0};
}

uint64_t gpu_memory_default_limit(const struct gpu_memory *memory, uint64_t host_bytes)
{
    const uint64_t of_host = host_bytes / UNTOLD_HOST_PARTS;
    switch (memory->source) {
    case GPU_MEMORY_HOST:
        return memory->bytes / 100 * HOST_SHARE_PERCENT;
    case GPU_MEMORY_TOTAL:
        return memory->bytes / 100 * SHARE_PERCENT;
    case GPU_MEMORY_FREE:
        return memory->bytes / 100 * FREE_SHARE_PERCENT;
    case GPU_MEMORY_UNTOLD:
        break;
    }
    return of_host < UNTOLD_BYTES ? of_host : UNTOLD_BYTES;
}

const char *gpu_memory_source_text(enum gpu_memory_source source)
{
    static const char *const texts[] = {
        [GPU_MEMORY_UNTOLD] = "the driver does not tell",
        [GPU_MEMORY_HOST] = "the host's",
        [GPU_MEMORY_TOTAL] = "the device's own",
        [GPU_MEMORY_FREE] = "free on the device",
    };
    return texts[source];
}
