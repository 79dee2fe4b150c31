/* SPDX-License-Identifier: MIT */
/* Exact frame rates from decimal numbers. */
#ifndef FARLIGHT_CLIENT_LIB_RATE_H
#define FARLIGHT_CLIENT_LIB_RATE_H

#include <stdint.h>

/* The exact frame rate of a number: a whole number; N * 1000 / 1001 for 23.976, 29.97 and so on (NTSC, SMPTE ST
 * 12); else the fraction with the smallest denominator that equals the number as a float. The rate is positive,
 * finite and at most 100,000; less than one frame in 1,000 seconds is rounded up to that. In lowest terms. */
void fl_rate_exact(float frames_per_second, uint32_t *numerator, uint32_t *denominator);

/* Delay between pictures of a GIF file, in hundredths of a second: the nearest whole number, at least 2, since
 * browsers replace less by 10. */
uint32_t fl_rate_gif_delay(float frames_per_second);

#endif
