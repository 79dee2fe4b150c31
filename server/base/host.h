/* SPDX-License-Identifier: MIT */
/* Facts about the machine: its folders, memory and threads. */
#ifndef FARLIGHT_BASE_HOST_H
#define FARLIGHT_BASE_HOST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Folder of the daemons' sockets: the system's, and for a user without access to that, "farlight" in
 * $XDG_RUNTIME_DIR. */
#define HOST_RUNTIME_FOLDER "/run/farlight"
bool host_user_runtime_folder(char *folder, size_t folder_bytes); /* false: there is none */

/* Memory available to this process: the host's (8 GiB if unknown), or the limit of its control group if that is
 * lower. */
uint64_t host_memory_bytes(void);

/* Lowers the priority of the calling thread, and of those that it starts later, so that frames have priority. On
 * Linux each thread has a priority of its own. */
void host_thread_lower_priority(void);

/* Finds the threads of this process with this in their names, at most `max`; 0: there is none, or the system
 * does not list them. */
size_t host_threads_find(const char *name_part, int *threads, size_t max);
/* Whether each of the threads is asleep, without work. */
bool host_threads_sleep(const int *threads, size_t count);

#endif
