/* SPDX-License-Identifier: MIT */
/* Whole files in a folder of our own. Private to store/. */
#ifndef FARLIGHT_STORE_FILES_H
#define FARLIGHT_STORE_FILES_H

#include "base/error.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Of a file that is not complete. */
#define STORE_FILE_NEW_SUFFIX ".new"

/* The folder, made if it is not there; its owner is this process' user, and nobody else may enter. `at` is a
 * folder or AT_FDCWD. < 0 and *error: it is not like that. */
int store_folder_open(int at, const char *path, struct error *error);
/* Takes the folder for this process: a descriptor that holds it until it is closed. < 0 and *error: ERROR_BUSY,
 * another process has it, or it cannot be taken. */
int store_folder_lock(int folder, const char *path, struct error *error);
/* Writes a file that is on the disk before it has its name. */
bool store_file_write(int folder, const char *name, const void *data, size_t size_bytes,
                      const atomic_bool *abandoned, struct error *error);
/* Size of a plain file; false: there is none of that name. */
bool store_file_size(int folder, const char *name, uint64_t *size_bytes);
/* Reads exactly that many bytes, which are all of the file. */
bool store_file_read(int folder, const char *name, void *data, size_t size_bytes, struct error *error);
/* Calls `each` for every entry but "." and ".."; it may remove that entry. */
bool store_folder_each(int folder, void (*each)(void *context, const char *name), void *context,
                       struct error *error);

#endif
