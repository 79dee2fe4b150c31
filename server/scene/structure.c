/* SPDX-License-Identifier: MIT */
/* Checks the node hierarchy in its state after a transaction. */
#include "scene/draft.h"

#include <stdio.h>
#include <stdlib.h>

/* State of a node in the traversal; above these, its depth plus FIRST_DEPTH. */
enum { UNKNOWN, ON_CHAIN, FALLEN, ABOVE_ROOTS, FIRST_DEPTH };

struct traversal {
    struct draft *draft;
    struct hierarchy hierarchy;
    uint16_t *state;
    uint32_t chain[SCENE_DEPTH_MAX]; /* nodes from the start of the traversal upwards */
    size_t length;
    uint32_t depth_max;
};

static struct scene_edit *node_edit(const struct draft *draft, uint32_t id)
{
    return hashmap_get(&draft->last[OBJECT_NODE], id);
}

/* Whether nodes appear, disappear or change their parent; if not, the hierarchy stays sound. */
static bool is_restructured(const struct draft *draft)
{
    size_t cursor = 0;
    uint64_t id;
    void *value;
    while (hashmap_next(&draft->last[OBJECT_NODE], &cursor, &id, &value)) {
        const struct scene_edit *edit = value;
        const struct scene_node *now = scene_node(draft->scene, (uint32_t)id);
        if (edit->kind == EDIT_REMOVE || !now || now->value.parent != edit->set.node.value.parent)
            return true;
    }
    return false;
}

static bool collect(struct traversal *traversal)
{
    const struct draft *draft = traversal->draft;
    const struct hashmap *now = &draft->scene->objects[OBJECT_NODE], *edited = &draft->last[OBJECT_NODE];
    const struct scene_node **nodes = malloc((now->count + edited->count) * sizeof(*nodes));
    if (!nodes)
        return false;
    size_t count = 0, cursor = 0;
    uint64_t id;
    void *value;
    while (hashmap_next(now, &cursor, &id, &value)) {
        if (!node_edit(draft, (uint32_t)id))
            nodes[count++] = value;
    }
    cursor = 0;
    while (hashmap_next(edited, &cursor, NULL, &value)) {
        const struct scene_edit *edit = value;
        if (edit->kind == EDIT_SET)
            nodes[count++] = &edit->set.node;
    }
    traversal->state = calloc(count ? count : 1, sizeof(*traversal->state));
    return hierarchy_init(&traversal->hierarchy, nodes, count) && traversal->state;
}

/* Reports an error about the current chain. The hierarchy was valid before, so an edit in the chain or above is
 * at fault: the one nearest to the start of the traversal is named. */
static bool chain_error(struct traversal *traversal, enum error_code kind, const char *what)
{
    uint32_t position = traversal->chain[0];
    for (size_t steps = 0; steps <= 2 * SCENE_DEPTH_MAX && position != HIERARCHY_NONE; steps++) {
        const struct scene_node *node = traversal->hierarchy.nodes[position];
        const struct scene_edit *edit = node_edit(traversal->draft, node->base.id);
        if (edit) {
            struct edit_place place = draft_place(traversal->draft, edit);
            return edit_error(&place, kind, ".parent", "with node %u as its parent, %s", node->value.parent, what);
        }
        position = traversal->hierarchy.parents[position];
    }
    return error_set(traversal->draft->error, ERROR_INTERNAL, "edits", "%s", what);
}

static bool too_deep(struct traversal *traversal)
{
    char what[64];
    snprintf(what, sizeof(what), "the hierarchy is more than %u levels deep", traversal->depth_max);
    chain_error(traversal, ERROR_LIMIT, what);
    return error_remedy(traversal->draft->error,
                        traversal->depth_max == SCENE_DEPTH_MAX
                            ? "join groups that only have a transform"
                            : "join groups that only have a transform, or raise limits.depth "
                              "in the daemon's configuration");
}

