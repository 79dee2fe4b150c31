/* SPDX-License-Identifier: MIT */
/* The pass over the scene: every fragment becomes a node, linked into the list of its texel. Yang, Hensley, Gruen,
 * Thibieroz. Real-Time Concurrent Linked List Construction on the GPU. 2010. If not all of them fit, they are
 * counted, the buffer grows, and the pass is repeated. */
#include "abuffer/layout.h"
#include "shared/bindings.h"
#include "trace/abuffer/build_state.h"
#include "trace/raster/cover.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

/* First guess of the nodes of a new scene: one for this many texels. */
#define TEXELS_A_NODE 4
#define NODES_MIN 1024u
/* Maximum of texels that a unit of draws covers: some milliseconds on software GL. */
#define DRAW_TEXELS 65536.0 /* times step_scale */
/* Bytes cleared as one item. */
#define CLEAR_BYTES ((size_t)1 << 16)

/* Device memory of lists and samples, with the texels that they hang from. */
static uint64_t bytes_of(const struct abuffer_task *task, uint64_t nodes)
{
    uint64_t each = ABUFFER_NODE_BYTES + ABUFFER_SAMPLE_BYTES + ABUFFER_ID_BYTES;
    uint64_t texel = ABUFFER_TEXEL_BYTES + 2 * sizeof(uint32_t);
    return nodes * each + task->texel_count * texel;
}

/* Nodes that the options and the device allow. */
static uint64_t nodes_allowed(const struct abuffer_task *task)
{
    uint64_t allowed = (uint64_t)task->options->limits.abuffer_mebibytes << 20, fixed = bytes_of(task, 0);
    uint64_t maximum = task->builder->device->facts.texture_buffer_texels_max;
    if (allowed == 0)
        return maximum;
    uint64_t fitting = allowed > fixed ? (allowed - fixed) / (bytes_of(task, 1) - fixed) : 0;
    return fitting < maximum ? fitting : maximum;
}

static bool refuse(const struct abuffer_task *task, uint64_t nodes, struct error *error)
{
    uint64_t needed = (bytes_of(task, nodes) + ((uint64_t)1 << 20) - 1) >> 20;
    if (nodes > task->builder->device->facts.texture_buffer_texels_max)
        error_set(error, ERROR_LIMIT, "abuffer", "%s%llu samples; this device's texel buffers hold %llu",
                  task->counts.wraps > 0 ? "more than " : "", (unsigned long long)nodes,
                  (unsigned long long)task->builder->device->facts.texture_buffer_texels_max);
    else
        error_set(error, ERROR_LIMIT, "abuffer", "%llu samples need %llu MiB; %u MiB are allowed",
                  (unsigned long long)nodes, (unsigned long long)needed, task->options->limits.abuffer_mebibytes);
    return error_remedy(error, "take a lower resolution, or raise memory.abuffer");
}

bool abuffer_texels_allowed(const struct abuffer_task *task, struct error *error)
{
    uint32_t allowed = task->options->limits.abuffer_mebibytes;
    uint64_t needed = (bytes_of(task, 0) + ((uint64_t)1 << 20) - 1) >> 20;
    if (allowed == 0 || needed <= allowed)
        return true;
    error_set(error, ERROR_LIMIT, "abuffer", "%u texels alone need %llu MiB; %u MiB are allowed",
              task->texel_count, (unsigned long long)needed, allowed);
    return error_remedy(error, "take a lower resolution, or raise memory.abuffer");
}

/* Reserves exactly this size: the limit is strict, and growing buffers reserve more than requested. */
static bool reserve_nodes(struct abuffer_task *task, uint64_t nodes, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    builder->nodes_max = 0;
    gpu_buffer_finish(builder->device, &builder->nodes);
    if (!gpu_buffer_reserve(builder->device, &builder->nodes, (size_t)nodes * ABUFFER_NODE_BYTES, error))
        return false;
    builder->nodes_max = (uint32_t)nodes;
    return true;
}

bool abuffer_lists_reserve(struct abuffer_task *task, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    uint64_t allowed = nodes_allowed(task), wanted = task->texel_count / TEXELS_A_NODE;
    if (builder->nodes_max > 0 && builder->nodes_max <= allowed)
        return true;
    wanted = wanted > NODES_MIN ? wanted : NODES_MIN;
    wanted = wanted < allowed ? wanted : allowed;
    return reserve_nodes(task, wanted > 0 ? wanted : 1, error);
}

static void set_lists(const void *context, const struct gpu_program *program)
{
    const struct abuffer_task *task = context;
    gpu_uniform_uint(program, "nodes_max", task->builder->nodes_max);
    gpu_uniform_uint(program, "voxels_along", task->store->voxels_along);
    gpu_uniform_int(program, "has_subvoxels", abuffer_has_subvoxels(task->store));
    gpu_uniform_float(program, "voxels_per_cell",
                      (float)task->store->voxels_along / (float)task->store->resolution);
}

/* ---- beginning of a pass ---- */

struct part {
    struct gpu_buffer *buffer;
    uint32_t value;
};

enum { CLEARED_BUFFERS = 5 };

static void list_cleared(const struct abuffer_task *task, struct part parts[CLEARED_BUFFERS])
{
    struct abuffer_builder *builder = task->builder;
    struct abuffer_store *store = task->store;
    const struct part all[CLEARED_BUFFERS] = {{&builder->build, 0},
                                              {&builder->heads, 0},
                                              {&store->sums, 0},
                                              {&store->subvoxels, abuffer_has_subvoxels(store) ? 0 : UINT32_MAX},
                                              {&store->texels, 0}};
    memcpy(parts, all, sizeof(all));
}

