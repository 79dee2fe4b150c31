// SPDX-License-Identifier: MIT
#include "trace/bvh/tracer.h"

#include "base/clock.h"
#include "base/parallel.h"
#include "gpu/program.h"
#include "shared/bindings.h"
#include "trace/program.h"

#include <epoxy/gl.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BUILD_THREADS_MAX 8
/* A grid that enlarges boxes by this factor costs more steps than its smaller elements save. */
#define GRID_COST_MAX 1.3f
/* Fills any GPU; more at once only nears the time after which a driver ends a dispatch. */
#define DISPATCH_RAYS_MAX (1u << 18)
/* Elements that a GPU visits in a dispatch, at most: a second's work of a slow one. A ray of a large scene needs
 * some hundred; it has enough of them to be finished in one dispatch, unless the scene is made to keep it. */
#define DISPATCH_ELEMENTS_MAX (1u << 31)
#define RAY_ELEMENTS_MAX (1u << 16)

static unsigned build_threads(void)
{
    unsigned processors = parallel_processors();
    return processors > BUILD_THREADS_MAX ? BUILD_THREADS_MAX : processors;
}

static struct bvh_form settings_of(const struct gpu_device *device, const struct tracer_options *options)
{
    bool plain = options->bench.bvh_layout == BVH_LAYOUT_PLAIN;
    /* Boxes are twice as fast as spheres (bench_bvh), so `auto` is boxes. */
    bool spheres = plain || options->bvh.bounds == BVH_BOUNDS_SPHERE;
    return (struct bvh_form){
        .bounds = spheres ? BVH_BOUNDS_SPHERE : BVH_BOUNDS_BOX,
        .plain = plain,
        .refit_by_height = !device->facts.software,
        .threads = build_threads(),
    };
}

static struct tracer *bvh_create(struct gpu_device *device, const struct tracer_options *options,
                                 struct error *error)
{
    struct bvh *bvh = calloc(1, sizeof(*bvh));
    if (!bvh) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer");
        return NULL;
    }
    struct bvh_form settings = settings_of(device, options);
    bvh_store_init(&bvh->store, device, &settings);
    return &bvh->base;
}

static void bvh_reset(struct bvh *bvh)
{
    bvh_store_finish(&bvh->store);
    bvh_top_finish(&bvh->top);
    gpu_buffer_finish(bvh->store.device, &bvh->transform_buffer);
    gpu_buffer_finish(bvh->store.device, &bvh->coherence);
    gpu_buffer_finish(bvh->store.device, &bvh->places);
    gpu_buffer_finish(bvh->store.device, &bvh->depths);
    gpu_buffer_finish(bvh->store.device, &bvh->unfinished);
    free(bvh->transforms);
    bvh->transforms = NULL;
    bvh->transform_count = 0;
}

static void bvh_destroy(struct tracer *tracer)
{
    struct bvh *bvh = (struct bvh *)tracer;
    bvh_reset(bvh);
    free(bvh);
}

/* ---- instances ---- */

/* The tree's box in world space, padded for the rounding of the ray's transform to object space: a few units in
 * the last place of all that is summed. Infinite where the sum overflows, which is right. */
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

/* Wherever it goes while the shutter is open: between two poses each point goes straight from one to the other. */
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

/* The current instance i. The box is empty if its geometry has no primitives. */
static struct bvh_transform describe(const struct bvh *bvh, const struct gpu_scene *scene, uint32_t i,
                                     struct bvh_world_box *box)
{
    struct instance *instance = &scene->instances[i];
    const struct bvh_entry *entry = bvh_store_entry(&bvh->store, instance->geometry);
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

static void survey_leaves(struct bvh *bvh, const struct gpu_scene *scene)
{
    double sum = 0, count = 0;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        struct instance *instance = &scene->instances[i];
        const struct bvh_entry *entry = bvh_store_entry(&bvh->store, instance->geometry);
        if (!entry)
            continue;
        sum += (double)(entry->leaf_extent * scale_of(instance->world_from_object)) * entry->element_count;
        count += entry->element_count;
    }
    bvh->leaf_extent_world = count > 0 ? (float)(sum / count) : 0;
}

