/* SPDX-License-Identifier: MIT */
/* The list of GPUs that people choose from, with the workers that use them. */
#ifndef FARLIGHT_DEVICES_H
#define FARLIGHT_DEVICES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Sets the text that lists of processes show behind --worker: "3: user 1000, device 0". Fills `title` with it and
 * blanks, up to the title's present length. */
void devices_set_title(char *title, uint32_t worker, const char *owner, int32_t device);
/* Reads such a title. False: it is none, as with a worker that has no owner yet. `owner` points into it, with
 * *owner_bytes. */
bool devices_read_title(const char *title, uint32_t *worker, const char **owner, size_t *owner_bytes,
                        int32_t *device);

/* Prints the devices, each with its workers of every daemon whose processes this one may see. Returns the exit
 * status. */
int devices_print(void);

#endif
