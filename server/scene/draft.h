/* SPDX-License-Identifier: MIT */
/* The scene as it would be after a transaction, while the scene itself is untouched. Private to scene/.
 *
 * Edits are looked at together: the last edit of an object counts, and an edit may refer to an object that a
 * later one makes. */
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
    struct hashmap last[OBJECT_COUNT];   /* struct scene_edit *, by object id */
    struct scene_edit *last_environment; /* NULL: unchanged */
    struct hashmap checked_meshes; /* struct scene_mesh *, by a hash of their arrays: looked through already */
    struct draft_list fallen[OBJECT_COUNT]; /* companions of removed objects: companions.c */
    struct hashmap fallen_nodes;            /* the same of nodes, by id; NULL is never stored */
    const atomic_bool *abandoned;           /* NULL: it never is */
    struct error *error;
};
void draft_finish(struct draft *draft);
/* To be asked within loops over edits and nodes. True: nobody waits for the transaction any more, which
 * *draft->error says. */
bool draft_is_abandoned(const struct draft *draft);

/* The object after all edits, or NULL. Nodes that fall with a removed one are still found. */
const void *draft_find(const struct draft *draft, enum object_kind kind, uint32_t id);
/* The same, where those that fall are not found any more. */
const void *draft_remaining(const struct draft *draft, enum object_kind kind, uint32_t id);
/* Goes through all objects of a kind that this transaction neither sets nor removes and that do not fall; *cursor
 * starts at 0. NULL: no more. */
const void *draft_next_untouched(const struct draft *draft, enum object_kind kind, size_t *cursor);
bool draft_removes_any(const struct draft *draft, enum object_kind kind);
/* False: out of memory, which *draft->error says. */
bool draft_note_fallen(struct draft *draft, enum object_kind kind, uint32_t id);
/* Whether an edit is the one that counts for its object. */
bool draft_counts(const struct draft *draft, const struct scene_edit *edit);
/* Where an error about this edit belongs. */
struct edit_place draft_place(const struct draft *draft, const struct scene_edit *edit);

/* Finds the objects that are removed together with others: channels with their clip or target, skins with a joint.
 * A skin that a remaining node uses is not removed: the transaction is refused. */
bool companions_check(struct draft *draft);
/* Channels have their numbers in their clips, joints of meshes their places in skins. */
bool links_check(struct draft *draft);
/* Everything that set objects refer to is there, nothing that is removed is still in use. */
bool references_check(struct draft *draft);
/* Parents, circles, depth; finds the fallen nodes. */
bool structure_check(struct draft *draft);

#endif
