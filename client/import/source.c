/* SPDX-License-Identifier: MIT */
/* The models of an import. */
#include "source.h"

#include "import/model/edits.h"
#include "import/model/placement.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define PLACE_MAX 1e9

/* ---- the command line ---- */

/* Reads three numbers with commas, or one; *text moves past them and a colon. */
static bool take_numbers(const char **text, double *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        char *end;

        numbers[i] = strtod(*text, &end);
        if (end == *text || !(fabs(numbers[i]) <= PLACE_MAX) || (i + 1 < count && *end++ != ','))
            return false;
        *text = end;
    }
    if (**text != '\0' && **text != ':')
        return false;
    *text += **text == ':';
    return true;
}

bool source_place(struct source *source, const char *text)
{
    source->is_placed = true;
    source->scale = 1;
    return take_numbers(&text, source->position, 3) &&
           (*text == '\0' || take_numbers(&text, source->degrees, 3)) &&
           (*text == '\0' || take_numbers(&text, &source->scale, 1)) && *text == '\0' && source->scale > 0;
}

/* ---- reading ---- */

static bool is_standard_input(const struct source *source)
{
    return strcmp(source->path, "-") == 0;
}

const char *source_name(const struct source *source)
{
    const char *slash = strrchr(source->path, '/');

    if (is_standard_input(source))
        return "standard input";
    return slash && slash[1] ? slash + 1 : source->path;
}

bool source_read(struct source *source, char reason[FILES_REASON_BYTES])
{
    char name[64];

    if (!files_open(&source->files, source->path, NULL, reason))
        return false;
    if (source->format)
        snprintf(name, sizeof(name), "model.%s", source->format);
    source->of = format_of_name(source->format ? name : source->path);
    source->bytes = files_read_descriptor(&source->files, source->files.model, &source->size_bytes, reason);
    if (!source->bytes)
        return false;
    /* An unknown format that the user names is a mistake, whatever the bytes are. */
    if (!source->format || source->of.reader != FORMAT_UNKNOWN)
        source->of = format_of(source->format ? name : source->path, source->bytes, source->size_bytes);
    return true;
}

void source_finish(struct source *source)
{
    files_finish(&source->files);
    free(source->bytes);
    source->bytes = NULL;
}

/* ---- its place in the scene ---- */

static void transform(const struct source *source, float parent_from_node[12])
{
    static const double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, no_scale[3] = {1, 1, 1}, origin[3] = {0};
    const double scale[3] = {source->scale, source->scale, source->scale}, none[4] = {0, 0, 0, 1};
    struct placement placed = placement_from_parts(scale, none, origin);

    for (int axis = 0; axis < 3; axis++) {
        struct placement turned;
        double rotation[4];

        placement_turn(axes[axis], source->degrees[axis], rotation);
        turned = placement_from_parts(no_scale, rotation, axis == 2 ? source->position : origin);
        placed = placement_product(&turned, &placed);
    }
    placement_to_floats(&placed, parent_from_node);
}

/* Writes "chair" for "rooms/chair.glb"; standard input is "stdin". */
static void write_stem(const struct source *source, char stem[IMPORT_PREFIX_MAX + 1])
{
    const char *name = is_standard_input(source) ? "stdin" : source_name(source), *dot = strrchr(name, '.');
    char cut[IMPORT_PREFIX_MAX + 1];

    snprintf(cut, sizeof(cut), "%.*s", dot && dot > name ? (int)(dot - name) : (int)strlen(name), name);
    import_copy_text(stem, IMPORT_PREFIX_MAX - 4, cut); /* leaves space for "-64/" */
}

static void write_prefix(struct source *sources, size_t index)
{
    char stem[IMPORT_PREFIX_MAX + 1], other[IMPORT_PREFIX_MAX + 1];
    unsigned same = 1;

    write_stem(&sources[index], stem);
    for (size_t i = 0; i < index; i++) {
        write_stem(&sources[i], other);
        same += strcmp(stem, other) == 0;
    }
    if (same == 1)
        snprintf(sources[index].prefix, sizeof(stem), "%.*s/", IMPORT_PREFIX_MAX - 5, stem);
    else
        snprintf(sources[index].prefix, sizeof(stem), "%.*s-%u/", IMPORT_PREFIX_MAX - 5, stem, same);
}

