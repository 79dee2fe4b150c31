/* SPDX-License-Identifier: MIT */
/* The scene's life, look-ups, and reading of its objects. */
#include "scene/scene.h"

#include "scene/edit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct scene *scene_create(const char *name, const struct scene_limits *limits)
{
    struct scene *scene = calloc(1, sizeof(*scene));
    if (!scene)
        return NULL;
    snprintf(scene->name, sizeof(scene->name), "%s", name ? name : "");
    if (limits)
        scene->limits = *limits;
    return scene;
}

void scene_destroy(struct scene *scene)
{
    if (!scene)
        return;
    for (int kind = 0; kind < OBJECT_COUNT; kind++) {
        size_t cursor = 0;
        void *object;
        while (hashmap_next(&scene->objects[kind], &cursor, NULL, &object)) {
            object_release((enum object_kind)kind, object);
            free(object);
        }
        hashmap_finish(&scene->objects[kind]);
    }
    blob_unref(scene->environment.texels);
    free(scene);
}

const struct scene_node *scene_node(const struct scene *scene, uint32_t id)
{
    return hashmap_get(&scene->objects[OBJECT_NODE], id);
}

const struct scene_mesh *scene_mesh(const struct scene *scene, uint32_t id)
{
    return hashmap_get(&scene->objects[OBJECT_MESH], id);
}

const struct scene_spheres *scene_spheres(const struct scene *scene, uint32_t id)
{
    return hashmap_get(&scene->objects[OBJECT_SPHERES], id);
}

float scene_material_absorption(const struct scene_material *material, int channel)
{
    const float least = 1e-6f; /* black would be infinite */
    if (!(material->value.attenuation_distance > 0.0f))
        return 0.0f;
    return -logf(fmaxf(material->value.attenuation_colour[channel], least)) / material->value.attenuation_distance;
}

float scene_material_body_tint(const struct scene_material *material, int channel)
{
    return expf(-0.5f * material->value.thickness * scene_material_absorption(material, channel));
}

const struct scene_material *scene_material(const struct scene *scene, uint32_t id)
{
    return hashmap_get(&scene->objects[OBJECT_MATERIAL], id);
}

const struct scene_texture *scene_texture(const struct scene *scene, uint32_t id)
{
    return hashmap_get(&scene->objects[OBJECT_TEXTURE], id);
}

const struct scene_light *scene_light(const struct scene *scene, uint32_t id)
{
    return hashmap_get(&scene->objects[OBJECT_LIGHT], id);
}

const struct scene_camera *scene_camera(const struct scene *scene, uint32_t id)
{
    return hashmap_get(&scene->objects[OBJECT_CAMERA], id);
}

const struct scene_skin *scene_skin(const struct scene *scene, uint32_t id)
{
    return hashmap_get(&scene->objects[OBJECT_SKIN], id);
}

const struct scene_clip *scene_clip(const struct scene *scene, uint32_t id)
{
    return hashmap_get(&scene->objects[OBJECT_CLIP], id);
}

/* ---- edits of present objects ------------------------------------------------------------------ */

/* Reads the environment without its image, which another client may not have: an edit leaves that unchanged. */
static void read_environment(const struct scene *scene, struct scene_edit *edit)
{
    edit->kind = EDIT_SET_ENVIRONMENT;
    edit->set.environment = scene->environment;
    edit->set.environment.texels = NULL;
    edit->set.environment.value.keeps_image = true;
}

bool scene_read_object(const struct scene *scene, enum object_kind kind, uint32_t id, struct scene_edit *edit,
                       struct error *error)
{
    const void *object = (unsigned)kind < OBJECT_COUNT ? hashmap_get(&scene->objects[kind], id) : NULL;
    *edit = (struct scene_edit){.kind = EDIT_SET, .object = kind};
    if (kind == OBJECT_ENVIRONMENT && id == 1) {
        read_environment(scene, edit);
        return true;
    }
    if (kind != OBJECT_NODE && kind != OBJECT_MATERIAL && kind != OBJECT_LIGHT && kind != OBJECT_CAMERA &&
        kind != OBJECT_ENVIRONMENT)
        return error_set(error, ERROR_UNSUPPORTED, "object_get.kind",
                         "%s objects cannot be read; nodes, materials, lights, cameras and the environment can",
                         object_kind_name(kind));
    if (!object)
        return error_set(error, ERROR_UNKNOWN_ID, "object_get.object", "there is no %s %u", object_kind_name(kind),
                         id);
    memcpy(&edit->set, object, object_struct_bytes(kind));
    struct scene_node *node = kind == OBJECT_NODE ? &edit->set.node : NULL;
    if (!node || !node->weights)
        return true;
    const float *weights = node->weights;
    node->weights = malloc(node->weight_count * sizeof(*weights));
    if (!node->weights)
        return error_set(error, ERROR_OUT_OF_MEMORY, "object_get", "no memory for an answer");
    memcpy(node->weights, weights, node->weight_count * sizeof(*weights));
    return true;
}

/* Revision of the edit's object; 0: it does not exist. */
static uint64_t revision_of(const struct scene *scene, const struct scene_edit *edit)
{
    if (edit->kind == EDIT_SET_ENVIRONMENT)
        return scene->environment.revision;
    const struct scene_object *object = hashmap_get(&scene->objects[edit->object], edit_object_id(edit));
    return object ? object->revision : 0;
}

bool scene_edits_are_current(const struct scene *scene, const struct scene_edit *edits, size_t edit_count,
                             uint64_t base_revision, struct error *error)
{
    for (size_t i = 0; i < edit_count; i++) {
        const struct edit_place place = {.index = i, .edit = &edits[i], .error = error};
        const uint64_t revision = revision_of(scene, &edits[i]);
        if (!revision && edits[i].kind != EDIT_SET_ENVIRONMENT)
            return edit_error(&place, ERROR_CONFLICT, "", "it is not there any more");
        if (revision > base_revision) {
            edit_error(&place, ERROR_CONFLICT, "", "it has been changed since revision %llu",
                       (unsigned long long)base_revision);
            error->retryable = true;
            return error_remedy(error, "read it again, and change what is there now");
        }
    }
    return true;
}
