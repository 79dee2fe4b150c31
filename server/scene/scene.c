/* SPDX-License-Identifier: MIT */
#include "scene/scene.h"

#include "scene/edit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

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
    if (!(material->attenuation_distance > 0.0f))
        return 0.0f;
    return -logf(fmaxf(material->attenuation[channel], least)) / material->attenuation_distance;
}

float scene_material_body_tint(const struct scene_material *material, int channel)
{
    return expf(-0.5f * material->thickness * scene_material_absorption(material, channel));
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