static bool missing_parent(struct traversal *traversal, const struct scene_node *node)
{
    const struct scene_edit *edit = node_edit(traversal->draft, node->base.id);
    if (!edit)
        return true; /* unedited, below a removed node: it is removed too */
    struct edit_place place = draft_place(traversal->draft, edit);
    if (!node_edit(traversal->draft, node->value.parent))
        edit_error(&place, ERROR_UNKNOWN_ID, ".parent", "node %u does not exist", node->value.parent);
    else
        edit_error(&place, ERROR_UNKNOWN_ID, ".parent", "node %u is removed by the same transaction",
                   node->value.parent);
    return error_remedy(traversal->draft->error, "make the parent in the same transaction, or use 0 for the root");
}

static bool fallen_parent(struct traversal *traversal, const struct scene_node *node)
{
    const struct scene_edit *edit = node_edit(traversal->draft, node->base.id);
    if (!edit)
        return true;
    struct edit_place place = draft_place(traversal->draft, edit);
    edit_error(&place, ERROR_UNKNOWN_ID, ".parent", "node %u is removed along with one above it",
               node->value.parent);
    return error_remedy(traversal->draft->error, "give it a parent that remains");
}

/* Resolves a node: goes up to one with a known state, or to a root, then assigns states down the chain. */
static bool resolve(struct traversal *traversal, uint32_t start)
{
    const struct hierarchy *hierarchy = &traversal->hierarchy;
    uint32_t above = start;
    traversal->length = 0;
    while (above != HIERARCHY_NONE && traversal->state[above] == UNKNOWN) {
        if (traversal->length == SCENE_DEPTH_MAX)
            return too_deep(traversal);
        traversal->state[above] = ON_CHAIN;
        traversal->chain[traversal->length++] = above;
        above = hierarchy->parents[above];
    }
    if (above != HIERARCHY_NONE && traversal->state[above] == ON_CHAIN)
        return chain_error(traversal, ERROR_INVALID, "it would be above itself");
    uint16_t state = above == HIERARCHY_NONE ? ABOVE_ROOTS : traversal->state[above];
    for (size_t i = traversal->length; i-- > 0;) {
        uint32_t position = traversal->chain[i];
        const struct scene_node *node = hierarchy->nodes[position];
        if (state == FALLEN) {
            if (hierarchy->parents[position] != HIERARCHY_NONE && !fallen_parent(traversal, node))
                return false;
        }
        if (node->value.parent && hierarchy->parents[position] == HIERARCHY_NONE) {
            if (!missing_parent(traversal, node))
                return false;
            state = FALLEN;
        } else if (state != FALLEN) {
            state++;
        }
        if (state >= FIRST_DEPTH + traversal->depth_max)
            return too_deep(traversal);
        traversal->state[position] = state;
    }
    return true;
}

static bool note_fallen(struct traversal *traversal)
{
    for (size_t i = 0; i < traversal->hierarchy.count; i++) {
        if (traversal->state[i] == FALLEN &&
            !draft_note_fallen(traversal->draft, OBJECT_NODE, traversal->hierarchy.nodes[i]->base.id))
            return false;
    }
    return true;
}

bool structure_check(struct draft *draft)
{
    if (!is_restructured(draft))
        return true;
    uint32_t depth_max = draft->scene->limits.depth;
    bool is_limited = depth_max && depth_max < SCENE_DEPTH_MAX;
    struct traversal traversal = {.draft = draft, .depth_max = is_limited ? depth_max : SCENE_DEPTH_MAX};
    bool sound = collect(&traversal);
    if (!sound)
        error_set(draft->error, ERROR_OUT_OF_MEMORY, "edits", "no memory to look at the hierarchy");
    for (uint32_t i = 0; sound && i < traversal.hierarchy.count; i++)
        sound = !draft_is_abandoned(draft) && resolve(&traversal, i);
    sound = sound && note_fallen(&traversal);
    hierarchy_finish(&traversal.hierarchy);
    free(traversal.state);
    return sound;
}
