/* SPDX-License-Identifier: MIT */
/* The machine that this runs on. */
#ifndef FARLIGHT_BASE_HOST_H
#define FARLIGHT_BASE_HOST_H

#include <stdint.h>

/* Physical memory; 8 GiB where the system does not tell. */
uint64_t host_memory_bytes(void);

#endif
