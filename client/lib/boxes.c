/* SPDX-License-Identifier: MIT */
/* Bounding boxes of a model's nodes, from the boxes of their meshes. */
#include "lib/boxes.h"
#include "lib/catalogue.h"
#include "protocol/common/box.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NODES_MAX (1u << 20) /* the catalogue's limit */
#define DEPTH_MAX 256u       /* the daemon's limit */

struct fl_box_node {
    uint32_t node, parent, object;
    enum protocol_node_kind kind;
    bool is_skinned;
    float parent_from_node[12]; /* 3x4, row-major */
};

bool fl_boxes_add_node(struct fl_boxes *boxes, const struct message_set_node *node, struct fl_error *error)
{
    if (boxes->node_count >= NODES_MAX)
        return true;
    if (!fl_grow((void **)&boxes->nodes, &boxes->node_capacity, boxes->node_count, sizeof(*boxes->nodes), error))
        return false;
    struct fl_box_node *made = &boxes->nodes[boxes->node_count++];
    *made = (struct fl_box_node){.node = node->node,
                                 .parent = node->value.parent,
                                 .object = node->value.object,
                                 .kind = node->value.kind,
                                 .is_skinned = node->value.skin != 0};
    memcpy(made->parent_from_node, node->value.parent_from_node, sizeof(made->parent_from_node));
    return true;
}

bool fl_boxes_add(struct fl_boxes *boxes, const struct message_import_bounds *bounds, struct fl_error *error)
{
    if (boxes->box_count >= NODES_MAX)
        return true;
    if (!fl_grow((void **)&boxes->boxes, &boxes->box_capacity, boxes->box_count, sizeof(*boxes->boxes), error))
        return false;
    boxes->boxes[boxes->box_count++] = *bounds;
    return true;
}

/* ---- placing ---- */

/* Nodes sorted by number, for looking up parents; `boxes` keeps the order of the file. */
static int by_node(const void *a, const void *b)
{
    const struct fl_box_node *const *first = a, *const *second = b;
    return (*first)->node < (*second)->node ? -1 : (*first)->node > (*second)->node;
}

static int by_object(const void *a, const void *b)
{
    const struct message_import_bounds *first = a, *second = b;
    if (first->kind != second->kind)
        return first->kind < second->kind ? -1 : 1;
    return first->object < second->object ? -1 : first->object > second->object;
}

static const struct fl_box_node *find_node(const struct fl_box_node *const *sorted, size_t count, uint32_t number)
{
    const struct fl_box_node wanted = {.node = number}, *key = &wanted;
    const struct fl_box_node *const *found = bsearch(&key, sorted, count, sizeof(*sorted), by_node);
    return found ? *found : NULL;
}

/* False: the node has no place, as its parents are missing or a cycle. Vertices with joints are placed by these
 * alone, at rest usually where they are in the mesh's own space. */
static bool place(const struct fl_box_node *const *sorted, size_t count, const struct fl_box_node *node,
                  double lower[3], double upper[3])
{
    for (unsigned depth = 0; depth <= DEPTH_MAX && !node->is_skinned; depth++) {
        box_transform(node->parent_from_node, lower, upper);
        if (node->parent == 0)
            return true;
        node = find_node(sorted, count, node->parent);
        if (!node)
            return false;
    }
    return node->is_skinned;
}

static void place_node(const struct fl_boxes *boxes, const struct fl_box_node *const *sorted, size_t index,
                       struct fl_model_info *info)
{
    const struct fl_box_node *node = &boxes->nodes[index];
    struct fl_model_object *object = &info->node_list[index];
    const struct message_import_bounds key = {.kind = node->kind, .object = node->object};
    const struct message_import_bounds *box =
        boxes->box_count > 0 ? bsearch(&key, boxes->boxes, boxes->box_count, sizeof(key), by_object) : NULL;
    double lower[3], upper[3];
    if (!box)
        return;
    for (unsigned axis = 0; axis < 3; axis++) {
        lower[axis] = (double)box->lower[axis];
        upper[axis] = (double)box->upper[axis];
    }
    if (!place(sorted, boxes->node_count, node, lower, upper))
        return;
    object->has_bounds = true;
    for (unsigned axis = 0; axis < 3; axis++) {
        object->lower_world[axis] = (float)fmax(lower[axis], -(double)FLT_MAX);
        object->upper_world[axis] = (float)fmin(upper[axis], (double)FLT_MAX);
        if (!info->has_bounds || object->lower_world[axis] < info->lower_world[axis])
            info->lower_world[axis] = object->lower_world[axis];
        if (!info->has_bounds || object->upper_world[axis] > info->upper_world[axis])
            info->upper_world[axis] = object->upper_world[axis];
    }
    info->has_bounds = true;
}

bool fl_boxes_place(struct fl_boxes *boxes, struct fl_model_info *info, struct fl_error *error)
{
    const struct fl_box_node **sorted = malloc((boxes->node_count + 1) * sizeof(*sorted));
    if (!sorted)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    for (size_t i = 0; i < boxes->node_count; i++)
        sorted[i] = &boxes->nodes[i];
    qsort(sorted, boxes->node_count, sizeof(*sorted), by_node);
    if (boxes->box_count > 0)
        qsort(boxes->boxes, boxes->box_count, sizeof(*boxes->boxes), by_object);
    for (size_t i = 0; i < boxes->node_count && i < info->node_list_count; i++)
        place_node(boxes, sorted, i, info);
    free(sorted);
    return true;
}

void fl_boxes_finish(struct fl_boxes *boxes)
{
    free(boxes->nodes);
    free(boxes->boxes);
    *boxes = (struct fl_boxes){0};
}
