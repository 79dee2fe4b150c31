/* SPDX-License-Identifier: MIT */
/* Conversion of radiance to half floats. */
#ifndef FARLIGHT_IMPORT_IMAGE_HALF_H
#define FARLIGHT_IMPORT_IMAGE_HALF_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Rounds to IEEE 754 binary16, ties to even; negative numbers and NaN become 0, large ones the largest half
 * float. */
static inline uint16_t half_of_radiance(float value)
{
    const float largest = 65504.0f;
    uint32_t bits;

    if (!(value > 0))
        return 0;
    if (value > largest)
        value = largest;
    memcpy(&bits, &value, sizeof(bits));
    if (bits < 0x38800000u) /* below 2^-14: a denormal half, a multiple of 2^-24 */
        return (uint16_t)nearbyintf(value * 16777216.0f);
    bits += 0xfffu + ((bits >> 13) & 1u);
    bits = (bits - 0x38000000u) >> 13;
    return (uint16_t)(bits < 0x7bffu ? bits : 0x7bffu);
}

#endif