bool source_begin(struct import_scene *scene, struct source *sources, size_t index, size_t count)
{
    struct source *source = &sources[index];
    struct message_set_node root = {.value.kind = PROTOCOL_NODE_GROUP};
    char name[IMPORT_PREFIX_MAX + 1];

    import_copy_text(scene->file, sizeof(scene->file), source_name(source));
    source->edit_begin = scene->edit_count;
    source->node_begin = scene->last_id[PROTOCOL_OBJECT_NODE];
    if (count == 1 && !source->is_placed)
        return true;
    write_prefix(sources, index);
    snprintf(name, sizeof(name), "%.*s", (int)strlen(source->prefix) - 1, source->prefix);
    root.name = name;
    transform(source, root.value.parent_from_node);
    source->root = import_add_node(scene, &root);
    scene->root = source->root;
    scene->is_added = index > 0;
    if (count > 1)
        memcpy(scene->prefix, source->prefix, sizeof(source->prefix));
    return !scene->failed;
}

void source_end(struct import_scene *scene, struct source *source)
{
    source->edit_end = scene->edit_count;
    source->node_end = scene->last_id[PROTOCOL_OBJECT_NODE];
    scene->root = 0;
    scene->is_added = false;
    scene->prefix[0] = '\0';
}

/* ---- the same file again ---- */

static bool is_shareable(const struct import_scene *scene, const struct source *first)
{
    for (size_t i = first->edit_begin; i < first->edit_end; i++)
        switch (scene->edits[i].message.type) {
        case MESSAGE_SET_SKIN:
        case MESSAGE_SET_CLIP:
        case MESSAGE_SET_CHANNEL:
        case MESSAGE_SET_CAMERA:
        case MESSAGE_SET_ENVIRONMENT:
            return false;
        default:
            break;
        }
    return true;
}

static const char *own_name(const struct source *first, const char *name)
{
    const size_t length = strlen(first->prefix);

    return strncmp(name, first->prefix, length) == 0 ? name + length : name;
}

/* Copies nodes. The nodes of a model have consecutive identifiers; the copies have them at an offset. */
static bool copy_nodes(struct import_scene *scene, const struct source *first, uint32_t offset, uint32_t root)
{
    for (size_t i = first->edit_begin; i < first->edit_end; i++) {
        struct message_set_node node = scene->edits[i].message.set_node;
        struct import_edit *edit;

        if (scene->edits[i].message.type != MESSAGE_SET_NODE || node.node == first->root)
            continue;
        edit = import_append(scene, MESSAGE_SET_NODE);
        if (!edit)
            return false;
        edit->message.set_node = node;
        edit->message.set_node.node = node.node + offset;
        edit->message.set_node.value.parent = node.value.parent == first->root ? root : node.value.parent + offset;
        edit->message.set_node.name = import_copy_name(scene, own_name(first, node.name ? node.name : ""));
        edit->message.set_node.weights = import_copy_weights(scene, node.weights, node.weights_count);
    }
    return !scene->failed;
}

bool source_repeat(struct import_scene *scene, struct source *sources, size_t index, size_t count)
{
    struct source *source = &sources[index];
    const struct source *first = sources;
    uint32_t offset;

    while (strcmp(first->path, source->path) != 0)
        first++;
    if (first == source || !is_shareable(scene, first))
        return false;
    offset = scene->last_id[PROTOCOL_OBJECT_NODE] - first->node_begin;
    if (!source_begin(scene, sources, index, count))
        return true;
    scene->last_id[PROTOCOL_OBJECT_NODE] = offset + first->node_end;
    copy_nodes(scene, first, offset, source->root);
    source_end(scene, source);
    return true;
}
