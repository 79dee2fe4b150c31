/* SPDX-License-Identifier: MIT */
/* Files in a private folder, read and written as a whole. Private to store/. */
#ifndef FARLIGHT_STORE_FILES_H
#define FARLIGHT_STORE_FILES_H

#include "base/error.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Suffix of an incomplete file. */
#define STORE_FILE_NEW_SUFFIX ".new"

/* Opens the folder, and makes it if it is missing; its owner must be this process's user, and nobody else may
 * enter. `at` is a folder or AT_FDCWD. < 0 and *error: it is not so. */
int store_folder_open(int at, const char *path, struct error *error);
/* Locks the folder for this process: a descriptor that holds the lock until it is closed. < 0 and *error:
 * ERROR_BUSY, another process has it, or it cannot be locked. */
int store_folder_lock(int folder, const char *path, struct error *error);
/* Writes a file; it is on the disk before it gets its name. */
bool store_file_write(int folder, const char *name, const void *data, size_t size_bytes,
                      const atomic_bool *abandoned, struct error *error);
/* Size of a plain file. False: none has that name. */
bool store_file_size(int folder, const char *name, uint64_t *size_bytes);
/* Reads exactly that many bytes, which must be the whole file. */
bool store_file_read(int folder, const char *name, void *data, size_t size_bytes, struct error *error);
/* Calls `each` for every entry except "." and ".."; it may remove that entry. */
bool store_folder_each(int folder, void (*each)(void *context, const char *name), void *context,
                       struct error *error);

#endif