/* A new top tree and all transforms. */
static bool rebuild_top(struct bvh *bvh, const struct gpu_scene *scene, struct error *error)
{
    uint32_t count = scene->instance_count;
    struct bvh_world_box *boxes = malloc(((size_t)count + 1) * sizeof(*boxes));
    struct bvh_transform *transforms = malloc(((size_t)count + 1) * sizeof(*transforms));
    bool ok = boxes && transforms;
    for (uint32_t i = 0; ok && i < count; i++)
        transforms[i] = describe(bvh, scene, i, &boxes[i]);
    bvh_top_finish(&bvh->top);
    ok = ok && bvh_top_build(&bvh->top, boxes, count, &bvh->store.settings);
    free(boxes);
    if (!ok) {
        free(transforms);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tree over %u instances", count);
    }
    free(bvh->transforms);
    bvh->transforms = transforms;
    bvh->transform_count = count;
    bvh->base.stats.nodes_rebuilt += bvh->top.element_count;
    return true;
}

/* Writes the changed transforms and moves their elements. False: the top tree must be built again. */
static bool refit_top(struct bvh *bvh, const struct gpu_scene *scene)
{
    uint32_t first = scene->instance_count, end = 0; /* of the transforms that changed */
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        struct bvh_world_box box;
        const struct bvh_transform transform = describe(bvh, scene, i, &box);
        struct bvh_transform *old = &bvh->transforms[i];
        if (!bvh_top_move(&bvh->top, i, &box))
            return false;
        if (memcmp(old, &transform, sizeof(transform)) == 0)
            continue;
        *old = transform;
        first = i < first ? i : first;
        end = i + 1;
    }
    if (first < end) {
        size_t bytes = (end - first) * sizeof(*bvh->transforms);
        gpu_buffer_write(bvh->store.device, &bvh->transform_buffer, first * sizeof(*bvh->transforms),
                         &bvh->transforms[first], bytes);
        bvh->base.stats.uploaded_bytes += bytes;
    }
    bvh->base.stats.nodes_refitted += bvh_top_refit(&bvh->top);
    return !bvh_top_is_stale(&bvh->top);
}

static bool upload_top(struct bvh *bvh, bool rebuilt, struct error *error)
{
    struct bvh_store *store = &bvh->store;
    struct tracer_stats *stats = &bvh->base.stats;
    size_t transform_bytes = bvh->transform_count * sizeof(*bvh->transforms);
    if (rebuilt) {
        if (!gpu_buffer_upload(store->device, &bvh->transform_buffer, bvh->transforms, transform_bytes, error))
            return false;
        stats->uploaded_bytes += transform_bytes;
    }
    stats->uploaded_bytes += bvh_store_write_top(store, &bvh->top, rebuilt || store->top_lost);
    bvh_top_settle(&bvh->top);
    store->top_lost = false;
    return true;
}

static bool update_instances(struct bvh *bvh, const struct gpu_scene *scene, struct stage_times *times,
                             struct error *error)
{
    uint64_t start_ns = clock_now_ns();
    /* First, since it may move the trees that the transforms point to. A tree of n leaves has at most 2 n - 1. */
    uint64_t top_max = 2 * (uint64_t)scene->instance_count;
    if (top_max > BVH_LEAF_FIRST_MASK)
        return error_set(error, ERROR_LIMIT, NULL, "%u instances are too many", scene->instance_count);
    if (!bvh_store_reserve_top(&bvh->store, (uint32_t)top_max, error) ||
        !gpu_buffer_reserve(bvh->store.device, &bvh->coherence, BVH_COHERENCE_BYTES, error))
        return false;
    bool refitted = bvh->transforms && bvh->transform_count == scene->instance_count && refit_top(bvh, scene);
    if (!refitted && !rebuild_top(bvh, scene, error))
        return false;
    survey_leaves(bvh, scene);
    uint64_t built_ns = clock_now_ns();
    stage_times_add(times, STAGE_BUILD, CLOCK_CPU, 0, start_ns, built_ns - start_ns);
    bool ok = upload_top(bvh, !refitted, error);
    stage_times_add(times, STAGE_UPLOAD, CLOCK_CPU, 0, built_ns, clock_now_ns() - built_ns);
    return ok;
}

static uint64_t node_count(const struct bvh *bvh)
{
    uint64_t nodes = bvh->top.element_count;
    for (uint32_t i = 0; i < bvh->store.entry_count; i++)
        nodes += bvh->store.entries[i].element_count;
    return nodes;
}

/* A tree with more detail than its grid can tell apart, a statue in a landscape, say. */
static bool has_coarse_grid(const struct bvh *bvh)
{
    for (uint32_t i = 0; i < bvh->store.entry_count; i++)
        if (bvh->store.entries[i].grid_cost > GRID_COST_MAX)
            return true;
    return false;
}

/* One step of it. All trees of a scene have one form, whatever its history: if another form is needed, all are
 * built again, with or without boxes in floats. */
