// SPDX-License-Identifier: MIT
// Trees over a scene: updates of geometries, then of the top tree and its transforms.
#include "trace/tree/tree.h"

#include "base/clock.h"
#include "base/parallel.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BUILD_THREADS_MAX 8
/* Maximum of the factor by which a grid may enlarge boxes: above it the additional steps cost more than smaller
 * elements save. */
#define GRID_COST_MAX 1.3f

static unsigned build_threads(void)
{
    unsigned processors = parallel_processors();
    return processors > BUILD_THREADS_MAX ? BUILD_THREADS_MAX : processors;
}

void scene_tree_init(struct scene_tree *tree, struct gpu_device *device, const struct bvh_form *form,
                     struct tracer_stats *stats)
{
    struct bvh_form whole_form = *form;
    whole_form.threads = build_threads();
    *tree = (struct scene_tree){.stats = stats};
    bvh_store_init(&tree->store, device, &whole_form);
}

static void drop_all(struct scene_tree *tree)
{
    bvh_store_finish(&tree->store);
    bvh_top_finish(&tree->top);
    gpu_buffer_finish(tree->store.device, &tree->transform_buffer);
    free(tree->transforms);
    tree->transforms = NULL;
    tree->transform_count = 0;
}

void scene_tree_finish(struct scene_tree *tree)
{
    drop_all(tree);
    tree->phase = SCENE_TREE_IDLE;
}

/* ---- instances ---- */

/* The tree's box in world space, padded for the rounding of the ray's transform to object space: a few units in
 * the last place of all that is summed. It is infinite where the sum overflows, which is a valid bound. */
static struct bvh_world_box box_at_pose(const struct bvh_entry *entry, const float *world_from_object)
{
    struct bvh_world_box box;
    for (int row = 0; row < 3; row++) {
        const float *m = world_from_object + 4 * row;
        float low = m[3], high = m[3], size = fabsf(m[3]);
        for (int i = 0; i < 3; i++) {
            float a = m[i] * entry->lower[i], b = m[i] * entry->upper[i];
            low += fminf(a, b);
            high += fmaxf(a, b);
            size += fmaxf(fabsf(a), fabsf(b));
        }
        box.lower[row] = fmaxf(low - 8 * BVH_PAD_RELATIVE * size, -FLT_MAX);
        box.upper[row] = fminf(high + 8 * BVH_PAD_RELATIVE * size, FLT_MAX);
        if (!(box.lower[row] <= box.upper[row])) {
            box.lower[row] = -FLT_MAX;
            box.upper[row] = FLT_MAX;
        }
    }
    return box;
}

/* Bounds an instance while the shutter is open: between two poses each point moves straight from one to the
 * other. */
static struct bvh_world_box world_box(const struct bvh_entry *entry, const struct gpu_scene *scene,
                                      const struct instance *instance)
{
    uint32_t pose_count;
    const float(*poses)[12] = gpu_scene_poses(scene, instance, &pose_count);
    struct bvh_world_box box = box_at_pose(entry, poses[0]);
    for (uint32_t p = 1; p < pose_count; p++) {
        const struct bvh_world_box other = box_at_pose(entry, poses[p]);
        bvh_world_box_include(&box, &other);
    }
    return box;
}

/* The largest coordinate by magnitude. */
static float extent_of(const struct bvh_entry *entry, int axis)
{
    return fmaxf(fabsf(entry->lower[axis]), fabsf(entry->upper[axis]));
}

/* Makes the transform of instance i. The box is empty if its geometry has no primitives. */
static struct bvh_transform describe(const struct scene_tree *tree, const struct gpu_scene *scene, uint32_t i,
                                     struct bvh_world_box *box)
{
    struct instance *instance = &scene->instances[i];
    const struct bvh_entry *entry = bvh_store_entry(&tree->store, instance->geometry);
    struct bvh_transform transform = {0};
    memcpy(transform.object_from_world, instance->object_from_world, sizeof(transform.object_from_world));
    *box = (struct bvh_world_box){{1, 1, 1}, {-1, -1, -1}};
    if (!entry || !(entry->lower[0] <= entry->upper[0]))
        return transform;
    transform.first_element = entry->first_element;
    transform.element_count = entry->element_count;
    transform.first_texel = entry->first_texel;
    transform.first_primitive = scene->geometries[instance->geometry].device.first_primitive;
    transform.grid_lower_x = entry->grid.lower[0];
    transform.grid_lower_y = entry->grid.lower[1];
    transform.grid_lower_z = entry->grid.lower[2];
    memcpy(transform.cells_per_unit, entry->grid.cells_per_unit, sizeof(entry->grid.cells_per_unit));
    if (tree->store.settings.wide) {
        transform.element_count = entry->is_mesh ? BVH_LEAF_TRIANGLES : BVH_LEAF_SPHERES;
        transform.grid_lower_x = extent_of(entry, 0);
        transform.grid_lower_y = extent_of(entry, 1);
        transform.grid_lower_z = extent_of(entry, 2);
    }
    if (scene->geometries[instance->geometry].device.close_offset)
        transform.close_texels = entry->texel_count / 2;
    *box = world_box(entry, scene, instance);
    return transform;
}

