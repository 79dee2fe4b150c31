/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_CLIENT_LIB_RATE_H
#define FARLIGHT_CLIENT_LIB_RATE_H

#include <stdint.h>

/* The exact frame rate of a number: a whole number; N * 1000 / 1001 for 23.976, 29.97 and so on (NTSC, SMPTE ST
 * 12); else the fraction with the smallest denominator that equals the number as a float. A positive finite rate
 * up to 100,000 is expected; less than one frame in 1,000 seconds counts as that. In lowest terms. */
void fl_rate_exact(float frames_per_second, uint32_t *numerator, uint32_t *denominator);

/* Hundredths of a second from one picture of a GIF file to the next: the nearest whole number, from 2 on, since
 * browsers take less for 10. */
uint32_t fl_rate_gif_delay(float frames_per_second);

#endif
