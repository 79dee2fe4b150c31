/* SPDX-License-Identifier: MIT */
/* The origin of a model far from the world's origin. */
#include "origin.h"

#include "edits.h"
#include "protocol/common/box.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Distance from which an origin is used, relative to the scene's radius. Rays leave a surface by the position's
 * 65536th part (shaders/shared/path.h), which at this distance is a 256th of the scene's radius, or more than 6
 * cm. */
#define RADII_MAX 256.0
#define DISTANCE_MAX 4096.0

bool import_find_origin(const double lower[3], const double upper[3], double origin[3])
{
    double distance2 = 0, radius2 = 0;

    for (int c = 0; c < 3; c++) {
        const double middle = (lower[c] + upper[c]) / 2, half = (upper[c] - lower[c]) / 2;

        if (!(fabs(middle) < 1e12) || !(half >= 0))
            return false;
        origin[c] = (double)(float)round(middle);
        distance2 += middle * middle;
        radius2 += half * half;
    }
    return radius2 > 0 && (distance2 > RADII_MAX * RADII_MAX * radius2 ||
                           (distance2 > DISTANCE_MAX * DISTANCE_MAX && distance2 > 4 * radius2));
}

uint32_t import_add_origin_node(struct import_scene *scene, const double origin[3], uint32_t parent)
{
    struct message_set_node node = {.value.parent = parent, .name = "origin"};

    import_identity(node.value.parent_from_node);
    for (int c = 0; c < 3; c++)
        node.value.parent_from_node[c * 4 + 3] = (float)origin[c];
    return import_add_node(scene, &node);
}

/* ---- the whole scene ---- */

#define DEPTH_MAX 256u /* the daemon's limit */

struct tree {
    struct message_set_node **nodes;     /* by number */
    const struct import_bounds **meshes; /* by number */
    const struct import_bounds **spheres;
    uint32_t node_count, mesh_count, sphere_count;
};

static void tree_finish(struct tree *tree)
{
    free((void *)tree->nodes);
    free((void *)tree->meshes);
    free((void *)tree->spheres);
}

static bool tree_init(struct tree *tree, struct import_scene *scene)
{
    *tree = (struct tree){.node_count = scene->last_id[PROTOCOL_OBJECT_NODE] + 1,
                          .mesh_count = scene->last_id[PROTOCOL_OBJECT_MESH] + 1,
                          .sphere_count = scene->last_id[PROTOCOL_OBJECT_SPHERES] + 1};
    tree->nodes = calloc(tree->node_count, sizeof(*tree->nodes));
    tree->meshes = calloc(tree->mesh_count, sizeof(*tree->meshes));
    tree->spheres = calloc(tree->sphere_count, sizeof(*tree->spheres));
    if (!tree->nodes || !tree->meshes || !tree->spheres) {
        tree_finish(tree);
        return import_fail(scene, NULL, "out of memory");
    }
    for (size_t i = 0; i < scene->edit_count; i++)
        if (scene->edits[i].message.type == MESSAGE_SET_NODE)
            tree->nodes[scene->edits[i].message.set_node.node] = &scene->edits[i].message.set_node;
    for (size_t i = 0; i < scene->bounds_count; i++) {
        const struct import_bounds *bounds = &scene->bounds[i];

        if (bounds->kind == PROTOCOL_NODE_MESH && bounds->object < tree->mesh_count)
            tree->meshes[bounds->object] = bounds;
        if (bounds->kind == PROTOCOL_NODE_SPHERES && bounds->object < tree->sphere_count)
            tree->spheres[bounds->object] = bounds;
    }
    return true;
}

/* NULL: the node shows nothing, or joints place it. */
static const struct import_bounds *bounds_of(const struct tree *tree, const struct message_set_node *node)
{
    if (node->value.kind == PROTOCOL_NODE_MESH && node->value.object < tree->mesh_count && node->value.skin == 0)
        return tree->meshes[node->value.object];
    if (node->value.kind == PROTOCOL_NODE_SPHERES && node->value.object < tree->sphere_count)
        return tree->spheres[node->value.object];
    return NULL;
}

