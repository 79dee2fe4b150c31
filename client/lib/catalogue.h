/* SPDX-License-Identifier: MIT */
/* The names of an import's objects, recorded from its messages, for scripts that refer to them. Does no I/O. The
 * importer is not trusted: memory is bounded, names beyond the limit are only counted. */
#ifndef FARLIGHT_CLIENT_LIB_CATALOGUE_H
#define FARLIGHT_CLIENT_LIB_CATALOGUE_H

#include "lib/farlight.h"

enum fl_catalogue_list {
    FL_CATALOGUE_NODES,
    FL_CATALOGUE_MATERIALS,
    FL_CATALOGUE_LIGHTS,
    FL_CATALOGUE_LIGHT_NODES, /* lights by the names of the nodes that show them */
    FL_CATALOGUE_LIST_COUNT
};

struct fl_catalogue_entry {
    uint32_t id;
    uint32_t name; /* offset of the name in `text` */
    bool has_size; /* lights only: a rectangle or a sphere */
};

struct fl_catalogue {
    struct {
        struct fl_catalogue_entry *entries;
        size_t count, capacity;
        uint64_t left_out;
    } lists[FL_CATALOGUE_LIST_COUNT];
    char *text; /* names in sequence, each with its NUL */
    size_t text_bytes, text_capacity;
    struct fl_clip_info *clips;
    size_t clip_count, clip_capacity;
    uint32_t max_id[PROTOCOL_OBJECT_COUNT];
    bool is_lit; /* the import has a light or an environment */
};

/* Records the names in a message of the importer's. */
bool fl_catalogue_observe(struct fl_catalogue *catalogue, const struct message *message, struct fl_error *error);
void fl_catalogue_finish(struct fl_catalogue *catalogue);

/* Implement fl_scene_find_object() and fl_scene_find_clip(). */
bool fl_catalogue_find(const struct fl_catalogue *catalogue, enum protocol_object_kind kind, const char *which,
                       uint32_t *id, struct fl_error *error);
bool fl_catalogue_find_clip(const struct fl_catalogue *catalogue, const char *which, uint32_t *clip,
                            const struct fl_clip_info **info, struct fl_error *error);
/* Implements fl_scene_light_has_size(). */
bool fl_catalogue_light_has_size(const struct fl_catalogue *catalogue, uint32_t light);
/* Implements fl_scene_new_id(). */
uint32_t fl_catalogue_new_id(struct fl_catalogue *catalogue, enum protocol_object_kind kind);

/* A list of names for an error's remedy, cut off where it does not fit: "it has 3 clips: 'Run', 'Survey',
 * 'Walk'". */
struct fl_listing {
    char text[sizeof((struct fl_error *)0)->remedy];
    size_t used, listed;
};
void fl_listing_begin(struct fl_listing *listing, size_t count, const char *what);
void fl_listing_add(struct fl_listing *listing, const char *name);
bool fl_listing_is_full(const struct fl_listing *listing);

/* Grows *items to hold one more than `count`; at most 16 M. */
bool fl_grow(void **items, size_t *capacity, size_t count, size_t item_bytes, struct fl_error *error);

#endif