static float scale_of(vec4 m[3])
{
    float determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                        m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                        m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    return cbrtf(fabsf(determinant));
}

static void survey_leaves(struct scene_tree *tree, const struct gpu_scene *scene)
{
    double sum = 0, count = 0;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        struct instance *instance = &scene->instances[i];
        const struct bvh_entry *entry = bvh_store_entry(&tree->store, instance->geometry);
        if (!entry)
            continue;
        sum += (double)(entry->leaf_extent * scale_of(instance->world_from_object)) * entry->element_count;
        count += entry->element_count;
    }
    tree->leaf_extent_world = count > 0 ? (float)(sum / count) : 0;
}

/* Builds a new top tree and all transforms. */
static bool rebuild_top(struct scene_tree *tree, const struct gpu_scene *scene, struct error *error)
{
    uint32_t count = scene->instance_count;
    struct bvh_world_box *boxes = malloc(((size_t)count + 1) * sizeof(*boxes));
    struct bvh_transform *transforms = malloc(((size_t)count + 1) * sizeof(*transforms));
    bool ok = boxes && transforms;
    for (uint32_t i = 0; ok && i < count; i++)
        transforms[i] = describe(tree, scene, i, &boxes[i]);
    bvh_top_finish(&tree->top);
    const struct bvh_form form = bvh_top_form(&tree->store.settings);
    ok = ok && bvh_top_build(&tree->top, boxes, count, &form);
    free(boxes);
    if (!ok) {
        free(transforms);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tree over %u instances", count);
    }
    free(tree->transforms);
    tree->transforms = transforms;
    tree->transform_count = count;
    tree->stats->nodes_rebuilt += tree->top.element_count;
    return true;
}

/* Writes the changed transforms and moves their elements. False: the top tree must be built again. */
static bool refit_top(struct scene_tree *tree, const struct gpu_scene *scene)
{
    uint32_t first = scene->instance_count, end = 0; /* range of transforms that changed */
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        struct bvh_world_box box;
        const struct bvh_transform transform = describe(tree, scene, i, &box);
        struct bvh_transform *old = &tree->transforms[i];
        if (!bvh_top_move(&tree->top, i, &box))
            return false;
        if (memcmp(old, &transform, sizeof(transform)) == 0)
            continue;
        *old = transform;
        first = i < first ? i : first;
        end = i + 1;
    }
    if (first < end) {
        size_t bytes = (end - first) * sizeof(*tree->transforms);
        gpu_buffer_write(tree->store.device, &tree->transform_buffer, first * sizeof(*tree->transforms),
                         &tree->transforms[first], bytes);
        tree->stats->uploaded_bytes += bytes;
    }
    tree->stats->nodes_refitted += bvh_top_refit(&tree->top);
    return !bvh_top_is_stale(&tree->top);
}

static bool upload_top(struct scene_tree *tree, bool rebuilt, struct error *error)
{
    struct bvh_store *store = &tree->store;
    struct tracer_stats *stats = tree->stats;
    size_t transform_bytes = tree->transform_count * sizeof(*tree->transforms);
    if (rebuilt) {
        if (!gpu_buffer_upload(store->device, &tree->transform_buffer, tree->transforms, transform_bytes, error))
            return false;
        stats->uploaded_bytes += transform_bytes;
    }
    stats->uploaded_bytes += bvh_store_write_top(store, &tree->top, rebuilt || store->top_lost);
    bvh_top_settle(&tree->top);
    store->top_lost = false;
    return true;
}

static bool update_instances(struct scene_tree *tree, const struct gpu_scene *scene, struct stage_times *times,
                             struct error *error)
{
    uint64_t start_ns = clock_now_ns();
    /* The reservation comes first, as it may move the trees that the transforms point to. A tree of n leaves
     * has at most 2 n - 1 elements. */
    uint64_t top_max = 2 * (uint64_t)scene->instance_count;
    if (top_max > BVH_LEAF_FIRST_MASK)
        return error_set(error, ERROR_LIMIT, NULL, "%u instances are too many", scene->instance_count);
    if (!bvh_store_reserve_top(&tree->store, (uint32_t)top_max, error))
        return false;
    bool refitted = tree->transforms && tree->transform_count == scene->instance_count && refit_top(tree, scene);
    if (!refitted && !rebuild_top(tree, scene, error))
        return false;
    survey_leaves(tree, scene);
    uint64_t built_ns = clock_now_ns();
    stage_times_add(times, STAGE_BUILD, CLOCK_CPU, 0, start_ns, built_ns - start_ns);
    bool ok = upload_top(tree, !refitted, error);
    stage_times_add(times, STAGE_UPLOAD, CLOCK_CPU, 0, built_ns, clock_now_ns() - built_ns);
    return ok;
}

