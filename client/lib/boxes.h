/* SPDX-License-Identifier: MIT */
/* Bounding boxes of a model's nodes in world space, from the boxes of its meshes. Does no I/O. The importer is
 * not trusted: nodes beyond the catalogue's limit are left out, and nodes in a cycle get no box. */
#ifndef FARLIGHT_CLIENT_LIB_BOXES_H
#define FARLIGHT_CLIENT_LIB_BOXES_H

#include "lib/farlight.h"
#include "protocol/messages.h"

struct fl_box_node;

struct fl_boxes {
    struct fl_box_node *nodes; /* in the order of the file */
    size_t node_count, node_capacity;
    struct message_import_bounds *boxes;
    size_t box_count, box_capacity;
};

bool fl_boxes_add_node(struct fl_boxes *boxes, const struct message_set_node *node, struct fl_error *error);
bool fl_boxes_add(struct fl_boxes *boxes, const struct message_import_bounds *bounds, struct fl_error *error);
/* Sets the boxes of info->node_list and of the whole model, and uses up `boxes`. */
bool fl_boxes_place(struct fl_boxes *boxes, struct fl_model_info *info, struct fl_error *error);
void fl_boxes_finish(struct fl_boxes *boxes);

#endif
