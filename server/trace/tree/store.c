// SPDX-License-Identifier: MIT
// Buffers of the trees: which geometries need a tree, builds, uploads, and places.
#include "trace/tree/store.h"

#include "base/clock.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#define TEXEL_BYTES (4 * sizeof(float))
#define TOP_CAPACITY_MIN 64u
#define PART_SLACK 256u
/* Limits above which the whole top tree is uploaded at once: one over this share of its elements has moved, or
 * more runs than this. A call costs as much as some thousand bytes. */
#define WRITE_WHOLE 4u
#define WRITE_RUNS_MAX 64u
#define UPLOAD_BYTES ((uint64_t)1 << 22) /* bytes at a time */

void bvh_store_init(struct bvh_store *store, struct gpu_device *device, const struct bvh_form *settings)
{
    *store = (struct bvh_store){.device = device, .settings = *settings, .top_lost = true};
}

static void unmap(struct bvh_store *store)
{
    if (!store->build.is_mapped)
        return;
    gpu_buffer_unmap(store->device, &store->elements);
    gpu_buffer_unmap(store->device, &store->primitives);
    store->build.is_mapped = false;
}

/* Drops the build, even one in progress. */
static void end_build(struct bvh_store *store)
{
    struct bvh_store_build *build = &store->build;
    bvh_jobs_stop(build->run);
    unmap(store);
    for (uint32_t i = 0; build->jobs && i < build->count; i++)
        bvh_tree_finish(&build->jobs[i].tree);
    free(build->jobs);
    free(build->which);
    *build = (struct bvh_store_build){0};
}

void bvh_store_finish(struct bvh_store *store)
{
    end_build(store);
    gpu_buffer_finish(store->device, &store->elements);
    gpu_buffer_finish(store->device, &store->primitives);
    gpu_buffer_finish(store->device, &store->boxes);
    gpu_buffer_finish(store->device, &store->roots);
    for (uint32_t i = 0; i < store->entry_count; i++)
        bvh_refit_finish(&store->entries[i].refit, store->device);
    free(store->entries);
    free(store->entry_of);
    const struct bvh_form settings = store->settings;
    bvh_store_init(store, store->device, &settings);
}

const struct bvh_entry *bvh_store_entry(const struct bvh_store *store, uint32_t geometry)
{
    uint32_t entry = geometry < store->geometry_count ? store->entry_of[geometry] : BVH_NONE;
    return entry == BVH_NONE ? NULL : &store->entries[entry];
}

uint64_t bvh_store_bytes(const struct bvh_store *store)
{
    uint64_t bytes = store->elements.capacity_bytes + store->primitives.capacity_bytes;
    bytes += store->boxes.capacity_bytes + store->roots.capacity_bytes;
    for (uint32_t i = 0; i < store->entry_count; i++)
        bytes += store->entries[i].refit.records.capacity_bytes + store->entries[i].refit.corners.capacity_bytes;
    return bytes;
}

/* ---- memory ---- */

/* Checks the capacity of texel buffers. */
static bool check_limits(const struct bvh_store *store, uint64_t elements, uint64_t texels, struct error *error)
{
    const struct gpu_facts *facts = &store->device->facts;
    uint64_t texels_max = facts->texture_buffer_texels_max;
    size_t element_texels = bvh_element_bytes(&store->settings) / TEXEL_BYTES;
    uint64_t elements_max = texels_max / element_texels;
    if (elements_max > INT32_MAX / element_texels)
        elements_max = INT32_MAX / element_texels;
    if (elements > elements_max)
        return error_set(error, ERROR_LIMIT, NULL, "the trees have %llu elements, this device holds %llu",
                         (unsigned long long)elements, (unsigned long long)elements_max);
    if (texels > texels_max || texels > INT32_MAX)
        return error_set(error, ERROR_LIMIT, NULL,
                         "the trees' primitives take %llu texels, this device holds %llu",
                         (unsigned long long)texels, (unsigned long long)texels_max);
    return true;
}

/* A run of items that is kept but moves to another place. */
struct move {
    uint64_t from, to, count;
};

/* Makes the buffer hold `items`, with the runs at their new places. It allocates new storage only where a run
 * moves or the old one is too small. */
