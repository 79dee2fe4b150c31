/* SPDX-License-Identifier: MIT */
/* Descriptions of scenes for clients. */
#include "engine/engine_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The protocol's maximum. */
#define COORDINATE_MAX 3e38f
#define DURATION_MAX_S 1e9f

void engine_count_contents(struct engine_scene *from)
{
    const struct scene *scene = from->scene;
    if (from->commit || from->counted_revision == scene->revision)
        return;
    from->counted_revision = scene->revision;
    from->instances = 0;
    from->triangles = from->spheres = 0;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&scene->objects[OBJECT_NODE], &cursor, NULL, &value)) {
        enum node_kind kind = ((const struct scene_node *)value)->value.kind;
        from->instances += kind == NODE_MESH || kind == NODE_SPHERES;
    }
    cursor = 0;
    while (hashmap_next(&scene->objects[OBJECT_MESH], &cursor, NULL, &value))
        from->triangles += ((const struct scene_mesh *)value)->value.triangle_count;
    cursor = 0;
    while (hashmap_next(&scene->objects[OBJECT_SPHERES], &cursor, NULL, &value))
        from->spheres += ((const struct scene_spheres *)value)->value.sphere_count;
}

/* ---- the list ----------------------------------------------------------------------------------- */

bool engine_scene_is_open_to(const struct engine_scene *scene, uint64_t principal)
{
    return scene->sharing == SHARING_SHARED || (scene->sharing == SHARING_KEPT && scene->principal == principal);
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct engine_scene_entry *)a)->name, ((const struct engine_scene_entry *)b)->name);
}

static void fill_entry(struct engine_scene_entry *entry, struct engine_scene *scene)
{
    engine_count_contents(scene);
    *entry = (struct engine_scene_entry){
        .revision = scene->known.revision, .triangles = scene->triangles, .sharing = scene->sharing};
    memcpy(entry->name, scene->scene->name, sizeof(entry->name));
    for (const struct engine_reference *one = scene->references; one; one = one->next)
        entry->clients++;
}

void engine_scene_list(struct engine *engine, const struct engine_command *command)
{
    size_t count = 0;
    for (const struct engine_scene *scene = engine->scenes; scene; scene = scene->next)
        count++;
    struct engine_event *event = event_create(ENGINE_SCENES_LISTED, command->client, command->request);
    struct engine_scene_list *list = calloc(1, sizeof(*list) + count * sizeof(list->scenes[0]));
    if (event && !list) {
        event->kind = ENGINE_FAILED;
        error_set(&event->error, ERROR_OUT_OF_MEMORY, "scene_list", "no memory for an answer");
    }
    if (!event || !list) {
        free(list);
        engine_post(engine, event);
        return;
    }
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        if (engine_scene_is_open_to(scene, command->principal))
            fill_entry(&list->scenes[list->count++], scene);
    }
    qsort(list->scenes, list->count, sizeof(list->scenes[0]), by_name);
    event->list = list;
    engine_post(engine, event);
}

/* ---- one scene ---------------------------------------------------------------------------------- */

static int by_number(const void *a, const void *b)
{
    uint32_t left = *(const uint32_t *)a, right = *(const uint32_t *)b;
    return left < right ? -1 : left > right;
}

/* Inserts a number into the smallest ENGINE_DESCRIPTION_MAX numbers so far, which are ascending. */
static void keep_first(uint32_t numbers[ENGINE_DESCRIPTION_MAX], uint32_t *count, uint32_t number)
{
    if (*count == ENGINE_DESCRIPTION_MAX && number > numbers[*count - 1])
        return;
    uint32_t place = *count < ENGINE_DESCRIPTION_MAX ? (*count)++ : *count - 1;
    for (; place && numbers[place - 1] > number; place--)
        numbers[place] = numbers[place - 1];
    numbers[place] = number;
}

