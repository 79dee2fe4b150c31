/* SPDX-License-Identifier: MIT */
/* Coarse depths of any bytes: they are refused with a reason, or all depths are written. And any depths: what is
 * encoded decodes, and no depth is further off than is said. Input: a byte of which of the two, one of width and
 * one of height, then the bytes or the depths; missing ones are 0. */
#include "tests/fuzz/fuzz.h"

#include "protocol/pixels/coarse_depth.h"

#include <stdlib.h>
#include <string.h>

#define SIDE_MAX 64u

static uint16_t depths[SIDE_MAX * SIDE_MAX];

static void decode(uint32_t width, uint32_t height, const uint8_t *encoded, size_t bytes)
{
    const size_t count = (size_t)width * height;
    uint16_t off, *made = malloc(count * sizeof(*made)); /* allocated by size, so that a sanitizer sees more */
    FUZZ_REQUIRE(made);
    const struct predicted_result result = coarse_depth_decode(width, height, encoded, bytes, made, &off);
    FUZZ_REQUIRE(result.status == PREDICTED_DONE ? result.bytes == bytes : result.reason != NULL);
    uint64_t sum = 0;
    for (size_t i = 0; result.status == PREDICTED_DONE && i < count; i++)
        sum += made[i];
    FUZZ_REQUIRE(sum <= UINT16_MAX * (uint64_t)count);
    free(made);
}

static void encode(uint32_t width, uint32_t height)
{
    const struct predicted_source source = {
        .form = {width, height, 2}, .pixels = (const uint8_t *)depths, .level = 1};
    const size_t capacity = coarse_depth_bound(width, height);
    uint8_t *encoded = malloc(capacity);
    uint16_t off, made[SIDE_MAX * SIDE_MAX];
    FUZZ_REQUIRE(encoded);
    const struct predicted_result result = coarse_depth_encode(&source, encoded, capacity);
    FUZZ_REQUIRE(result.status == PREDICTED_DONE);
    FUZZ_REQUIRE(coarse_depth_decode(width, height, encoded, result.bytes, made, &off).status == PREDICTED_DONE);
    for (uint32_t i = 0; i < width * height; i++)
        FUZZ_REQUIRE(abs(made[i] - depths[i]) <= off);
    free(encoded);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 3)
        return 0;
    const uint32_t width = data[1] % SIDE_MAX + 1, height = data[2] % SIDE_MAX + 1;
    data += 3;
    size -= 3;
    if (data[-3] & 1) {
        decode(width, height, data, size);
        return 0;
    }
    memset(depths, 0, sizeof(depths));
    memcpy(depths, data, size < sizeof(depths) ? size : sizeof(depths));
    encode(width, height);
    return 0;
}