static bool resize(struct gpu_device *device, struct gpu_buffer *buffer, size_t item_bytes, uint64_t items,
                   const struct move *moves, uint32_t move_count, struct error *error)
{
    bool must_move = items * item_bytes > buffer->capacity_bytes;
    for (uint32_t i = 0; i < move_count; i++)
        must_move = must_move || moves[i].from != moves[i].to;
    if (!must_move)
        return gpu_buffer_reserve(device, buffer, items * item_bytes, error);
    struct gpu_buffer bigger = {0};
    /* A buffer that has grown once will probably grow again. */
    size_t room = items * item_bytes, slack = buffer->capacity_bytes > 0 ? room / 2 : 0;
    if (!gpu_buffer_reserve(device, &bigger, room + slack, error) ||
        !gpu_buffer_reserve(device, &bigger, room, error)) {
        gpu_buffer_finish(device, &bigger);
        return false;
    }
    for (uint32_t i = 0; i < move_count; i++)
        if (moves[i].count > 0)
            gpu_buffer_copy(device, (struct gpu_buffer_place){buffer, moves[i].from * item_bytes},
                            (struct gpu_buffer_place){&bigger, moves[i].to * item_bytes},
                            moves[i].count * item_bytes);
    gpu_buffer_finish(device, buffer);
    *buffer = bigger;
    return true;
}

/* Packs the entries behind the top tree's space, and leaves room for `elements` and `texels` behind them. */
static bool pack(struct bvh_store *store, uint32_t top_capacity, uint64_t elements, uint64_t texels,
                 struct error *error)
{
    struct move *moves = calloc(2 * (size_t)store->entry_count + 1, sizeof(*moves));
    if (!moves)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory to arrange the trees");
    struct move *element_moves = moves, *texel_moves = moves + store->entry_count;
    uint64_t element = top_capacity, texel = 0;
    for (uint32_t i = 0; i < store->entry_count; i++) {
        struct bvh_entry *entry = &store->entries[i];
        element_moves[i] = (struct move){entry->first_element, element, entry->element_count};
        texel_moves[i] = (struct move){entry->first_texel, texel, entry->texel_count};
        element += entry->element_count;
        texel += entry->texel_count;
    }
    elements += element;
    texels += texel;
    const struct gpu_buffer before = store->elements;
    bool ok =
        check_limits(store, elements, texels, error) &&
        resize(store->device, &store->elements, bvh_element_bytes(&store->settings), elements, element_moves,
               store->entry_count, error) &&
        resize(store->device, &store->primitives, TEXEL_BYTES, texels, texel_moves, store->entry_count, error);
    for (uint32_t i = 0; ok && i < store->entry_count; i++) {
        store->entries[i].first_element = (uint32_t)element_moves[i].to;
        store->entries[i].first_texel = (uint32_t)texel_moves[i].to;
    }
    store->top_lost = store->top_lost || store->elements.name != before.name;
    store->top_capacity = top_capacity;
    free(moves);
    return ok;
}

bool bvh_store_reserve_top(struct bvh_store *store, uint32_t element_count, struct error *error)
{
    const struct bvh_form form = bvh_top_form(&store->settings);
    const size_t each_bytes = bvh_element_bytes(&store->settings);
    const uint64_t needed = (element_count * bvh_element_bytes(&form) + each_bytes - 1) / each_bytes;
    if (needed <= store->top_capacity && store->elements.name)
        return true;
    uint32_t capacity = store->top_capacity < TOP_CAPACITY_MIN ? TOP_CAPACITY_MIN : store->top_capacity;
    while (capacity < needed)
        capacity *= 2;
    return pack(store, capacity, 0, 0, error);
}

/* ---- trees ---- */

static bool entry_is_of(const struct bvh_entry *entry, const struct gpu_scene_geometry *geometry)
{
    return entry->id == geometry->id && entry->revision == geometry->revision && entry->node == geometry->node &&
           entry->is_mesh == (geometry->mesh != NULL);
}

/* Key of an entry. A deforming node shows one geometry, which no other node shows. */
static uint64_t entry_key(bool is_mesh, uint32_t id, uint32_t node)
{
    return node != 0 ? (uint64_t)node << 2 | 2 : (uint64_t)id << 2 | is_mesh;
}

static struct bvh_shape shape_of(const struct gpu_scene_geometry *geometry)
{
    struct bvh_shape shape = {0};
    if (geometry->mesh) {
        shape.positions = (const float *)(const void *)geometry->mesh->arrays[MESH_POSITIONS]->data;
        shape.indices = (const uint32_t *)(const void *)geometry->mesh->arrays[MESH_INDICES]->data;
        shape.primitive_count = geometry->mesh->value.triangle_count;
        shape.deforms = geometry->node != 0;
    } else {
        shape.centres_radii = (const float *)(const void *)geometry->spheres->centres_radii->data;
        shape.primitive_count = geometry->spheres->value.sphere_count;
    }
    return shape;
}

