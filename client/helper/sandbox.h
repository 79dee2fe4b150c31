/* SPDX-License-Identifier: MIT */
/* Drops a helper program's rights before it reads hostile input: files beneath the named
 * folders only (Landlock), few system calls (seccomp: no processes,
 * no signals to others, no new handlers, no memory that is both writable and executable), bounded memory, time and
 * file sizes, no new privileges. Cannot be undone.
 *
 * Landlock binds the calling thread and those that it starts, so the process must have no other: libraries that
 * start threads when they are loaded are loaded afterwards (helper/module.h). */
#ifndef FARLIGHT_CLIENT_HELPER_SANDBOX_H
#define FARLIGHT_CLIENT_HELPER_SANDBOX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Zero is the strictest: only files that are already open can be read or written. */
struct sandbox_options {
    const char *const *read_folders; /* folders whose contents may be read; NULL entries are skipped */
    size_t read_folder_count;
    const char *const *write_folders; /* folders in which files may be created, written and read */
    size_t write_folder_count;
    bool allow_rename;            /* rename and unlink beneath the write folders */
    uint64_t address_space_bytes; /* 0: 8 GiB */
    uint32_t cpu_seconds;         /* 0: unlimited */
    uint64_t file_bytes;          /* maximum size of a written file; 0: files cannot grow at all */
};

/* False, with `reason` set, if the process has more than one thread, or a protection that every supported kernel
 * has (limits, no new privileges, system call filter, Landlock) fails: then nothing may be parsed. If the kernel
 * lacks Landlock and the environment variable FARLIGHT_UNCONFINED is 1, the result is true and `reason` says so;
 * else `reason` is empty. */
bool sandbox_enter(const struct sandbox_options *options, char *reason, size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
