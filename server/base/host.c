/* SPDX-License-Identifier: MIT */
#include "base/host.h"

#include <unistd.h>

#define BYTES_IF_UNKNOWN (UINT64_C(8) << 30)

uint64_t host_memory_bytes(void)
{
    long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
    return pages > 0 && page_bytes > 0 ? (uint64_t)pages * (uint64_t)page_bytes : BYTES_IF_UNKNOWN;
}
