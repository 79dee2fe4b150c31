/* SPDX-License-Identifier: MIT */
/* Errors as values: a function that can fail takes a `struct error *` and returns false (or NULL). */
#ifndef FARLIGHT_BASE_ERROR_H
#define FARLIGHT_BASE_ERROR_H

#include "base/words.h"

#include <stdbool.h>
#include <stdint.h>

struct error {
    enum error_code kind;
    bool retryable;
    uint32_t retry_after_ms; /* 0: unknown */
    char field[128];         /* path of the object or value at fault: "mesh 3.ranges[2].material" */
    char text[512];          /* description of the fault */
    char remedy[256];        /* remedy; may be empty */
};

/* Fills *error (which may be NULL) and returns false, so that a caller can `return error_set(..)`.
 * The first error wins: an *error that is already set stays. `field` may be NULL. */
bool error_set(struct error *error, enum error_code kind, const char *field, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Adds the remedy to an error that has just been set; returns false. */
bool error_remedy(struct error *error, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
