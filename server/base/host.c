/* SPDX-License-Identifier: MIT */
/* Folders, memory and threads of the machine. */
#include "base/host.h"

#include "base/cgroup.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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
    uint64_t bytes = pages > 0 && page_bytes > 0 ? (uint64_t)pages * (uint64_t)page_bytes : BYTES_IF_UNKNOWN;
    uint64_t group_bytes = cgroup_memory_limit_bytes("/proc/self/cgroup", "/sys/fs/cgroup");
    return group_bytes < bytes ? group_bytes : bytes;
}

void host_thread_lower_priority(void)
{
    setpriority(PRIO_PROCESS, 0, NICENESS);
}

/* Reads the system's line about a thread. False: there is none. */
static bool read_thread(int thread, const char *what, char *line, size_t size)
{
    char path[64];
    snprintf(path, sizeof(path), "/proc/self/task/%d/%s", thread, what);
    FILE *file = fopen(path, "re");
    const bool is_read = file && fgets(line, (int)size, file);
    if (file)
        fclose(file);
    return is_read;
}

size_t host_threads_find(const char *name_part, int *threads, size_t max)
{
    char name[64];
    size_t count = 0;
    DIR *folder = opendir("/proc/self/task");
    for (struct dirent *entry; folder && count < max && (entry = readdir(folder));) {
        const int thread = atoi(entry->d_name); /* 0: the folder itself, and its parent */
        if (thread && read_thread(thread, "comm", name, sizeof(name)) && strstr(name, name_part))
            threads[count++] = thread;
    }
    if (folder)
        closedir(folder);
    return count;
}

bool host_threads_sleep(const int *threads, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        char line[256];
        /* The line is "number (name) S ..", where the name may hold anything. An ended thread has no work. */
        const char *name_end = read_thread(threads[i], "stat", line, sizeof(line)) ? strrchr(line, ')') : NULL;
        if (name_end && strncmp(name_end, ") S", 3) != 0)
            return false;
    }
    return true;
}
