/* SPDX-License-Identifier: MIT */
/* Hash map with linear probing and dense pairs. */
#include "base/hashmap.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <sys/random.h>

struct hashmap_slot {
    uint64_t key;
    void *value;
};

#define CAPACITY_MIN ((size_t)16)
#define CAPACITY_MAX ((size_t)1 << 32)

void hashmap_init(struct hashmap *map)
{
    *map = (struct hashmap){0};
}

void hashmap_finish(struct hashmap *map)
{
    free(map->slots);
    free(map->index);
    *map = (struct hashmap){0};
}

/* Random number that scatters keys. Clients choose the keys: without a secret, one could choose thousands that
 * share a place, and every search among them would be long. */
static uint64_t secret(void)
{
    static atomic_uint_fast64_t value; /* 0: not chosen yet */
    uint64_t chosen = atomic_load_explicit(&value, memory_order_relaxed);
    if (chosen)
        return chosen;
    if (getrandom(&chosen, sizeof(chosen), 0) != (ssize_t)sizeof(chosen))
        chosen = (uintptr_t)&chosen; /* no random numbers: better than nothing */
    chosen |= 1;
    uint64_t other = 0;
    return atomic_compare_exchange_strong(&value, &other, chosen) ? chosen : other;
}

/* Preferred place of a key, by the finaliser of splitmix64: identifiers are mostly 1, 2, 3, .., and must
 * spread. */
static size_t home_of(const struct hashmap *map, uint64_t key)
{
    key ^= secret();
    key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9u;
    key = (key ^ (key >> 27)) * 0x94d049bb133111ebu;
    return (size_t)(key ^ (key >> 31)) & (map->capacity - 1);
}

/* Place of a key in the index, or the free place for it. */
static size_t find(const struct hashmap *map, uint64_t key)
{
    size_t place = home_of(map, key);
    while (map->index[place] && map->slots[map->index[place] - 1].key != key)
        place = (place + 1) & (map->capacity - 1);
    return place;
}

void *hashmap_get(const struct hashmap *map, uint64_t key)
{
    if (!map->count)
        return NULL;
    uint32_t position = map->index[find(map, key)];
    return position ? map->slots[position - 1].value : NULL;
}

static bool grow(struct hashmap *map)
{
    size_t capacity = map->capacity ? map->capacity * 2 : CAPACITY_MIN;
    if (capacity > CAPACITY_MAX)
        return false;
    uint32_t *index = calloc(capacity, sizeof(*index));
    if (!index)
        return false;
    struct hashmap_slot *slots = realloc(map->slots, capacity / 2 * sizeof(*slots));
    if (!slots) {
        free(index);
        return false;
    }
    free(map->index);
    map->slots = slots;
    map->index = index;
    map->capacity = capacity;
    for (size_t i = 0; i < map->count; i++)
        index[find(map, slots[i].key)] = (uint32_t)(i + 1);
    return true;
}

bool hashmap_put(struct hashmap *map, uint64_t key, void *value)
{
    if (map->capacity) {
        uint32_t position = map->index[find(map, key)];
        if (position) {
            map->slots[position - 1].value = value;
            return true;
        }
    }
    if (map->count == map->capacity / 2 && !grow(map))
        return false;
    map->slots[map->count] = (struct hashmap_slot){key, value};
    map->index[find(map, key)] = (uint32_t)++map->count;
    return true;
}

/* Frees a place of the index and moves later ones of its run back, so that no search stops short. */
static void free_place(struct hashmap *map, size_t place)
{
    size_t mask = map->capacity - 1;
    size_t next = (place + 1) & mask;
    while (map->index[next]) {
        size_t home = home_of(map, map->slots[map->index[next] - 1].key);
        if (((next - home) & mask) >= ((next - place) & mask)) {
            map->index[place] = map->index[next];
            place = next;
        }
        next = (next + 1) & mask;
    }
    map->index[place] = 0;
}

void *hashmap_remove(struct hashmap *map, uint64_t key)
{
    if (!map->count)
        return NULL;
    size_t place = find(map, key);
    uint32_t position = map->index[place];
    if (!position)
        return NULL;
    void *value = map->slots[position - 1].value;
    free_place(map, place);
    /* The last pair fills the gap. */
    size_t last = map->count - 1;
    if (position - 1 != last) {
        map->index[find(map, map->slots[last].key)] = position;
        map->slots[position - 1] = map->slots[last];
    }
    map->count--;
    return value;
}

bool hashmap_chain(struct hashmap *map, uint64_t key, struct hashmap_link *link)
{
    link->next = hashmap_get(map, key);
    return hashmap_put(map, key, link);
}

void hashmap_unchain(struct hashmap *map, uint64_t key, struct hashmap_link *link)
{
    struct hashmap_link *before = hashmap_get(map, key);
    if (before == link && link->next) {
        hashmap_put(map, key, link->next); /* a replacement needs no memory */
    } else if (before == link) {
        hashmap_remove(map, key);
    } else {
        while (before->next != link)
            before = before->next;
        before->next = link->next;
    }
}

bool hashmap_next(const struct hashmap *map, size_t *cursor, uint64_t *key, void **value)
{
    if (*cursor >= map->count)
        return false;
    const struct hashmap_slot *slot = &map->slots[(*cursor)++];
    if (key)
        *key = slot->key;
    if (value)
        *value = slot->value;
    return true;
}
