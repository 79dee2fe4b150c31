/* SPDX-License-Identifier: MIT */
/* Statistics of the engine and its scenes, collected for one client. */
#include "engine/engine_private.h"

#include <stdlib.h>
#include <string.h>

static void describe_scene(struct engine_scene *from, uint64_t principal, struct engine_scene_stat *stat)
{
    const struct scene *scene = from->scene;
    engine_count_contents(from);
    const struct engine_reference *first = from->references;
    *stat = (struct engine_scene_stat){
        .is_known = from->principal == principal || engine_scene_is_open_to(from, principal),
        .client = first ? first->client->client : 0,
        .scene = first ? first->id : 0,
        .revision = from->known.revision,
        .host_bytes = from->known.host_bytes,
        .nodes = from->known.nodes,
        .instances = from->instances,
        .triangles = from->triangles,
        .spheres = from->spheres,
    };
    memcpy(stat->name, scene->name, sizeof(stat->name));
}

/* Visits each job once, however many scenes there are. */
static void add_device_bytes(const struct engine *engine, struct engine_stats *stats)
{
    uint32_t i = 0;
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        scene->stat = &stats->scenes[i++];
        scene->stat->device_bytes = scene_own_device_bytes(engine, scene);
    }
    for (size_t j = 0; j < engine->job_count; j++)
        engine->jobs[j]->scene->stat->device_bytes += job_device_bytes(engine, engine->jobs[j]);
}

static bool describe_scenes(const struct engine *engine, uint64_t principal, struct engine_stats *stats)
{
    size_t count = 0;
    for (const struct engine_scene *scene = engine->scenes; scene; scene = scene->next)
        count++;
    if (!count)
        return true;
    stats->scenes = calloc(count, sizeof(*stats->scenes));
    if (!stats->scenes)
        return false;
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        describe_scene(scene, principal, &stats->scenes[stats->scene_count]);
        stats->host_bytes += stats->scenes[stats->scene_count++].host_bytes;
    }
    add_device_bytes(engine, stats);
    return true;
}

struct engine_stats *engine_stats_collect(const struct engine *engine, uint64_t principal)
{
    struct engine_stats *stats = calloc(1, sizeof(*stats));
    if (!stats)
        return NULL;
    stats->device = engine->device_info;
    stats->device_bytes = engine_device_bytes(engine);
    stats->device_limit_bytes = engine->device_bytes_limit;
    stats->device_objects = engine->device ? (uint32_t)gpu_device_objects(engine->device) : 0;
    stats->frames = engine->frames;
    stats->rays = engine->rays;
    for (size_t i = 0; i < engine->job_count; i++)
        stats->jobs += !job_output_is_closed(engine->jobs[i]->output);
    for (int stage = 0; stage < STAGE_COUNT; stage++) {
        for (int clock = 0; clock < 2; clock++) {
            const struct stage_total *total = &engine->totals.by_stage[stage][clock];
            stats->stages[stage][clock].count = atomic_load(&total->count);
            stats->stages[stage][clock].total_ns = atomic_load(&total->total_ns);
            stats->stages[stage][clock].max_ns = atomic_load(&total->max_ns);
        }
    }
    if (describe_scenes(engine, principal, stats))
        return stats;
    free(stats);
    return NULL;
}