static void drop_unwanted(struct bvh_store *store)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < store->entry_count; i++) {
        if (store->entries[i].is_wanted)
            store->entries[kept++] = store->entries[i];
        else
            bvh_refit_finish(&store->entries[i].refit, store->device);
    }
    store->entry_count = kept;
}

/* Drops entries that the scene no longer has and lists the geometries without one. False: out of memory. */
static bool find_missing(struct bvh_store *store, const struct gpu_scene *scene, uint32_t *missing,
                         uint32_t *missing_count)
{
    struct hashmap by_key;
    hashmap_init(&by_key);
    bool ok = true;
    for (uint32_t i = 0; ok && i < store->entry_count; i++) {
        struct bvh_entry *entry = &store->entries[i];
        entry->is_wanted = false;
        ok = hashmap_put(&by_key, entry_key(entry->is_mesh, entry->id, entry->node), entry);
    }
    *missing_count = 0;
    for (uint32_t g = 0; ok && g < scene->geometry_count; g++) {
        const struct gpu_scene_geometry *geometry = &scene->geometries[g];
        if (geometry->device.primitive_count == 0)
            continue;
        struct bvh_entry *entry =
            hashmap_get(&by_key, entry_key(geometry->mesh != NULL, geometry->id, geometry->node));
        if (entry && entry_is_of(entry, geometry))
            entry->is_wanted = true;
        else
            missing[(*missing_count)++] = g;
    }
    hashmap_finish(&by_key);
    if (ok)
        drop_unwanted(store);
    return ok;
}

/* Places a tree behind the others. */
static void add_entry(struct bvh_store *store, const struct gpu_scene_geometry *geometry,
                      const struct bvh_tree *tree)
{
    uint32_t element = store->top_capacity, texel = 0;
    if (store->entry_count > 0) {
        const struct bvh_entry *last = &store->entries[store->entry_count - 1];
        element = last->first_element + last->element_count;
        texel = last->first_texel + last->texel_count;
    }
    struct bvh_entry *entry = &store->entries[store->entry_count++];
    *entry = (struct bvh_entry){.is_mesh = geometry->mesh != NULL,
                                .id = geometry->id,
                                .node = geometry->node,
                                .built_wear = tree->wear,
                                .revision = geometry->revision,
                                .is_wanted = true,
                                .first_element = element,
                                .element_count = tree->element_count,
                                .first_texel = texel,
                                .texel_count = (uint32_t)tree->primitive_texels};
    memcpy(entry->lower, tree->lower, sizeof(entry->lower));
    memcpy(entry->upper, tree->upper, sizeof(entry->upper));
    entry->grid = tree->grid;
    entry->grid_cost = tree->grid_cost;
    entry->leaf_extent = tree->leaf_extent;
}

/* Uploads the rest of an array after its first *done bytes; surplus bytes count for the next array. */
static bool upload_array(struct bvh_store *store, struct gpu_buffer *buffer, uint64_t first_byte,
                         const void *array, uint64_t bytes, uint64_t *done, uint64_t step_end_ns)
{
    while (*done < bytes) {
        uint64_t left = bytes - *done, now = left < UPLOAD_BYTES ? left : UPLOAD_BYTES;
        gpu_buffer_write(store->device, buffer, (size_t)(first_byte + *done), (const uint8_t *)array + *done,
                         (size_t)now);
        *done += now;
        if (step_is_over(step_end_ns))
            break;
    }
    return *done == bytes;
}

static bool upload_arrays(struct bvh_store *store, const struct bvh_entry *entry, const struct bvh_tree *tree,
                          uint64_t step_end_ns)
{
    uint64_t *done = &store->build.uploaded_bytes;
    const size_t each_bytes = bvh_element_bytes(&store->settings),
                 element_bytes = tree->element_count * each_bytes;
    const size_t texel_bytes = tree->primitive_texels * TEXEL_BYTES;
    if (*done < element_bytes && !upload_array(store, &store->elements, entry->first_element * each_bytes,
                                               tree->elements, element_bytes, done, step_end_ns))
        return false;
    uint64_t texels_done = *done - element_bytes;
    bool all = upload_array(store, &store->primitives, entry->first_texel * TEXEL_BYTES, tree->primitives,
                            texel_bytes, &texels_done, step_end_ns);
    *done = all ? 0 : element_bytes + texels_done;
    return all;
}