static void describe_cameras(struct engine_scene_description *description, const struct scene *scene)
{
    uint32_t nodes[ENGINE_DESCRIPTION_MAX];
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&scene->objects[OBJECT_NODE], &cursor, NULL, &value)) {
        const struct scene_node *node = value;
        if (node->value.kind == NODE_CAMERA)
            keep_first(nodes, &description->camera_count, node->base.id);
    }
    for (uint32_t i = 0; i < description->camera_count; i++) {
        const struct scene_node *node = scene_node(scene, nodes[i]);
        const struct scene_camera *camera = scene_camera(scene, node->value.object);
        struct engine_camera_entry *entry = &description->cameras[i];
        entry->node = nodes[i];
        entry->fov_y = camera ? camera->value.fov_y : 0;
        memcpy(entry->name, node->base.name[0] || !camera ? node->base.name : camera->base.name,
               sizeof(entry->name));
    }
}

static void describe_channel(struct engine_scene_description *description, const uint32_t *numbers,
                             const struct scene *scene, const struct scene_channel *channel)
{
    const uint32_t *found =
        bsearch(&channel->value.clip, numbers, description->clip_count, sizeof(*numbers), by_number);
    const struct scene_clip *clip = scene_clip(scene, channel->value.clip);
    if (!found || !clip || !clip->floats)
        return;
    const float *floats = (const float *)(const void *)clip->floats->data;
    float end_s = floats[(size_t)channel->value.first_time + channel->value.key_count - 1];
    struct engine_clip_entry *entry = &description->clips[found - numbers];
    entry->channels++;
    entry->duration_s = fminf(fmaxf(entry->duration_s, end_s), DURATION_MAX_S);
}

static void describe_clips(struct engine_scene_description *description, const struct scene *scene)
{
    uint32_t numbers[ENGINE_DESCRIPTION_MAX];
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&scene->objects[OBJECT_CLIP], &cursor, NULL, &value))
        keep_first(numbers, &description->clip_count, ((const struct scene_clip *)value)->base.id);
    for (uint32_t i = 0; i < description->clip_count; i++) {
        struct engine_clip_entry *entry = &description->clips[i];
        entry->clip = numbers[i];
        memcpy(entry->name, scene_clip(scene, numbers[i])->base.name, sizeof(entry->name));
    }
    cursor = 0;
    while (hashmap_next(&scene->objects[OBJECT_CHANNEL], &cursor, NULL, &value))
        describe_channel(description, numbers, scene, value);
}

/* Transforms may exceed the range of floats; the bounds are clamped to what the protocol allows. */
static void describe_bounds(struct engine_scene_description *description, const struct scene *scene)
{
    description->empty = !scene_bounds(scene, NULL, description->lower_world, description->upper_world);
    for (int axis = 0; axis < 3; axis++) {
        float *lower = &description->lower_world[axis], *upper = &description->upper_world[axis];
        *lower = description->empty ? 0 : fminf(fmaxf(*lower, -COORDINATE_MAX), COORDINATE_MAX);
        *upper = description->empty ? 0 : fminf(fmaxf(*upper, -COORDINATE_MAX), COORDINATE_MAX);
    }
}

/* Description of the scene, kept for its revision, as that of a large scene takes time. NULL: out of memory. */
static const struct engine_scene_description *need_description(struct engine_scene *from)
{
    const struct scene *scene = from->scene;
    if (from->description && from->description->revision == scene->revision)
        return from->description;
    free(from->description);
    from->description = calloc(1, sizeof(*from->description));
    if (!from->description)
        return NULL;
    engine_count_contents(from);
    from->description->revision = scene->revision;
    from->description->triangles = from->triangles;
    from->description->spheres = from->spheres;
    from->description->nodes = (uint32_t)scene->objects[OBJECT_NODE].count;
    describe_bounds(from->description, scene);
    describe_cameras(from->description, scene);
    describe_clips(from->description, scene);
    return from->description;
}

void engine_scene_describe(struct engine *engine, struct engine_scene *scene, const struct engine_command *command)
{
    struct engine_event *event = event_create(ENGINE_SCENE_DESCRIBED, command->client, command->request);
    const struct engine_scene_description *description = need_description(scene);
    if (event && description)
        event->description = malloc(sizeof(*description));
    if (event && event->description) {
        *event->description = *description;
    } else if (event) {
        event->kind = ENGINE_FAILED;
        error_set(&event->error, ERROR_OUT_OF_MEMORY, "scene_describe", "no memory for an answer");
    }
    engine_post(engine, event);
}
