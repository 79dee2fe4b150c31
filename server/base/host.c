/* SPDX-License-Identifier: MIT */
#include "base/host.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

#define BYTES_IF_UNKNOWN (UINT64_C(8) << 30)
#define NICENESS 5

bool host_user_runtime_folder(char *folder, size_t folder_bytes)
{
    const char *runtime = getenv("XDG_RUNTIME_DIR");
    return runtime && runtime[0] == '/' &&
           (size_t)snprintf(folder, folder_bytes, "%s/farlight", runtime) < folder_bytes;
}

uint64_t host_memory_bytes(void)
{
    long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
    return pages > 0 && page_bytes > 0 ? (uint64_t)pages * (uint64_t)page_bytes : BYTES_IF_UNKNOWN;
}

void host_thread_gives_way(void)
{
    setpriority(PRIO_PROCESS, 0, NICENESS);
}