/* Uploads the next tree, as far as the step allows. */
static enum tracer_progress upload_tree(struct bvh_store *store, uint64_t step_end_ns,
                                        struct bvh_store_report *report, struct error *error)
{
    const struct bvh_store_build *build = &store->build;
    struct bvh_entry *entry = &store->entries[store->entry_count - build->count + build->uploaded];
    struct bvh_tree *tree = &build->jobs[build->uploaded].tree;
    const size_t element_bytes = tree->element_count * bvh_element_bytes(&store->settings);
    const size_t texel_bytes = tree->primitive_texels * TEXEL_BYTES;
    if (tree->elements && !upload_arrays(store, entry, tree, step_end_ns))
        return TRACER_MORE;
    report->uploaded_bytes += element_bytes + texel_bytes;
    report->built_elements += tree->element_count;
    const struct bvh_refit_plan *plan = &tree->plan;
    report->uploaded_bytes += plan->record_count * sizeof(*plan->records);
    report->uploaded_bytes += plan->triangle_count * 4 * sizeof(*plan->corners);
    /* The refit writes to parts of the buffers, and the size of writable storage is limited. */
    uint64_t part_max = store->device->facts.storage_block_bytes_max - PART_SLACK;
    if (element_bytes > part_max || texel_bytes > part_max)
        bvh_refit_plan_finish(&tree->plan);
    return tracer_progress_of(bvh_refit_init(&entry->refit, store->device, &tree->plan, error));
}

/* Begins trees over the shapes of jobs[i] for the geometries which[i]; the store owns both arrays from here on. */
static bool begin_build(struct bvh_store *store, struct bvh_job *jobs, uint32_t *which, uint32_t count,
                        struct error *error)
{
    store->build =
        (struct bvh_store_build){.jobs = jobs, .which = which, .count = count, .start_ns = clock_now_ns()};
    struct bvh_entry *entries =
        realloc(store->entries, ((size_t)store->entry_count + count + 1) * sizeof(*entries));
    if (entries) {
        store->entries = entries;
        store->build.run = bvh_jobs_start(jobs, count, &store->settings, BVH_PLAN);
    }
    if (!store->build.run)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the trees of %u geometries", count);
    return true;
}

static bool finish_run(struct bvh_store *store, struct stage_times *times, struct error *error)
{
    struct bvh_store_build *build = &store->build;
    uint64_t built_ns;
    bool ok = bvh_jobs_finish(build->run, &built_ns, error);
    build->run = NULL;
    stage_times_add(times, STAGE_BUILD, CLOCK_CPU, 0, build->start_ns, built_ns - build->start_ns);
    return ok;
}

/* Reserves memory for the planned trees. */
static bool make_entries(struct bvh_store *store, const struct gpu_scene *scene, struct error *error)
{
    const struct bvh_store_build *build = &store->build;
    uint64_t elements = 0, texels = 0;
    for (uint32_t i = 0; i < build->count; i++) {
        elements += build->jobs[i].tree.element_count;
        texels += build->jobs[i].tree.primitive_texels;
    }
    uint32_t top_capacity = store->top_capacity < TOP_CAPACITY_MIN ? TOP_CAPACITY_MIN : store->top_capacity;
    if (!pack(store, top_capacity, elements, texels, error))
        return false;
    for (uint32_t i = 0; i < build->count; i++)
        add_entry(store, &scene->geometries[build->which[i]], &build->jobs[i].tree);
    return true;
}

/* Sets the destination of each tree: buffers of software GL are host memory, so arrays of the trees' own would
 * double it. */
static bool open_arrays(struct bvh_store *store, struct error *error)
{
    struct bvh_store_build *build = &store->build;
    const struct bvh_entry *entries = &store->entries[store->entry_count - build->count];
    uint8_t *elements = NULL, *primitives = NULL;
    if (store->device->facts.shares_memory && build->count > 0) {
        elements = gpu_buffer_open(store->device, &store->elements, error);
        if (!elements)
            return false;
        primitives = gpu_buffer_open(store->device, &store->primitives, error);
        if (!primitives) {
            gpu_buffer_unmap(store->device, &store->elements);
            return false;
        }
        build->is_mapped = true;
    }
    for (uint32_t i = 0; i < build->count; i++) {
        struct bvh_job *job = &build->jobs[i];
        if (!elements && !bvh_tree_alloc(&job->tree, &store->settings))
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the trees of %u geometries",
                             build->count);
        job->elements = job->tree.elements;
        job->primitives = job->tree.primitives;
        if (!elements)
            continue;
        job->elements =
            (uint32_t *)(void *)(elements + entries[i].first_element * bvh_element_bytes(&store->settings));
        job->primitives = (float *)(void *)(primitives + entries[i].first_texel * TEXEL_BYTES);
    }
    return true;
}