static enum tracer_progress update_geometries(struct bvh *bvh, struct gpu_scene *scene, struct stage_times *times,
                                              struct error *error)
{
    struct tracer_stats *stats = &bvh->base.stats;
    struct bvh_store_report report = {0};
    enum tracer_progress progress =
        bvh_store_step(&bvh->store, scene, bvh->base.step_end_ns, &report, times, error);
    stats->uploaded_bytes += report.uploaded_bytes;
    stats->nodes_rebuilt += report.built_elements;
    stats->nodes_refitted += report.refitted_elements;
    if (progress != TRACER_DONE || bvh->store.settings.whole == has_coarse_grid(bvh))
        return progress;
    bvh_reset(bvh);
    bvh->store.settings.whole = !bvh->store.settings.whole;
    return bvh_store_begin(&bvh->store, scene, true, error) ? TRACER_MORE : TRACER_FAILED;
}

static enum tracer_progress go_on(struct bvh *bvh, struct gpu_scene *scene, struct stage_times *times,
                                  struct error *error)
{
    enum tracer_progress progress = TRACER_MORE;
    while (bvh->phase == BVH_TREES && progress == TRACER_MORE) {
        progress = update_geometries(bvh, scene, times, error);
        if (progress == TRACER_DONE)
            bvh->phase = BVH_TOP;
        if (progress == TRACER_FAILED || step_is_over(bvh->base.step_end_ns))
            return progress == TRACER_FAILED ? TRACER_FAILED : TRACER_MORE;
    }
    return tracer_progress_of(update_instances(bvh, scene, times, error));
}

static bool begin_update(struct bvh *bvh, const struct gpu_scene *scene, unsigned changed, struct error *error)
{
    bool trees = changed & (CHANGED_GEOMETRY | CHANGED_DEFORMED);
    bvh->phase = trees ? BVH_TREES : BVH_TOP;
    return !trees || bvh_store_begin(&bvh->store, scene, changed & CHANGED_GEOMETRY, error);
}

static void fill_stats(struct bvh *bvh)
{
    bvh->base.stats.nodes = node_count(bvh);
    bvh->base.stats.device_bytes = bvh_store_bytes(&bvh->store) + bvh->transform_buffer.capacity_bytes +
                                   bvh->coherence.capacity_bytes + bvh->places.capacity_bytes +
                                   bvh->depths.capacity_bytes + bvh->unfinished.capacity_bytes;
}

static enum tracer_progress bvh_update(struct tracer *tracer, struct gpu_scene *scene,
                                       const struct tracer_update *update, struct error *error)
{
    struct bvh *bvh = (struct bvh *)tracer;
    enum tracer_progress progress = TRACER_MORE;
    if (bvh->phase == BVH_IDLE && !begin_update(bvh, scene, update->changed, error))
        progress = TRACER_FAILED;
    if (progress == TRACER_MORE)
        progress = go_on(bvh, scene, update->times, error);
    if (progress == TRACER_FAILED)
        bvh_reset(bvh);
    if (progress != TRACER_MORE)
        bvh->phase = BVH_IDLE;
    fill_stats(bvh);
    return progress;
}

static void bvh_abandon(struct tracer *tracer)
{
    struct bvh *bvh = (struct bvh *)tracer;
    bvh_reset(bvh);
    bvh->phase = BVH_IDLE;
    fill_stats(bvh);
}

static void bvh_tell(const struct tracer *tracer, struct structure_rows *rows)
{
    structure_number(rows, "nodes", tracer->stats.nodes);
    structure_number(rows, "nodes_rebuilt", tracer->stats.nodes_rebuilt);
    structure_number(rows, "nodes_refitted", tracer->stats.nodes_refitted);
}

static bool bvh_waits(struct tracer *tracer)
{
    return bvh_store_waits(&((struct bvh *)tracer)->store);
}

/* ---- waves ---- */

static struct trace_state *bvh_state_create(struct gpu_device *device, const struct tracer_options *options,
                                            struct error *error)
{
    (void)device, (void)options;
    struct bvh_state *state = calloc(1, sizeof(*state));
    if (state)
        return &state->base;
    error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the state of a wave");
    return NULL;
}

static void bvh_state_destroy(struct trace_state *state)
{
    free(state);
}

static bool bvh_trace_begin(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                            struct error *error)
{
    struct bvh_state *own = (struct bvh_state *)state;
    own->packet_rays = bvh_packet_rays((struct bvh *)tracer, scene, &state->wave, error);
    own->ray_pairs = bvh_ray_pairs((struct bvh *)tracer, scene, &state->wave, own->packet_rays);
    return own->packet_rays > 0;
}