static uint64_t node_count(const struct scene_tree *tree)
{
    uint64_t nodes = tree->top.element_count;
    for (uint32_t i = 0; i < tree->store.entry_count; i++)
        nodes += tree->store.entries[i].element_count;
    return nodes;
}

/* Whether a tree has detail finer than its grid, a statue in a landscape, say. */
static bool has_coarse_grid(const struct scene_tree *tree)
{
    for (uint32_t i = 0; i < tree->store.entry_count; i++)
        if (tree->store.entries[i].grid_cost > GRID_COST_MAX)
            return true;
    return false;
}

/* Runs a step of the update of geometries. All trees of a scene have the same form, whatever its history: if
 * another form is needed, all are rebuilt, with or without boxes in floats. */
static enum tracer_progress update_geometries(struct scene_tree *tree, struct gpu_scene *scene,
                                              struct stage_times *times, struct error *error)
{
    struct tracer_stats *stats = tree->stats;
    struct bvh_store_report report = {0};
    enum tracer_progress progress = bvh_store_step(&tree->store, scene, tree->step_end_ns, &report, times, error);
    stats->uploaded_bytes += report.uploaded_bytes;
    stats->nodes_rebuilt += report.built_elements;
    stats->nodes_refitted += report.refitted_elements;
    if (progress != TRACER_DONE || tree->store.settings.whole == has_coarse_grid(tree))
        return progress;
    drop_all(tree);
    tree->store.settings.whole = !tree->store.settings.whole;
    return bvh_store_begin(&tree->store, scene, true, error) ? TRACER_MORE : TRACER_FAILED;
}

static enum tracer_progress update_step(struct scene_tree *tree, struct gpu_scene *scene,
                                        struct stage_times *times, struct error *error)
{
    enum tracer_progress progress = TRACER_MORE;
    while (tree->phase == SCENE_TREE_TREES && progress == TRACER_MORE) {
        progress = update_geometries(tree, scene, times, error);
        if (progress == TRACER_DONE)
            tree->phase = SCENE_TREE_TOP;
        if (progress == TRACER_FAILED || step_is_over(tree->step_end_ns))
            return progress == TRACER_FAILED ? TRACER_FAILED : TRACER_MORE;
    }
    return tracer_progress_of(update_instances(tree, scene, times, error));
}

static bool begin_update(struct scene_tree *tree, const struct gpu_scene *scene, unsigned changed,
                         struct error *error)
{
    bool trees = changed & (CHANGED_GEOMETRY | CHANGED_DEFORMED);
    tree->phase = trees ? SCENE_TREE_TREES : SCENE_TREE_TOP;
    return !trees || bvh_store_begin(&tree->store, scene, changed & CHANGED_GEOMETRY, error);
}

enum tracer_progress scene_tree_update(struct scene_tree *tree, struct gpu_scene *scene,
                                       const struct tracer_update *update, uint64_t step_end_ns,
                                       struct error *error)
{
    enum tracer_progress progress = TRACER_MORE;
    tree->step_end_ns = step_end_ns;
    if (tree->phase == SCENE_TREE_IDLE && !begin_update(tree, scene, update->changed, error))
        progress = TRACER_FAILED;
    if (progress == TRACER_MORE)
        progress = update_step(tree, scene, update->times, error);
    if (progress == TRACER_FAILED)
        scene_tree_finish(tree);
    if (progress != TRACER_MORE)
        tree->phase = SCENE_TREE_IDLE;
    tree->stats->nodes = node_count(tree);
    return progress;
}

bool scene_tree_waits(struct scene_tree *tree)
{
    return bvh_store_waits(&tree->store);
}

void scene_tree_report(const struct scene_tree *tree, struct structure_rows *rows)
{
    structure_number(rows, "nodes", tree->stats->nodes);
    structure_number(rows, "nodes_rebuilt", tree->stats->nodes_rebuilt);
    structure_number(rows, "nodes_refitted", tree->stats->nodes_refitted);
}

uint64_t scene_tree_bytes(const struct scene_tree *tree)
{
    return bvh_store_bytes(&tree->store) + tree->transform_buffer.capacity_bytes;
}

uint32_t scene_tree_only_instance(const struct scene_tree *tree)
{
    return tree->top.element_count == 1 ? tree->top.leaves[0] & BVH_LEAF_FIRST_MASK : BVH_NONE;
}

void scene_tree_bind(struct scene_tree *tree)
{
    struct bvh_store *store = &tree->store;
    gpu_buffer_bind_texels(store->device, &store->elements, UNIT_TRACER_0, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &tree->transform_buffer, UNIT_TRACER_1, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &store->primitives, UNIT_TRACER_2, GL_RGBA32UI);
}
