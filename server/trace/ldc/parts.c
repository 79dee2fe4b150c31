/* SPDX-License-Identifier: MIT */
/* The static and the dynamic instances of a scene, with a record of each node's last place. */
#include "trace/ldc/parts.h"

#include "trace/ldc/build.h"

#include <stdlib.h>
#include <string.h>

/* Records of removed nodes are dropped when they outnumber both the existing nodes and this number. */
#define RECORDS_KEPT 1024

/* State of a node at earlier updates. */
struct ldc_record {
    struct ldc_member last; /* at the last update that had it; the geometry's deformed_revision does not matter */
    uint64_t seen, moved;   /* numbers of updates; moved 0: never */
};

static void part_finish(struct ldc_part *part)
{
    free(part->instances);
    free(part->members);
    *part = (struct ldc_part){0};
}

void ldc_parts_finish(struct ldc_parts *parts)
{
    for (int i = 0; i < LDC_CUBES_MAX; i++)
        part_finish(&parts->parts[i]);
    free(parts->records);
    hashmap_finish(&parts->record_by_node);
    *parts = (struct ldc_parts){0};
}

static struct ldc_member member_of(const struct gpu_scene *scene, const struct instance *instance)
{
    const struct gpu_scene_geometry *geometry = &scene->geometries[instance->geometry];
    struct ldc_member member = {
        .revision = geometry->revision,
        .deformed_revision = geometry->deformed_revision,
        .geometry = geometry->id,
        .deforming_node = geometry->node,
        .is_mesh = geometry->mesh != NULL,
        .node = instance->node,
    };
    memcpy(member.world_from_object, instance->world_from_object, sizeof(member.world_from_object));
    return member;
}

static bool same_place_and_shape(const struct ldc_member *a, const struct ldc_member *b)
{
    return a->revision == b->revision && a->geometry == b->geometry && a->is_mesh == b->is_mesh &&
           memcmp(a->world_from_object, b->world_from_object, sizeof(a->world_from_object)) == 0;
}

/* ---- records ---- */

static bool index_record(struct ldc_parts *parts, uint32_t index)
{
    return hashmap_put(&parts->record_by_node, parts->records[index].last.node, (void *)((uintptr_t)index + 1));
}

static struct ldc_record *find_record(const struct ldc_parts *parts, uint32_t node)
{
    uintptr_t found = (uintptr_t)hashmap_get(&parts->record_by_node, node);
    return found ? &parts->records[found - 1] : NULL;
}

static struct ldc_record *add_record(struct ldc_parts *parts, const struct ldc_member *member)
{
    if (parts->record_count == parts->record_capacity) {
        uint32_t capacity = parts->record_capacity ? 2 * parts->record_capacity : 64;
        struct ldc_record *larger = realloc(parts->records, capacity * sizeof(*larger));
        if (!larger)
            return NULL;
        parts->records = larger;
        parts->record_capacity = capacity;
    }
    uint32_t index = parts->record_count;
    parts->records[index] = (struct ldc_record){.last = *member};
    if (!index_record(parts, index))
        return NULL;
    return &parts->records[parts->record_count++];
}

/* Drops records of nodes that the last update lacked, and marks what did not move in it as static. */
static bool settle(struct ldc_parts *parts)
{
    uint32_t kept = 0;
    hashmap_finish(&parts->record_by_node);
    hashmap_init(&parts->record_by_node);
    for (uint32_t i = 0; i < parts->record_count; i++) {
        struct ldc_record *record = &parts->records[i];
        if (record->seen != parts->updates)
            continue;
        if (record->moved != parts->updates)
            record->moved = 0;
        parts->records[kept] = *record;
        if (!index_record(parts, kept++))
            return false;
    }
    parts->record_count = kept;
    return true;
}

/* Records what an instance is now. False: no memory. */
static bool note(struct ldc_parts *parts, const struct ldc_member *member, bool *moves)
{
    struct ldc_record *record = find_record(parts, member->node);
    if (!record) {
        record = add_record(parts, member);
        if (!record)
            return false;
    } else if (record->seen != parts->updates - 1 || !same_place_and_shape(&record->last, member)) {
        record->moved = parts->updates;
    }
    record->last = *member;
    record->seen = parts->updates;
    *moves = record->moved != 0;
    return true;
}

/* ---- parts ---- */

