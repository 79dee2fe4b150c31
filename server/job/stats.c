/* SPDX-License-Identifier: MIT */
#include "job/engine_private.h"

#include <stdlib.h>
#include <string.h>

static void count_contents(struct engine_scene *from)
{
    const struct scene *scene = from->scene;
    if (from->counted_revision == scene->revision)
        return;
    from->counted_revision = scene->revision;
    from->instances = 0;
    from->triangles = from->spheres = 0;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&scene->objects[SCENE_NODE], &cursor, NULL, &value)) {
        enum scene_node_kind kind = ((const struct scene_node *)value)->kind;
        from->instances += kind == NODE_MESH || kind == NODE_SPHERES;
    }
    cursor = 0;
    while (hashmap_next(&scene->objects[SCENE_MESH], &cursor, NULL, &value))
        from->triangles += ((const struct scene_mesh *)value)->triangle_count;
    cursor = 0;
    while (hashmap_next(&scene->objects[SCENE_SPHERES], &cursor, NULL, &value))
        from->spheres += ((const struct scene_spheres *)value)->sphere_count;
}

static void describe_scene(const struct engine *engine, struct engine_scene *from, struct engine_scene_stat *stat)
{
    const struct scene *scene = from->scene;
    count_contents(from);
    *stat = (struct engine_scene_stat){
        .client = from->client->client,
        .scene = from->id,
        .revision = scene->revision,
        .host_bytes = scene->host_bytes,
        .device_bytes = scene_device_bytes(engine, from),
        .nodes = (uint32_t)scene->objects[SCENE_NODE].count,
        .instances = from->instances,
        .triangles = from->triangles,
        .spheres = from->spheres,
    };
    memcpy(stat->name, scene->name, sizeof stat->name);
}

static bool describe_scenes(const struct engine *engine, struct engine_stats *stats)
{
    size_t count = 0, cursor = 0;
    void *value;
    while (hashmap_next(&engine->clients, &cursor, NULL, &value))
        count += ((const struct engine_client *)value)->scenes.count;
    if (!count)
        return true;
    stats->scenes = calloc(count, sizeof *stats->scenes);
    if (!stats->scenes)
        return false;
    cursor = 0;
    while (hashmap_next(&engine->clients, &cursor, NULL, &value)) {
        const struct engine_client *client = value;
        size_t scene_cursor = 0;
        void *scene;
        while (hashmap_next(&client->scenes, &scene_cursor, NULL, &scene)) {
            describe_scene(engine, scene, &stats->scenes[stats->scene_count]);
            stats->host_bytes += stats->scenes[stats->scene_count++].host_bytes;
        }
    }
    return true;
}

struct engine_stats *engine_stats_collect(const struct engine *engine)
{
    struct engine_stats *stats = calloc(1, sizeof *stats);
    if (!stats)
        return NULL;
    stats->device = engine->device_info;
    stats->device_bytes = engine_device_bytes(engine);
    stats->device_limit_bytes = engine->device_bytes_limit;
    stats->frames = engine->frames;
    stats->rays = engine->rays;
    for (size_t i = 0; i < engine->job_count; i++)
        stats->jobs += !job_output_is_closed(engine->jobs[i]->output);
    for (int stage = 0; stage < STAGE_COUNT; stage++) {
        for (int clock = 0; clock < 2; clock++) {
            const struct stage_total *total = &engine->totals.by_stage[stage][clock];
            stats->stages[stage][clock].count = atomic_load(&total->count);
            stats->stages[stage][clock].total_ns = atomic_load(&total->total_ns);
            stats->stages[stage][clock].greatest_ns = atomic_load(&total->greatest_ns);
        }
    }
    if (describe_scenes(engine, stats))
        return stats;
    free(stats);
    return NULL;
}