static void bind(struct bvh *bvh)
{
    struct bvh_store *store = &bvh->store;
    if (store->settings.plain) {
        gpu_buffer_bind_storage(&store->elements, BIND_TRACER_0);
    } else {
        gpu_buffer_bind_texels(store->device, &store->elements, UNIT_TRACER_0, GL_RGBA32UI);
    }
    gpu_buffer_bind_texels(store->device, &bvh->transform_buffer, UNIT_TRACER_1, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &store->primitives, UNIT_TRACER_2, GL_RGBA32UI);
}

/* A tree over one instance is that instance: its transform element is entered at once. */
static bool is_one_instance(const struct bvh *bvh)
{
    return bvh->top.element_count == 1;
}

static void set_uniforms(const struct bvh *bvh, const struct gpu_program *program, const struct gpu_scene *scene,
                         const struct wave *wave)
{
    gpu_uniform_float(program, "bvh_packet_reach", bvh_packet_reach(scene, wave));
    if (is_one_instance(bvh)) {
        gpu_uniform_uint(program, "bvh_instance", bvh->top.leaves[0] & BVH_LEAF_FIRST_MASK);
        return;
    }
    gpu_uniform_uint(program, "bvh_top_count", bvh->top.element_count);
    if (bvh_is_packed(&bvh->store.settings)) {
        gpu_uniform_vec(program, "bvh_top_grid_lower", 3, bvh->top.grid.lower);
        gpu_uniform_vec(program, "bvh_top_cells_per_unit", 3, bvh->top.grid.cells_per_unit);
    }
}

/* How the rays of a wave keep within the time of a dispatch. */
enum budget {
    BUDGET_NONE,   /* software GL traces short ranges, and no driver ends them; packets */
    BUDGET_STOPS,  /* what is not finished stops the slice */
    BUDGET_RESUMES /* dispatches follow one another until all is finished */
};

static enum budget budget_of(const struct bvh *bvh, const struct trace_state *state)
{
    if (bvh->base.device->facts.software || ((const struct bvh_state *)state)->packet_rays > 1 ||
        bvh->store.settings.plain)
        return BUDGET_NONE;
    return state->wave.stopped && !state->patient ? BUDGET_STOPS : BUDGET_RESUMES;
}

static uint32_t elements_of_a_ray(const struct bvh *bvh, uint32_t rays)
{
    const uint32_t fitting = DISPATCH_ELEMENTS_MAX / rays, allowed = bvh->base.options.bench.bvh_elements;
    const uint32_t maximum = allowed > 0 ? allowed : RAY_ELEMENTS_MAX;
    return fitting < maximum ? fitting : maximum;
}

/* The same rays again, until they are finished. Waits for each dispatch. */
static bool run_to_the_end(struct bvh *bvh, const struct gpu_program *program, const struct gpu_scene *scene,
                           const struct ray_range *rays, struct error *error)
{
    struct gpu_device *device = bvh->store.device;
    const struct trace_program_source all = {0};
    const uint32_t count = rays->end - rays->first;
    uint32_t unfinished = 0;
    if (!gpu_buffer_reserve(device, &bvh->places, count * sizeof(uvec4), error) ||
        !gpu_buffer_reserve(device, &bvh->depths, count * TRACE_DEPTH_BYTES, error))
        return false;
    fill_stats(bvh);
    gpu_buffer_bind_storage(&bvh->places, BIND_BVH_PLACES);
    gpu_buffer_bind_storage(&bvh->depths, BIND_OPTICAL_DEPTHS);
    gpu_uniform_uint(program, "bvh_budget", elements_of_a_ray(bvh, count));
    for (uint32_t dispatches = 0; dispatches == 0 || unfinished; dispatches++) {
        gpu_buffer_clear(device, &bvh->unfinished, 0);
        gpu_uniform_uint(program, "is_first_part", dispatches == 0);
        gpu_uniform_uint(program, "resumes", dispatches > 0);
        trace_program_run(program, scene, rays, &all);
        gpu_buffer_read(device, &bvh->unfinished, 0, &unfinished, sizeof(unfinished));
        if (device->lost)
            return gpu_check(device, "tracing", error);
    }
    return true;
}

