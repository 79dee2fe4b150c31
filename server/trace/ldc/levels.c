/* SPDX-License-Identifier: MIT */
/* Units that make the nodes by which rays skip empty space: cells where they fit, else blocks. */
#include "trace/ldc/levels.h"

#include "base/log.h"
#include "gpu/program.h"
#include "shared/bindings.h"
#include "ldc/layout.h"
#include "trace/ldc/cells.h"

#include <epoxy/gl.h>
#include <stdio.h>

#define RANGE_BYTES (2 * sizeof(float))

struct ldc_level_layout ldc_level_layout_of(const struct ldc_store *store, uint32_t resolution,
                                            const struct tracer_options *options)
{
    const bool cells = options->ldc.form == TRACER_FORM_FAST && !store->no_cells;
    const uint32_t shift = cells ? LDC_NODE_SHIFT : LDC_BLOCK_SHIFT,
                   along = (resolution + (1u << shift) - 1) >> shift;
    return cells ? (struct ldc_level_layout){.cells = true, .grid = along}
                 : (struct ldc_level_layout){.row = along};
}

bool ldc_levels_reserve(struct ldc_store *store, unsigned which, uint64_t node_count, uint64_t kept,
                        size_t node_bytes, struct error *error)
{
    struct gpu_device *device = store->device;
    uint64_t first = 0;
    for (unsigned i = 0; i < which; i++)
        if (store->cubes[i].resolution && store->cubes[i].first_node + store->cubes[i].node_count > first)
            first = store->cubes[i].first_node + store->cubes[i].node_count;
    uint64_t nodes = first + node_count;
    /* The limit counts words, as some passes write a node word by word. */
    if (nodes * (node_bytes / sizeof(uint32_t)) > device->facts.texture_buffer_texels_max || nodes > INT32_MAX)
        return error_set(error, ERROR_LIMIT, "options.ldc_resolution", "%llu nodes are more than the device takes",
                         (unsigned long long)nodes);
    store->cubes[which].first_node = (uint32_t)first;
    store->cubes[which].node_count = (uint32_t)node_count;
    return ldc_store_grow(device, &store->nodes, (first + kept) * node_bytes, nodes * node_bytes, error);
}

/* Reserves and fills the blocks of a cube's three images. */
static enum tracer_progress build_blocks(struct ldc_levels *levels, struct error *error)
{
    struct ldc_store *store = levels->store;
    struct ldc_cube *cube = &store->cubes[levels->at];
    const uint64_t row = levels->layout.row, blocks = 3 * row * row;
    const struct gpu_program_source source = {.compute = "ldc/levels.comp"};
    if (!ldc_levels_reserve(store, levels->at, blocks, 0, RANGE_BYTES, error))
        return TRACER_FAILED;
    const struct gpu_program *program = gpu_program_get(store->device, &source, error);
    if (!program)
        return TRACER_FAILED;
    gpu_buffer_bind_texels(store->device, &store->texels, UNIT_TRACER_0, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &store->geometry, UNIT_TRACER_1, GL_RG32UI);
    gpu_buffer_bind_image(store->device, &store->nodes, IMAGE_LDC_NODES, GL_RG32F);
    gpu_uniform_uint(program, "first_texel", cube->first_texel);
    gpu_uniform_uint(program, "first_block", cube->first_node);
    gpu_uniform_uint(program, "resolution", cube->resolution);
    gpu_uniform_uint(program, "row", (uint32_t)row);
    gpu_dispatch(store->device, program, blocks);
    return TRACER_DONE;
}

static void begin_cube(struct ldc_levels *levels, unsigned which)
{
    struct ldc_store *store = levels->store;
    struct ldc_cube *cube = &store->cubes[which];
    levels->at = which;
    cube->node_count = cube->entry_count = 0;
    if (cube->resolution == 0)
        return;
    levels->layout = ldc_level_layout_of(store, cube->resolution, levels->options);
    if (levels->layout.cells)
        ldc_cells_begin(&levels->cells, store, which, levels->layout.grid);
}

/* Runs a unit of the current cube. */
static enum tracer_progress build_levels(struct ldc_levels *levels, struct error *error)
{
    struct ldc_cube *cube = &levels->store->cubes[levels->at];
    if (cube->resolution == 0)
        return TRACER_DONE;
    enum tracer_progress progress =
        levels->layout.cells ? ldc_cells_step(&levels->cells, error) : build_blocks(levels, error);
    if (progress == TRACER_FAILED)
        cube->node_count = cube->entry_count = 0;
    if (progress != TRACER_MORE)
        ldc_cells_finish(&levels->cells);
    return progress;
}

/* Whether blocks may take the place of cells: there are too many of these. */
static bool may_have_blocks(const struct ldc_levels *levels, const struct error *of_cells)
{
    return levels->layout.cells && (of_cells->kind == ERROR_LIMIT || of_cells->kind == ERROR_OUT_OF_MEMORY);
}

void ldc_levels_begin(struct ldc_levels *levels, struct ldc_store *store, unsigned which,
                      const struct tracer_options *options)
{
    *levels = (struct ldc_levels){.store = store, .options = options, .which = which};
    if (which == LDC_CUBE_STATIC)
        store->no_cells = false;
    begin_cube(levels, which);
}

enum tracer_progress ldc_levels_step(struct ldc_levels *levels, struct error *error)
{
    struct ldc_store *store = levels->store;
    struct error own = {0};
    gpu_push_group(store->device, "ldc levels");
    enum tracer_progress progress = build_levels(levels, &own);
    gpu_pop_group(store->device);
    if (progress == TRACER_FAILED && may_have_blocks(levels, &own)) {
        log_write(LOG_WARNING, "ldc", "%s: rays take the slower way by blocks", own.text);
        gpu_buffer_finish(store->device, &store->entries);
        store->no_cells = true;
        begin_cube(levels, 0);
        return TRACER_MORE;
    }
    if (progress == TRACER_FAILED && error && error->kind == ERROR_NONE)
        *error = own;
    if (progress != TRACER_DONE || levels->at == levels->which)
        return progress;
    begin_cube(levels, levels->at + 1);
    return TRACER_MORE;
}

void ldc_levels_finish(struct ldc_levels *levels)
{
    ldc_cells_finish(&levels->cells);
    *levels = (struct ldc_levels){0};
}

uint64_t ldc_levels_bytes(const struct ldc_levels *levels)
{
    return (uint64_t)levels->cells.list.capacity_bytes + levels->cells.counter.capacity_bytes;
}
