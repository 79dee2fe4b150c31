/* SPDX-License-Identifier: MIT */
/* A file that appears complete or not at all. */
#ifndef FARLIGHT_CLIENT_OUTPUT_FILE_H
#define FARLIGHT_CLIENT_OUTPUT_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Writes under a temporary name in the path's folder and renames; on failure nothing is left and `reason` says
 * why. An existing file is replaced. */
bool file_write(const char *path, const uint8_t *bytes, size_t count, char *reason, size_t reason_bytes);

#endif
