/* SPDX-License-Identifier: MIT */
/* The scene as it would be after a transaction, while the scene itself is untouched. Private to scene/.
 *
 * Edits are looked at together: the last edit of an object counts, and an edit may refer to an object that a
 * later one makes. */
#ifndef FARLIGHT_SCENE_DRAFT_H
#define FARLIGHT_SCENE_DRAFT_H

#include "scene/edit.h"
#include "scene/hierarchy.h"

struct draft {
    struct scene *scene;
    struct scene_edit *edits;
    size_t edit_count;
    struct hashmap last[SCENE_OBJECT_KIND_COUNT]; /* struct scene_edit *, by object id */
    struct scene_edit *last_environment;          /* NULL: unchanged */
    uint32_t *fallen;                             /* owned: nodes that go because one above them is removed */
    size_t fallen_count;
    struct error *error;
};

/* The object after all edits, or NULL. Nodes that fall with a removed one are still found. */
const void *draft_find(const struct draft *draft, enum scene_object_kind kind, uint32_t id);
/* Whether an edit is the one that counts for its object. */
bool draft_counts(const struct draft *draft, const struct scene_edit *edit);
/* Where an error about this edit belongs. */
struct edit_place draft_place(const struct draft *draft, const struct scene_edit *edit);

/* Everything that set objects refer to is there, nothing that is removed is still in use. */
bool references_check(struct draft *draft);
/* Parents, circles, depth; finds the fallen nodes. */
bool structure_check(struct draft *draft);

#endif
