/* SPDX-License-Identifier: MIT */
/* Reads and writes that continue until all bytes are transferred. Any thread. */
#ifndef FARLIGHT_BASE_FILE_IO_H
#define FARLIGHT_BASE_FILE_IO_H

#include <stdbool.h>
#include <stddef.h>

/* Reads exactly `bytes`. False: the file ends before, or cannot be read. */
bool file_read_all(int file, void *data, size_t bytes);
/* Writes all bytes. False: errno says why. */
bool file_write_all(int file, const void *data, size_t bytes);

#endif
