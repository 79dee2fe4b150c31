/* SPDX-License-Identifier: MIT */
/* The margin around a picture. */
#ifndef FARLIGHT_PROTOCOL_COMMON_MARGIN_H
#define FARLIGHT_PROTOCOL_COMMON_MARGIN_H

#include <stdint.h>

/* Pixels of a margin on each side that is `pixels` long: daemon and client must agree on them. */
static inline uint32_t margin_pixels(float share, uint32_t pixels)
{
    return (uint32_t)(share * (float)pixels);
}

#endif