static bool begin_writing(struct bvh_store *store, const struct gpu_scene *scene, struct error *error)
{
    struct bvh_store_build *build = &store->build;
    build->step = BVH_WRITE;
    if (!make_entries(store, scene, error) || !open_arrays(store, error))
        return false;
    build->start_ns = clock_now_ns();
    build->run = bvh_jobs_start(build->jobs, build->count, &store->settings, BVH_WRITE);
    return build->run ||
           error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the trees of %u geometries", build->count);
}

static enum tracer_progress upload_trees(struct bvh_store *store, uint64_t step_end_ns,
                                         struct bvh_store_report *report, struct error *error)
{
    struct bvh_store_build *build = &store->build;
    unmap(store);
    while (build->uploaded < build->count) {
        enum tracer_progress progress = upload_tree(store, step_end_ns, report, error);
        if (progress != TRACER_DONE)
            return progress;
        bvh_tree_finish(&build->jobs[build->uploaded].tree);
        build->uploaded++;
        if (step_is_over(step_end_ns))
            return TRACER_MORE;
    }
    return TRACER_DONE;
}

static enum tracer_progress continue_build(struct bvh_store *store, const struct gpu_scene *scene,
                                           uint64_t step_end_ns, struct bvh_store_report *report,
                                           struct stage_times *times, struct error *error)
{
    struct bvh_store_build *build = &store->build;
    while (build->run) {
        if (!bvh_jobs_wait(build->run, step_end_ns))
            return TRACER_MORE;
        const bool is_planned = build->step == BVH_PLAN;
        if (!finish_run(store, times, error) || (is_planned && !begin_writing(store, scene, error)))
            return TRACER_FAILED;
    }
    uint64_t start_ns = clock_now_ns();
    enum tracer_progress progress = upload_trees(store, step_end_ns, report, error);
    stage_times_add(times, STAGE_UPLOAD, CLOCK_CPU, 0, start_ns, clock_now_ns() - start_ns);
    return progress;
}

/* Finds the entry of each geometry of the scene. */
static bool index_entries(struct bvh_store *store, const struct gpu_scene *scene)
{
    struct hashmap by_key;
    hashmap_init(&by_key);
    uint32_t *entry_of = malloc(((size_t)scene->geometry_count + 1) * sizeof(*entry_of));
    bool ok = entry_of != NULL;
    for (uint32_t i = 0; ok && i < store->entry_count; i++)
        ok = hashmap_put(&by_key,
                         entry_key(store->entries[i].is_mesh, store->entries[i].id, store->entries[i].node),
                         &store->entries[i]);
    for (uint32_t g = 0; ok && g < scene->geometry_count; g++) {
        const struct gpu_scene_geometry *geometry = &scene->geometries[g];
        const struct bvh_entry *entry =
            hashmap_get(&by_key, entry_key(geometry->mesh != NULL, geometry->id, geometry->node));
        bool has_one = entry && geometry->device.primitive_count > 0;
        entry_of[g] = has_one ? (uint32_t)(entry - store->entries) : BVH_NONE;
    }
    hashmap_finish(&by_key);
    if (!ok) {
        free(entry_of);
        return false;
    }
    free(store->entry_of);
    store->entry_of = entry_of;
    store->geometry_count = scene->geometry_count;
    return true;
}

bool bvh_store_rebuild(struct bvh_store *store, const struct gpu_scene *scene, struct bvh_job *jobs,
                       uint32_t *which, uint32_t count, struct bvh_store_report *report, struct stage_times *times,
                       struct error *error)
{
    struct bvh_entry *old = malloc(((size_t)count + 1) * sizeof(*old));
    if (!old) {
        free(jobs);
        free(which);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %u trees", count);
    }
    for (uint32_t i = 0; i < count; i++) {
        struct bvh_entry *entry = &store->entries[store->entry_of[which[i]]];
        entry->is_wanted = false;
        old[i] = *entry;
    }
    drop_unwanted(store);
    bool ok = begin_build(store, jobs, which, count, error) &&
              continue_build(store, scene, STEP_WITHOUT_END, report, times, error) == TRACER_DONE;
    for (uint32_t i = 0; ok && i < count; i++) {
        struct bvh_entry *entry = &store->entries[store->entry_count - count + i];
        entry->leaf_extent = old[i].leaf_extent;
        entry->grid_cost = old[i].grid_cost;
        entry->deformed_revision = scene->geometries[which[i]].deformed_revision;
    }
    end_build(store);
    free(old);
    if (ok && !index_entries(store, scene))
        ok = error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a scene of %u geometries",
                       scene->geometry_count);
    return ok;
}

