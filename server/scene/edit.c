/* SPDX-License-Identifier: MIT */
/* Names of edits, checks of arrays, and memory of objects. */
#include "scene/edit.h"

#include "scene/channel.h"
#include "scene/pose.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

const char *object_kind_name(enum object_kind kind)
{
    static const char *const names[OBJECT_COUNT] = {
        [OBJECT_NODE] = "node",         [OBJECT_MESH] = "mesh",       [OBJECT_SPHERES] = "spheres",
        [OBJECT_MATERIAL] = "material", [OBJECT_TEXTURE] = "texture", [OBJECT_LIGHT] = "light",
        [OBJECT_CAMERA] = "camera",     [OBJECT_DISC] = "disc",       [OBJECT_SKIN] = "skin",
        [OBJECT_CLIP] = "clip",         [OBJECT_CHANNEL] = "channel", [OBJECT_ENVIRONMENT] = "environment",
    };
    return (unsigned)kind < OBJECT_COUNT ? names[kind] : "object";
}

uint32_t edit_object_id(const struct scene_edit *edit)
{
    if (edit->kind == EDIT_SET_ENVIRONMENT)
        return 0;
    /* Every object begins with a scene_object, so any member of the union gives access to it. */
    return edit->kind == EDIT_REMOVE ? edit->id : edit->set.node.base.id;
}

bool edit_error(const struct edit_place *place, enum error_code kind, const char *path, const char *format, ...)
{
    char field[sizeof(place->error->field)], text[sizeof(place->error->text)];
    if (place->edit->kind == EDIT_SET_ENVIRONMENT)
        snprintf(field, sizeof(field), "edits[%zu] (environment)%s", place->index, path);
    else
        snprintf(field, sizeof(field), "edits[%zu] (%s %u)%s", place->index, object_kind_name(place->edit->object),
                 edit_object_id(place->edit), path);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof(text), format, arguments);
    va_end(arguments);
    return error_set(place->error, kind, field, "%s", text);
}

bool array_size_check(const struct blob *blob, uint64_t count, uint64_t element_bytes, const char *path,
                      const struct edit_place *place)
{
    uint64_t needed;
    if (__builtin_mul_overflow(count, element_bytes, &needed) || blob->size_bytes != needed)
        return edit_error(place, ERROR_INVALID, path,
                          "the array has %zu bytes, but %llu elements of %llu bytes are declared",
                          blob->size_bytes, (unsigned long long)count, (unsigned long long)element_bytes);
    return true;
}

/* Length of a block: it is constant, without an exit inside, so that the compiler processes several numbers at
 * a time. */
#define FLOAT_BLOCK 1024

static bool block_is_fine(const float *values, float maximum)
{
    unsigned bad = 0;
    for (size_t i = 0; i < FLOAT_BLOCK; i++)
        bad |= (unsigned)!(fabsf(values[i]) <= maximum); /* true for NaN too */
    return !bad;
}

size_t first_bad_float(const float *values, size_t count, float maximum)
{
    size_t i = 0;
    while (count - i >= FLOAT_BLOCK && block_is_fine(values + i, maximum))
        i += FLOAT_BLOCK;
    while (i < count && fabsf(values[i]) <= maximum)
        i++;
    return i;
}

bool ranges_check(const struct record_material_range *ranges, uint32_t range_count, uint32_t primitive_count,
                  const struct edit_place *place)
{
    uint32_t done = 0; /* primitives before this one belong to earlier ranges */
    for (uint32_t i = 0; i < range_count; i++) {
        char path[64];
        if (ranges[i].first < done) {
            snprintf(path, sizeof(path), ".ranges[%u].first", i);
            edit_error(place, ERROR_INVALID, path, "%u lies before %u, where the range before it ends",
                       ranges[i].first, done);
            return error_remedy(place->error, "sort the ranges by their first primitive and let none overlap");
        }
        if (ranges[i].first > primitive_count || ranges[i].count > primitive_count - ranges[i].first) {
            snprintf(path, sizeof(path), ".ranges[%u].count", i);
            return edit_error(place, ERROR_INVALID, path, "%u from %u reaches beyond the %u primitives",
                              ranges[i].count, ranges[i].first, primitive_count);
        }
        done = ranges[i].first + ranges[i].count;
    }
    return true;
}

size_t object_struct_bytes(enum object_kind kind)
{
    static const size_t sizes[OBJECT_COUNT] = {
        [OBJECT_NODE] = sizeof(struct scene_node),       [OBJECT_MESH] = sizeof(struct scene_mesh),
        [OBJECT_SPHERES] = sizeof(struct scene_spheres), [OBJECT_MATERIAL] = sizeof(struct scene_material),
        [OBJECT_TEXTURE] = sizeof(struct scene_texture), [OBJECT_LIGHT] = sizeof(struct scene_light),
        [OBJECT_CAMERA] = sizeof(struct scene_camera),   [OBJECT_DISC] = sizeof(struct scene_disc),
        [OBJECT_SKIN] = sizeof(struct scene_skin),       [OBJECT_CLIP] = sizeof(struct scene_clip),
        [OBJECT_CHANNEL] = sizeof(struct scene_channel),
    };
    return (unsigned)kind < OBJECT_COUNT ? sizes[kind] : 0;
}

