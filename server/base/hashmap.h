/* SPDX-License-Identifier: MIT */
/* Map from u32 or u64 identifiers to pointers. Not thread-safe. Iteration order is insertion order
 * where nothing was removed, and deterministic always. */
#ifndef FARLIGHT_BASE_HASHMAP_H
#define FARLIGHT_BASE_HASHMAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A map. Pairs are dense in `slots`; `index` finds them, by linear probing. */
struct hashmap {
    struct hashmap_slot *slots; /* `count` pairs, at most half of `capacity` */
    uint32_t *index;            /* `capacity` positions in `slots`, plus 1; 0: free */
    size_t capacity;            /* power of two, or 0 */
    size_t count;
};

void hashmap_init(struct hashmap *map);   /* all-zero is the same */
void hashmap_finish(struct hashmap *map); /* frees the table, not the values */
void *hashmap_get(const struct hashmap *map, uint64_t key);
/* Sets the value of a key, which must not be NULL. False: out of memory, or more than 2^31 pairs. */
bool hashmap_put(struct hashmap *map, uint64_t key, void *value);
void *hashmap_remove(struct hashmap *map, uint64_t key); /* the value, or NULL */
/* Link of a value in a chain, for keys shorter than the values' identities: each value begins with a link, and
 * the map has the first. */
struct hashmap_link {
    struct hashmap_link *next;
};
/* Adds a value to the chain of a key. False: see hashmap_put(). */
bool hashmap_chain(struct hashmap *map, uint64_t key, struct hashmap_link *link);
/* Removes a value; its link must be in the chain. */
void hashmap_unchain(struct hashmap *map, uint64_t key, struct hashmap_link *link);
/* Iterates; *cursor starts at 0; false at the end. The map must not change in between. */
bool hashmap_next(const struct hashmap *map, size_t *cursor, uint64_t *key, void **value);

#endif