bool bvh_store_begin(struct bvh_store *store, const struct gpu_scene *scene, bool all, struct error *error)
{
    for (uint32_t i = 0; all && i < store->entry_count; i++)
        store->entries[i].deformed_revision = UINT64_MAX;
    uint32_t missing_count = 0;
    uint32_t *missing = malloc(((size_t)scene->geometry_count + 1) * sizeof(*missing));
    bool found = missing && find_missing(store, scene, missing, &missing_count);
    struct bvh_job *jobs = found ? calloc((size_t)missing_count + 1, sizeof(*jobs)) : NULL;
    if (!jobs) {
        free(missing);
        bvh_store_finish(store);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a scene of %u geometries",
                         scene->geometry_count);
    }
    for (uint32_t i = 0; i < missing_count; i++)
        jobs[i].shape = shape_of(&scene->geometries[missing[i]]);
    bool ok = begin_build(store, jobs, missing, missing_count, error);
    if (!ok)
        bvh_store_finish(store);
    return ok;
}

enum tracer_progress bvh_store_step(struct bvh_store *store, struct gpu_scene *scene, uint64_t step_end_ns,
                                    struct bvh_store_report *report, struct stage_times *times,
                                    struct error *error)
{
    enum tracer_progress progress = continue_build(store, scene, step_end_ns, report, times, error);
    if (progress == TRACER_MORE)
        return TRACER_MORE;
    end_build(store);
    bool ok = progress == TRACER_DONE;
    if (ok && !index_entries(store, scene))
        ok = error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a scene of %u geometries",
                       scene->geometry_count);
    ok = ok && bvh_store_deform(store, scene, report, times, error);
    if (!ok)
        bvh_store_finish(store);
    return tracer_progress_of(ok);
}

bool bvh_store_waits(struct bvh_store *store)
{
    return store->build.run && !bvh_jobs_wait(store->build.run, 0);
}

/* ---- top tree ---- */

/* Writes one octant's copy, in runs of adjacent elements. */
static uint64_t write_top_copy(struct bvh_store *store, const struct bvh_top *top, uint32_t octant,
                               const bool *moved)
{
    size_t each_bytes = bvh_element_words(&top->settings) * sizeof(*top->elements);
    size_t first = (size_t)octant * top->element_count;
    uint64_t bytes = 0;
    for (uint32_t begin = 0; begin < top->element_count;) {
        uint32_t end = begin;
        while (end < top->element_count && (!moved || moved[end]))
            end++;
        size_t run_bytes = (end - begin) * each_bytes;
        if (end > begin)
            gpu_buffer_write(store->device, &store->elements, (first + begin) * each_bytes,
                             (const uint8_t *)top->elements + (first + begin) * each_bytes, run_bytes);
        bytes += run_bytes;
        begin = end + (end == begin);
    }
    return bytes;
}

uint64_t bvh_store_write_top(struct bvh_store *store, const struct bvh_top *top, bool all)
{
    uint64_t bytes = 0;
    uint32_t count = top->element_count, moved_count = 0;
    for (uint32_t e = 0; !all && e < count; e++)
        moved_count += top->moved[e];
    if (all || moved_count * WRITE_WHOLE > count || moved_count > WRITE_RUNS_MAX) {
        size_t whole_bytes = count * bvh_element_bytes(&top->settings);
        if (count > 0)
            gpu_buffer_write(store->device, &store->elements, 0, top->elements, whole_bytes);
        return whole_bytes;
    }
    bool *moved = moved_count == 0 ? NULL : malloc(count);
    if (moved_count == 0)
        return 0;
    for (uint32_t octant = 0; octant < bvh_octants(&top->settings); octant++) {
        for (uint32_t e = 0; moved && e < count; e++)
            moved[top->baked.place ? top->baked.place[(size_t)octant * count + e] : e] = top->moved[e];
        bytes += write_top_copy(store, top, octant, moved); /* without memory for the marks, all elements */
    }
    free(moved);
    return bytes;
}