static bool run_within_budget(struct bvh *bvh, const struct gpu_program *program, const struct gpu_scene *scene,
                              const struct trace_state *state, const struct ray_range *rays, struct error *error)
{
    const bool stops = budget_of(bvh, state) == BUDGET_STOPS;
    const struct wave *wave = &state->wave;
    if (!gpu_buffer_reserve(bvh->store.device, &bvh->unfinished, sizeof(uint32_t), error))
        return false;
    gpu_buffer_bind_storage(stops ? wave->stopped : &bvh->unfinished, BIND_BVH_UNFINISHED);
    gpu_uniform_uint(program, "unfinished_word", stops ? wave->stopped_word : 0);
    if (stops) {
        const uint32_t count = rays->end - rays->first;
        gpu_uniform_uint(program, "bvh_budget",
                         elements_of_a_ray(bvh, count < DISPATCH_RAYS_MAX ? count : DISPATCH_RAYS_MAX));
        const struct trace_program_source source = {.rays_a_dispatch = DISPATCH_RAYS_MAX};
        trace_program_run(program, scene, rays, &source);
        return true;
    }
    for (uint32_t first = rays->first, count; first < rays->end; first += count) {
        count = rays->end - first < DISPATCH_RAYS_MAX ? rays->end - first : DISPATCH_RAYS_MAX;
        const struct ray_range some = {.wave = wave, .first = first, .end = first + count};
        if (!run_to_the_end(bvh, program, scene, &some, error))
            return false;
    }
    return true;
}

static bool bvh_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                            const struct ray_range *rays, struct error *error)
{
    struct bvh *bvh = (struct bvh *)tracer;
    const struct bvh_form *settings = &bvh->store.settings;
    const struct wave *wave = &state->wave;
    const struct bvh_state *own = (const struct bvh_state *)state;
    const uint32_t packet_rays = own->packet_rays;
    const enum budget budget = budget_of(bvh, state);
    struct gpu_define defines[11] = {{"TRACER_BVH", "1"}};
    size_t n = 1;
    if (settings->bounds == BVH_BOUNDS_SPHERE)
        defines[n++] = (struct gpu_define){"BVH_SPHERES", "1"};
    if (settings->plain)
        defines[n++] = (struct gpu_define){"BVH_PLAIN", "1"};
    if (bvh_is_packed(settings))
        defines[n++] = (struct gpu_define){"BVH_PACKED", "1"};
    if (is_one_instance(bvh))
        defines[n++] = (struct gpu_define){"BVH_ONE_INSTANCE", "1"};
    /* One origin in the world is many in the space of what moves. */
    if (wave->shared_origin && packet_rays > 1 && !scene->has_motion)
        defines[n++] = (struct gpu_define){"SHARED_ORIGIN", "1"};
    if (bvh->store.deforms)
        defines[n++] = (struct gpu_define){"BVH_DEFORMS", "1"};
    if (bvh->store.deforms_in_shutter && wave->times) /* else all rays see the vertices of the first pose */
        defines[n++] = (struct gpu_define){"BVH_DEFORMS_IN_SHUTTER", "1"};
    if (budget != BUDGET_NONE)
        defines[n++] = (struct gpu_define){"BVH_BUDGET", "1"};
    if (budget == BUDGET_RESUMES)
        defines[n++] = (struct gpu_define){"BVH_RESUMES", "1"};
    const struct trace_program_source source = {
        .traverse = "bvh/traverse.glsl",
        .defines = defines,
        .packet_rays = packet_rays,
        .ray_pairs = own->ray_pairs,
        .rays_a_dispatch = DISPATCH_RAYS_MAX / packet_rays * packet_rays,
    };
    const struct gpu_program *program = trace_program_get(scene, wave, &source, error);
    if (!program)
        return false;
    bind(bvh);
    set_uniforms(bvh, program, scene, wave);
    if (budget != BUDGET_NONE)
        return run_within_budget(bvh, program, scene, state, rays, error);
    trace_program_run(program, scene, rays, &source);
    return true;
}

const struct tracer_impl tracer_bvh_impl = {
    .name = "bvh",
    .finds_first_hits = true,
    .depends_on = CHANGED_GEOMETRY | CHANGED_DEFORMED | CHANGED_INSTANCES,
    .minimum_rays = 192, /* a multiple of all packets' sizes */
    .create = bvh_create,
    .destroy = bvh_destroy,
    .update = bvh_update,
    .abandon = bvh_abandon,
    .tell = bvh_tell,
    .waits = bvh_waits,
    .state_create = bvh_state_create,
    .state_destroy = bvh_state_destroy,
    .trace_begin = bvh_trace_begin,
    .trace_range = bvh_trace_range,
};