static uint32_t chunks_of(const struct gpu_buffer *buffer)
{
    return (uint32_t)((buffer->size_bytes + CLEAR_BYTES - 1) / CLEAR_BYTES);
}

bool abuffer_clear_begin(struct abuffer_task *task, uint32_t *items, struct error *error)
{
    (void)error;
    struct part parts[CLEARED_BUFFERS];
    list_cleared(task, parts);
    *items = 0;
    for (uint32_t i = 0; i < CLEARED_BUFFERS; i++)
        *items += chunks_of(parts[i].buffer);
    return true;
}

bool abuffer_clear_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error)
{
    (void)error;
    struct part parts[CLEARED_BUFFERS];
    list_cleared(task, parts);
    for (uint32_t i = 0, before = 0; i < CLEARED_BUFFERS; before += chunks_of(parts[i].buffer), i++) {
        const uint32_t from = first > before ? first - before : 0, to = end > before ? end - before : 0;
        const size_t size = parts[i].buffer->size_bytes, from_bytes = from * CLEAR_BYTES;
        const size_t to_bytes = to * CLEAR_BYTES < size ? to * CLEAR_BYTES : size;
        if (from_bytes < to_bytes)
            gpu_buffer_clear_part(task->builder->device, parts[i].buffer, from_bytes, to_bytes - from_bytes,
                                  parts[i].value);
    }
    return true;
}

/* ---- the pass ---- */

bool abuffer_draw_begin(struct abuffer_task *task, uint32_t *items, struct error *error)
{
    (void)error;
    task->builder->passes++;
    *items = task->builder->draw.primitive_count;
    return true;
}

uint32_t abuffer_draw_fit(struct abuffer_task *task, uint32_t first, uint32_t items)
{
    const struct abuffer_store *store = task->store;
    const double maximum = DRAW_TEXELS * (double)task->builder->device->facts.step_scale;
    double texels;
    if (task->band_count > 0)
        return 1;
    const uint32_t end = axes_cover_end(&task->builder->draw, task->scene, store->cell_world, first, first + items,
                                        maximum, &texels);
    if (end == first + 1 && texels > 2 * maximum) {
        const double bands = ceil(texels / maximum), bands_max = (store->resolution + 7) / 8;
        task->band_count = (uint32_t)(bands < bands_max ? bands : bands_max);
        task->band = 0;
    }
    return end - first;
}

bool abuffer_draw_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error)
{
    struct gpu_define defines[3] = {{"ALL_IMAGES", "1"}};
    struct abuffer_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct abuffer_store *store = task->store;
    if (store->without_steep)
        defines[1] = (struct gpu_define){"WITHOUT_STEEP", "1"};
    struct axes_pass pass = {
        .fragment = "abuffer/build.frag",
        .defines = defines,
        .cell_world = store->cell_world,
        .resolution = store->resolution,
        .set = set_lists,
        .context = task,
    };
    if (task->band_count > 0) {
        pass.first_row = (uint32_t)((uint64_t)store->resolution * task->band / task->band_count);
        pass.end_row = (uint32_t)((uint64_t)store->resolution * (task->band + 1) / task->band_count);
    }
    memcpy(pass.lower_world, store->lower_world, sizeof(pass.lower_world));
    gpu_buffer_bind_image(device, &builder->heads, IMAGE_ABUFFER_HEADS, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->nodes, IMAGE_ABUFFER_NODES, GL_RGBA32UI);
    gpu_buffer_bind_image(device, &task->store->sums, IMAGE_ABUFFER_SUMS, GL_R32I);
    gpu_buffer_bind_image(device, &task->store->subvoxels, IMAGE_ABUFFER_SUBVOXELS, GL_R32UI);
    gpu_buffer_bind_storage(&builder->build, BIND_ABUFFER_BUILD_COUNTS);
    return axes_draw_bind_plain(&builder->draw, store->resolution, error) &&
           axes_draw_range(&builder->draw, task->scene, &pass, first, end, error);
}

/* ---- result of the pass ---- */

bool abuffer_occupied_begin(struct abuffer_task *task, uint32_t *items, struct error *error)
{
    (void)error;
    *items = task->texel_count / ABUFFER_OCCUPIED_TEXELS;
    return true;
}

bool abuffer_occupied_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program *program =
        gpu_program_get(device, &(struct gpu_program_source){.compute = "abuffer/occupied.comp"}, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(device, &builder->heads, UNIT_ABUFFER_HEADS, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->occupied, IMAGE_ABUFFER_OCCUPIED, GL_R32UI);
    gpu_buffer_bind_storage(&builder->build, BIND_ABUFFER_BUILD_COUNTS);
    gpu_uniform_uint(program, "first_item", first);
    gpu_uniform_uint(program, "end_item", end);
    gpu_dispatch(device, program, end - first);
    return true;
}

/* Repeats the pass with memory for all lists, if they did not fit. */
bool abuffer_occupied_end(struct abuffer_task *task, struct error *error)
{
    abuffer_read_counts(task);
    if (task->counts.wraps == 0 && task->counts.nodes <= task->builder->nodes_max)
        return true;
    if (task->builder->passes > 1)
        return error_set(error, ERROR_INTERNAL, "abuffer", "%u fragments, where there were %u before",
                         task->counts.nodes, task->nodes_before);
    task->nodes_before = task->counts.nodes;
    uint64_t needed = task->counts.wraps > 0 ? UINT32_MAX : task->counts.nodes, allowed = nodes_allowed(task);
    if (needed > allowed)
        return refuse(task, needed, error);
    uint64_t wanted = needed + needed / 8; /* margin: a scene that changes has a few more the next time */
    task->stage = ABUFFER_CLEAR;
    return reserve_nodes(task, wanted < allowed ? wanted : allowed, error);
}
