/* SPDX-License-Identifier: MIT */
/* Look-ups in a draft: the last edit of each object, or the scene's own. */
#include "scene/draft.h"

#include <stdlib.h>

void draft_finish(struct draft *draft)
{
    for (int kind = 0; kind < OBJECT_COUNT; kind++) {
        hashmap_finish(&draft->last[kind]);
        free(draft->fallen[kind].ids);
    }
    hashmap_finish(&draft->fallen_nodes);
    hashmap_finish(&draft->checked_meshes);
}

bool draft_is_abandoned(const struct draft *draft)
{
    if (!draft->abandoned || !atomic_load_explicit(draft->abandoned, memory_order_relaxed))
        return false;
    error_set(draft->error, ERROR_CANCELLED, "edits", "the transaction was abandoned");
    return true;
}

const void *draft_find(const struct draft *draft, enum object_kind kind, uint32_t id)
{
    const struct scene_edit *edit = hashmap_get(&draft->last[kind], id);
    if (edit)
        return edit->kind == EDIT_SET ? &edit->set : NULL;
    return hashmap_get(&draft->scene->objects[kind], id);
}

bool draft_counts(const struct draft *draft, const struct scene_edit *edit)
{
    if (edit->kind == EDIT_SET_ENVIRONMENT)
        return draft->last_environment == edit;
    return hashmap_get(&draft->last[edit->object], edit_object_id(edit)) == edit;
}

struct edit_place draft_place(const struct draft *draft, const struct scene_edit *edit)
{
    return (struct edit_place){(size_t)(edit - draft->edits), edit, draft->error};
}

const void *draft_remaining(const struct draft *draft, enum object_kind kind, uint32_t id)
{
    bool fell = kind == OBJECT_NODE && hashmap_get(&draft->fallen_nodes, id);
    return fell ? NULL : draft_find(draft, kind, id);
}

const void *draft_next_untouched(const struct draft *draft, enum object_kind kind, size_t *cursor)
{
    uint64_t id;
    void *object;
    while (hashmap_next(&draft->scene->objects[kind], cursor, &id, &object)) {
        if (!hashmap_get(&draft->last[kind], id) &&
            !(kind == OBJECT_NODE && hashmap_get(&draft->fallen_nodes, id)))
            return object;
    }
    return NULL;
}

bool draft_removes_any(const struct draft *draft, enum object_kind kind)
{
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&draft->last[kind], &cursor, NULL, &value)) {
        if (((const struct scene_edit *)value)->kind == EDIT_REMOVE)
            return true;
    }
    return false;
}

bool draft_note_fallen(struct draft *draft, enum object_kind kind, uint32_t id)
{
    struct draft_list *list = &draft->fallen[kind];
    if (list->count == list->capacity) {
        size_t capacity = list->capacity ? list->capacity * 2 : 64;
        uint32_t *ids = realloc(list->ids, capacity * sizeof(*ids));
        if (ids) {
            list->ids = ids;
            list->capacity = capacity;
        }
    }
    if (list->count == list->capacity || (kind == OBJECT_NODE && !hashmap_put(&draft->fallen_nodes, id, draft)))
        return error_set(draft->error, ERROR_OUT_OF_MEMORY, "edits", "no memory for a list of %ss that go along",
                         object_kind_name(kind));
    list->ids[list->count++] = id;
    return true;
}
