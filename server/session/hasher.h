/* SPDX-License-Identifier: MIT */
/* Hashes chunks of arriving blobs on a thread of its own while the network thread receives the next ones, as
 * hashing takes longer than receiving. Only the network thread calls these functions. */
#ifndef FARLIGHT_SESSION_HASHER_H
#define FARLIGHT_SESSION_HASHER_H

#include <stddef.h>
#include <stdint.h>

struct hasher;

/* NULL: there is only one processor, or no thread or memory; the functions below accept NULL and hash at once. */
struct hasher *hasher_create(void);
void hasher_destroy(struct hasher *hasher);
/* Queues a chunk, whose hash is set when hasher_await() of the same counter returns. Until then *left counts the
 * chunk, and neither its bytes nor `hash` may move. */
void hasher_add(struct hasher *hasher, uint8_t *hash, const uint8_t *data, size_t size_bytes, uint32_t *left);
/* Helps until every chunk that *left counts is hashed. */
void hasher_await(struct hasher *hasher, const uint32_t *left);

#endif
