/* SPDX-License-Identifier: MIT */
/* Draft of the scene after a transaction, while the scene itself is unchanged. Private to scene/.
 *
 * Edits are checked together: the last edit of an object counts, and an edit may refer to an object that a later
 * one makes. */
#ifndef FARLIGHT_SCENE_DRAFT_H
#define FARLIGHT_SCENE_DRAFT_H

#include "scene/edit.h"
#include "scene/hierarchy.h"

struct draft_list {
    uint32_t *ids; /* owned */
    size_t count, capacity;
};

struct draft {
    struct scene *scene;
    struct scene_edit *edits;
    size_t edit_count;
    struct hashmap last[OBJECT_COUNT];      /* struct scene_edit *, by object id */
    struct scene_edit *last_environment;    /* NULL: unchanged */
    struct hashmap checked_meshes;          /* struct scene_mesh *, by a hash of their arrays: already checked */
    struct draft_list fallen[OBJECT_COUNT]; /* objects removed together with others: dependents.c */
    struct hashmap fallen_nodes;            /* nodes among them, by id; NULL is never stored */
    const atomic_bool *abandoned;           /* NULL: it is never abandoned */
    struct error *error;
};
void draft_finish(struct draft *draft);
/* Checked within loops over edits and nodes. True: nobody waits for the transaction any more, and *draft->error
 * says so. */
bool draft_is_abandoned(const struct draft *draft);

/* The object after all edits, or NULL. Nodes removed with another node are still found. */
const void *draft_find(const struct draft *draft, enum object_kind kind, uint32_t id);
/* The object after all edits, or NULL, also if it is removed together with another object. */
const void *draft_remaining(const struct draft *draft, enum object_kind kind, uint32_t id);
/* Iterates over all objects of a kind that this transaction neither sets nor removes, directly or with others;
 * *cursor starts at 0. NULL: no more. */
const void *draft_next_untouched(const struct draft *draft, enum object_kind kind, size_t *cursor);
bool draft_removes_any(const struct draft *draft, enum object_kind kind);
/* Notes an object that is removed together with others. False: out of memory, and *draft->error says so. */
bool draft_note_fallen(struct draft *draft, enum object_kind kind, uint32_t id);
/* Whether an edit is the last one of its object. */
bool draft_counts(const struct draft *draft, const struct scene_edit *edit);
/* Place of an error about this edit. */
struct edit_place draft_place(const struct draft *draft, const struct scene_edit *edit);

/* Finds the objects that are removed together with others: channels with their clip or target, skins with a joint.
 * A skin that a remaining node uses is not removed: the transaction is refused. */
bool dependents_check(struct draft *draft);
/* Checks that channels have their numbers in their clips, and joints of meshes their places in skins. */
bool links_check(struct draft *draft);
/* Checks that everything that set objects refer to exists, and nothing that is removed is still in use. */
bool references_check(struct draft *draft);
/* Checks parents, circles and depth; finds the nodes removed with others. */
bool structure_check(struct draft *draft);

#endif