static uint64_t blob_bytes(const struct blob *blob)
{
    return blob ? blob->size_bytes : 0;
}

/* Bytes of a channel in the poses of a frame, which count too: many channels may read the same few numbers of a
 * clip, and their poses are large all the same. */
static uint64_t channel_pose_bytes(const struct scene_channel *channel)
{
    const struct channel_row *row = channel_row(channel->value.path);
    uint64_t bytes = 0;
    if (!row)
        return 0;
    switch (row->target) {
    case TARGET_NODE:
        bytes = sizeof(struct pose_node);
        break;
    case TARGET_WEIGHTS:
        bytes = sizeof(struct pose_weights) + channel->value.width * sizeof(float);
        break;
    case TARGET_LIGHT:
        bytes = sizeof(struct scene_light);
        break;
    case TARGET_MATERIAL:
        bytes = sizeof(struct scene_material);
        break;
    case TARGET_VIEW:
        break;
    }
    return bytes * MOTION_POSES_MAX;
}

uint64_t object_table_bytes(enum object_kind kind, const void *object)
{
    /* Slot of an object in the table, at the table's usual load. */
    const uint64_t slot_bytes = 32;
    uint64_t range_count = 0, weight_count = 0, pose_bytes = 0;
    if (kind == OBJECT_MESH) {
        range_count = ((const struct scene_mesh *)object)->range_count;
        weight_count = ((const struct scene_mesh *)object)->weight_count;
    } else if (kind == OBJECT_SPHERES) {
        range_count = ((const struct scene_spheres *)object)->range_count;
    } else if (kind == OBJECT_NODE) {
        weight_count = ((const struct scene_node *)object)->weight_count;
    } else if (kind == OBJECT_CHANNEL) {
        pose_bytes = channel_pose_bytes(object);
    }
    return object_struct_bytes(kind) + slot_bytes + range_count * sizeof(struct record_material_range) +
           weight_count * sizeof(float) + pose_bytes;
}

uint64_t object_bytes(enum object_kind kind, const void *object)
{
    uint64_t bytes = object_table_bytes(kind, object);
    if (kind == OBJECT_MESH) {
        const struct scene_mesh *mesh = object;
        for (int i = 0; i < MESH_ARRAY_COUNT; i++)
            bytes += blob_bytes(mesh->arrays[i]);
    } else if (kind == OBJECT_SPHERES) {
        bytes += blob_bytes(((const struct scene_spheres *)object)->centres_radii);
    } else if (kind == OBJECT_TEXTURE) {
        bytes += blob_bytes(((const struct scene_texture *)object)->texels);
    } else if (kind == OBJECT_SKIN) {
        const struct scene_skin *skin = object;
        bytes += blob_bytes(skin->joints) + blob_bytes(skin->joint_from_mesh);
    } else if (kind == OBJECT_CLIP) {
        bytes += blob_bytes(((const struct scene_clip *)object)->floats);
    }
    return bytes;
}

uint64_t environment_bytes(const struct scene_environment *environment)
{
    return blob_bytes(environment->texels);
}

static void release_mesh(struct scene_mesh *mesh)
{
    for (int i = 0; i < MESH_ARRAY_COUNT; i++) {
        blob_unref(mesh->arrays[i]);
        mesh->arrays[i] = NULL;
    }
    free(mesh->ranges);
    free(mesh->weights);
    mesh->ranges = NULL;
    mesh->weights = NULL;
    mesh->range_count = mesh->weight_count = 0;
}

void object_release(enum object_kind kind, void *object)
{
    if (kind == OBJECT_NODE) {
        struct scene_node *node = object;
        free(node->weights);
        node->weights = NULL;
        node->weight_count = 0;
    } else if (kind == OBJECT_MESH) {
        release_mesh(object);
    } else if (kind == OBJECT_SPHERES) {
        struct scene_spheres *spheres = object;
        blob_unref(spheres->centres_radii);
        free(spheres->ranges);
        spheres->centres_radii = NULL;
        spheres->ranges = NULL;
        spheres->range_count = 0;
    } else if (kind == OBJECT_TEXTURE) {
        struct scene_texture *texture = object;
        blob_unref(texture->texels);
        texture->texels = NULL;
    } else if (kind == OBJECT_SKIN) {
        struct scene_skin *skin = object;
        blob_unref(skin->joints);
        blob_unref(skin->joint_from_mesh);
        skin->joints = skin->joint_from_mesh = NULL;
    } else if (kind == OBJECT_CLIP) {
        struct scene_clip *clip = object;
        blob_unref(clip->floats);
        clip->floats = NULL;
    }
}

void scene_edit_finish(struct scene_edit *edit)
{
    if (edit->kind == EDIT_SET)
        object_release(edit->object, &edit->set);
    else if (edit->kind == EDIT_SET_ENVIRONMENT)
        blob_unref(edit->set.environment.texels);
    *edit = (struct scene_edit){.kind = EDIT_REMOVE};
}
