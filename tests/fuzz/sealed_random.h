/* SPDX-License-Identifier: MIT */
/* Random numbers of two ends of a sealed connection that are the same each time, so that what one end said while
 * the seeds were made opens the other end while it is fuzzed. */
#ifndef FARLIGHT_TESTS_FUZZ_SEALED_RANDOM_H
#define FARLIGHT_TESTS_FUZZ_SEALED_RANDOM_H

#include <sodium.h>
#include <stdint.h>

#include "protocol/sealed/link.h"

static const struct sealed_key sealed_fuzz_key = {.bytes = "the key of every fuzzed session"};

static uint32_t sealed_random_states[2]; /* states of client and server */
static unsigned sealed_random_end;

static inline void sealed_random_begin(void)
{
    sealed_random_states[0] = 1;
    sealed_random_states[1] = 2;
}

static inline const char *sealed_random_name(void)
{
    return "the same each time";
}

static inline void sealed_random_fill(void *const out, const size_t count)
{
    uint32_t *state = &sealed_random_states[sealed_random_end];
    for (size_t i = 0; i < count; i++) {
        *state = *state * 1664525u + 1013904223u; /* Numerical Recipes */
        ((uint8_t *)out)[i] = (uint8_t)(*state >> 24);
    }
}

static inline uint32_t sealed_random_number(void)
{
    uint32_t number;
    sealed_random_fill(&number, sizeof(number));
    return number;
}

static struct randombytes_implementation sealed_random = {
    .implementation_name = sealed_random_name, .random = sealed_random_number, .buf = sealed_random_fill};

#endif
