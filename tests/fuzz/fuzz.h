/* SPDX-License-Identifier: MIT */
/* Assertions of fuzzers, and access to their input. */
#ifndef FARLIGHT_TESTS_FUZZ_H
#define FARLIGHT_TESTS_FUZZ_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Says which rule was broken and stops the fuzzer there, so that it keeps the input. */
#define FUZZ_REQUIRE(condition)                                                                                   \
    do {                                                                                                          \
        if (!(condition)) {                                                                                       \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition);                               \
            __builtin_trap();                                                                                     \
        }                                                                                                         \
    } while (0)

#endif
