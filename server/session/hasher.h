/* SPDX-License-Identifier: MIT */
/* Hashes chunks of blobs that arrive on a thread of its own, while the network thread receives the next ones: to
 * hash takes longer than to receive. All calls are the network thread's. */
#ifndef FARLIGHT_SESSION_HASHER_H
#define FARLIGHT_SESSION_HASHER_H

#include <stddef.h>
#include <stdint.h>

struct hasher;

/* NULL: there is one processor, or no thread or memory to be had; the calls below accept it and hash at once. */
struct hasher *hasher_create(void);
void hasher_destroy(struct hasher *hasher);
/* Sets `hash` to that of the chunk by the time that hasher_await() of the same counter has returned. Until then
 * *left counts it, and neither the bytes nor the place of the hash may move. */
void hasher_add(struct hasher *hasher, uint8_t *hash, const uint8_t *data, size_t size_bytes, uint32_t *left);
/* Helps until what *left counts is hashed. */
void hasher_await(struct hasher *hasher, const uint32_t *left);

#endif
