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

/* Writes under a temporary name in the path's folder and renames; on failure nothing is left and `reason` says
 * why. An existing file is replaced. One at a time. */
bool file_write(const char *path, const uint8_t *bytes, size_t count, char *reason, size_t reason_bytes);
/* The same in steps. Returns an empty file under a temporary name, open for reading and writing; -1, with
 * `reason`.
 */
int file_begin(const char *path, char *reason, size_t reason_bytes);
/* The temporary name, without its folder, of the last file that was begun. */
const char *file_temporary_name(void);
/* Closes and renames it; on failure nothing is left and `reason` says why. */
bool file_finish(int fd, const char *path, char *reason, size_t reason_bytes);
/* Closes it and takes it away. */
void file_abandon(int fd);

/* Whether the errno value says that there is no space, which may be there later. */
bool file_is_lack_of_space(int number);
/* Whether the last file that was begun failed by that. */
bool file_lacked_space(void);

/* The maximum size of a file: 64 GiB, or the process's own limit if that is lower (the sandbox would raise it to
 * ours).
 */
uint64_t file_bytes_limit(void);
/* From now on SIGTERM ends the program without leaving a temporary file behind. */
void file_clean_up_on_end(void);

/* Opens an ordinary file for reading; -1, with `reason`, for anything else: opening a FIFO does not block. */
int file_open(const char *path, char *reason, size_t reason_bytes);
/* Reads all of it. *bytes is malloc'ed. */
bool file_read(int fd, size_t max_bytes, uint8_t **bytes, size_t *count, char *reason, size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