/* False: nothing is shown. */
static bool world_box(const struct tree *tree, double lower[3], double upper[3])
{
    bool any = false;

    for (uint32_t id = 1; id < tree->node_count; id++) {
        const struct message_set_node *node = tree->nodes[id];
        const struct import_bounds *bounds = node ? bounds_of(tree, node) : NULL;
        double low[3], high[3];

        if (!bounds)
            continue;
        for (int c = 0; c < 3; c++) {
            low[c] = (double)bounds->lower[c];
            high[c] = (double)bounds->upper[c];
        }
        for (unsigned depth = 0; node && depth <= DEPTH_MAX; depth++) {
            box_transform(node->value.parent_from_node, low, high);
            node = node->value.parent < tree->node_count ? tree->nodes[node->value.parent] : NULL;
        }
        for (int c = 0; c < 3; c++) {
            lower[c] = any ? fmin(lower[c], low[c]) : low[c];
            upper[c] = any ? fmax(upper[c], high[c]) : high[c];
        }
        any = true;
    }
    return any;
}

/* True if a clip places a root, so that its transform cannot move it. */
static bool has_moving_root(const struct import_scene *scene, const struct tree *tree)
{
    for (size_t i = 0; i < scene->edit_count; i++) {
        const struct message_set_channel *channel = &scene->edits[i].message.set_channel;

        if (scene->edits[i].message.type == MESSAGE_SET_CHANNEL &&
            channel->value.path == PROTOCOL_CHANNEL_NODE_TRANSLATION && channel->value.object < tree->node_count &&
            tree->nodes[channel->value.object] && tree->nodes[channel->value.object]->value.parent == 0)
            return true;
    }
    return false;
}

/* Moves the whole scene by a new node above all others. */
static bool move_below(struct import_scene *scene, const double origin[3])
{
    const double back[3] = {-origin[0], -origin[1], -origin[2]};
    const uint32_t top = import_add_origin_node(scene, back, 0);

    for (size_t i = 0; top != 0 && i < scene->edit_count; i++) {
        struct message_set_node *node = &scene->edits[i].message.set_node;

        if (scene->edits[i].message.type == MESSAGE_SET_NODE && node->value.parent == 0 && node->node != top)
            node->value.parent = top;
    }
    return top != 0;
}

bool import_settle_origin(struct import_scene *scene)
{
    double lower[3], upper[3], origin[3], distance2 = 0;
    bool is_far, moving;
    struct tree tree;

    if (!tree_init(&tree, scene))
        return false;
    is_far = world_box(&tree, lower, upper) && import_find_origin(lower, upper, origin);
    moving = is_far && has_moving_root(scene, &tree);
    for (uint32_t id = 1; is_far && !moving && id < tree.node_count; id++)
        for (int c = 0; tree.nodes[id] && tree.nodes[id]->value.parent == 0 && c < 3; c++) {
            float *place = &tree.nodes[id]->value.parent_from_node[c * 4 + 3];

            *place = (float)((double)*place - origin[c]);
        }
    tree_finish(&tree);
    if (!is_far)
        return true;
    for (int c = 0; c < 3; c++) {
        scene->origin[c] = (float)origin[c];
        distance2 += origin[c] * origin[c];
    }
    import_note(
        scene, PROTOCOL_SEVERITY_INFO, NULL,
        "it lies %.0f m from the origin, where 32-bit numbers are %.2g m apart: %.9g,%.9g,%.9g is subtracted "
        "from all places; --eye and --look-at stay the model's",
        sqrt(distance2), sqrt(distance2) * (double)FLT_EPSILON, origin[0], origin[1], origin[2]);
    return !moving || move_below(scene, origin);
}
