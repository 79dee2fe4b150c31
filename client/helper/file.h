/* SPDX-License-Identifier: MIT */
/* Atomic files: a written file appears complete or not at all. */
#ifndef FARLIGHT_CLIENT_HELPER_FILE_H
#define FARLIGHT_CLIENT_HELPER_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Writes under a temporary name in the path's folder and renames; an existing file is replaced. On failure
 * nothing is left and `reason` is set. One file at a time. */
bool file_write(const char *path, const uint8_t *bytes, size_t count, char *reason, size_t reason_bytes);
/* Starts an atomic write: returns an empty file under a temporary name, open for reading and writing; -1, with
 * `reason`. */
int file_begin(const char *path, char *reason, size_t reason_bytes);
/* The temporary name, without its folder, of the last file that was begun. */
const char *file_temporary_name(void);
/* Closes and renames the file; on failure nothing is left and `reason` is set. */
bool file_finish(int fd, const char *path, char *reason, size_t reason_bytes);
/* Closes and removes the file. */
void file_abandon(int fd);

/* True if the errno value means a lack of space, which may be temporary. */
bool file_is_lack_of_space(int number);
/* True if the last file that was begun failed for lack of space. */
bool file_lacked_space(void);

/* Maximum size of a file: 64 GiB, or the process's own limit if that is lower, which the sandbox would raise. */
uint64_t file_bytes_limit(void);
/* Makes SIGTERM end the program without leaving a temporary file. */
void file_clean_up_on_end(void);

/* Opens an ordinary file for reading; -1, with `reason`, for anything else: opening a FIFO does not block. */
int file_open(const char *path, char *reason, size_t reason_bytes);
/* Reads the whole file. *bytes is malloc'ed. */
bool file_read(int fd, size_t max_bytes, uint8_t **bytes, size_t *count, char *reason, size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