static bool part_reserve(struct ldc_part *part, uint32_t count)
{
    part->instances = malloc(((size_t)count + 1) * sizeof(*part->instances));
    part->members = malloc(((size_t)count + 1) * sizeof(*part->members));
    return part->instances && part->members;
}

static void part_add(struct ldc_part *part, uint32_t instance, const struct ldc_member *member)
{
    part->instances[part->count] = instance;
    part->members[part->count++] = *member;
}

/* Assigns instances to parts. Instances of empty geometries belong to none. */
static bool assign_instances(struct ldc_parts *parts, struct ldc_part fresh[LDC_CUBES_MAX],
                             const struct gpu_scene *scene)
{
    for (int i = 0; i < LDC_CUBES_MAX; i++)
        if (!part_reserve(&fresh[i], scene->instance_count))
            return false;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct instance *instance = &scene->instances[i];
        const struct gpu_scene_geometry *geometry = &scene->geometries[instance->geometry];
        const struct ldc_member member = member_of(scene, instance);
        bool moves;
        if (!note(parts, &member, &moves))
            return false;
        if (geometry->device.primitive_count == 0)
            continue;
        bool dynamic = moves || geometry->node != 0;
        part_add(&fresh[dynamic ? LDC_CUBE_DYNAMIC : LDC_CUBE_STATIC], i, &member);
    }
    return true;
}

static bool same_part(const struct ldc_part *a, const struct ldc_part *b)
{
    return a->count == b->count && memcmp(&a->box, &b->box, sizeof(a->box)) == 0 &&
           (a->count == 0 || memcmp(a->members, b->members, a->count * sizeof(*a->members)) == 0);
}

/* Whether both have the same bodies, wherever they are: a body that has only moved is not counted again. */
static bool same_bodies(const struct ldc_part *a, const struct ldc_part *b)
{
    bool same = a->count == b->count;
    for (uint32_t i = 0; same && i < a->count; i++)
        same = a->members[i].revision == b->members[i].revision && a->members[i].node == b->members[i].node;
    return same;
}

/* Places a part's cube, after its layers are counted. */
static bool place_part(struct ldc_part *fresh, const struct ldc_part *before, const struct gpu_scene *scene,
                       const struct ldc_parts_settings *settings, struct error *error)
{
    const uint32_t *instances = fresh->instances, count = fresh->count;
    const bool is_counted = before->resolution > 0 && same_bodies(before, fresh);
    uint32_t resolution = is_counted ? before->resolution : axes_greatest_resolution(&settings->request);
    if (!axes_box_place(&fresh->box, scene, instances, count, resolution, error))
        return false;
    if (count > 0 && !is_counted) {
        const struct axes_box whole = axes_box_whole(&fresh->box, resolution);
        const struct axes_layers layers = axes_count_layers(scene, instances, count, settings->overlap, 0, &whole);
        resolution = axes_choose_resolution(settings->tracer, layers.mean, &settings->request);
        if (!axes_fit_depth(settings->tracer, layers.greatest, LDC_LISTED_LAYERS_MAX, error) ||
            !axes_fit_resolution(settings->tracer, layers.mean, &resolution, error) ||
            !axes_box_place(&fresh->box, scene, instances, count, resolution, error))
            return false;
    }
    fresh->resolution = count > 0 ? resolution : 0;
    return true;
}

bool ldc_parts_update(struct ldc_parts *parts, const struct gpu_scene *scene,
                      const struct ldc_parts_settings *settings, bool geometry_changed, bool stale[LDC_CUBES_MAX],
                      struct error *error)
{
    struct ldc_part fresh[LDC_CUBES_MAX] = {0};
    bool crowded = parts->record_count > RECORDS_KEPT && parts->record_count / 2 > scene->instance_count;
    bool ok = (!geometry_changed && !crowded) || settle(parts);
    parts->updates++;
    if (!(ok && assign_instances(parts, fresh, scene)))
        ok = error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the parts of a scene of %u instances",
                       scene->instance_count);
    for (int i = 0; i < LDC_CUBES_MAX; i++) {
        ok = ok && place_part(&fresh[i], &parts->parts[i], scene, settings, error);
        stale[i] = !same_part(&parts->parts[i], &fresh[i]);
        part_finish(&parts->parts[i]);
        parts->parts[i] = fresh[i];
    }
    return ok;
}
