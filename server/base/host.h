/* SPDX-License-Identifier: MIT */
/* The machine that this runs on. */
#ifndef FARLIGHT_BASE_HOST_H
#define FARLIGHT_BASE_HOST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Where daemons have their sockets: the system's, and of a user without rights to that, "farlight" in
 * $XDG_RUNTIME_DIR. */
#define HOST_RUNTIME_FOLDER "/run/farlight"
bool host_user_runtime_folder(char *folder, size_t folder_bytes); /* false: there is none */

/* Memory that this process may have: the host's (8 GiB where the system does not tell), or the limit of its
 * control group if that is lower. */
uint64_t host_memory_bytes(void);

/* Lowers the priority of the calling thread, and of those that it starts later, so that frames go first. On Linux
 * each thread has a priority of its own. */
void host_thread_gives_way(void);

/* The threads of this process that have this in their names, at most `max`; 0: there is none, or the system does
 * not tell. */
size_t host_threads_find(const char *name_part, int *threads, size_t max);
/* Whether each of them waits, and has no work. */
bool host_threads_sleep(const int *threads, size_t count);

#endif
