/* SPDX-License-Identifier: MIT */
/* Frames for fuzz_frame.c to start from, as its input says. */
#ifndef FARLIGHT_TESTS_FUZZ_SEED_FRAMES_H
#define FARLIGHT_TESTS_FUZZ_SEED_FRAMES_H

#include <stdbool.h>
#include <stddef.h>

/* FOLDER/WHAT/NAME-NUMBER */
bool seed_write_file(const char *folder, const char *what, const char *name, int number, const void *bytes,
                     size_t count);
/* Some whole, some in parts, cut after each, and some that cannot be. */
bool seed_write_frames(const char *folder);

#endif
