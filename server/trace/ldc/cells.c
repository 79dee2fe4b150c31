/* SPDX-License-Identifier: MIT */
/* Units that make the nodes, blocks and entries of a cube's cells. */
#include "trace/ldc/cells.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "ldc/layout.h"
#include "trace/ldc/levels.h"
#include "trace/raster/reach.h"

#include <epoxy/gl.h>
#include <stdlib.h>

#define CELL_NODE_BYTES (4 * sizeof(uint32_t))
#define ENTRY_BYTES (4 * sizeof(uint32_t))
/* Maximum of words per sample: one, and one more for each further cell that its plane passes, up to four, as a
 * plane spans at most 2 LDC_SPAN cells. */
#define SAMPLE_WORDS_MAX 5u

static bool cells_pass(struct ldc_cells *cells, const char *stage, uint64_t items, struct error *error)
{
    struct ldc_store *store = cells->store;
    const struct ldc_cube *cube = &store->cubes[cells->which];
    const struct gpu_define defines[] = {{stage, "1"}, {NULL, NULL}};
    const struct gpu_program_source source = {.compute = "ldc/cells.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(store->device, &source, error);
    if (!program)
        return false;
    gpu_uniform_int(program, "first_node", (int32_t)cube->first_node);
    gpu_uniform_int(program, "grid", (int32_t)cells->grid);
    gpu_uniform_int(program, "first_texel", (int32_t)cube->first_texel);
    gpu_uniform_int(program, "resolution", (int32_t)cube->resolution);
    gpu_uniform_int(program, "blocks", (int32_t)cells->counts.blocks);
    gpu_uniform_uint(program, "first_entry", cube->first_entry);
    gpu_uniform_uint(program, "first_sample", cube->first_sample);
    gpu_uniform_uint(program, "first_further", cube->first_entry + cells->counts.entries);
    gpu_uniform_uint(program, "sample_count", cube->sample_count);
    gpu_uniform_uint(program, "item_count", (uint32_t)items);
    gpu_buffer_bind_storage(&cells->counter, BIND_TRACER_0);
    gpu_dispatch(store->device, program, items);
    return true;
}

static uint64_t node_count(const struct ldc_cells *cells)
{
    return (uint64_t)cells->grid * cells->grid * cells->grid;
}

static void bind_nodes(struct ldc_cells *cells, uint32_t format)
{
    gpu_buffer_bind_image(cells->store->device, &cells->store->nodes, IMAGE_LDC_NODES, format);
}

/* Binds the inputs of passes over samples. */
static void bind_samples(struct ldc_cells *cells)
{
    struct ldc_store *store = cells->store;
    gpu_buffer_bind_texels(store->device, &cells->list, UNIT_TRACER_0, GL_R32UI);
    gpu_buffer_bind_texels(store->device, &store->geometry, UNIT_TRACER_1, GL_RG32UI);
}

static void clear_nodes(struct ldc_store *store, uint64_t first, uint64_t count)
{
    const uint32_t zero[4] = {0};
    gpu_buffer_fill(store->device, &store->nodes, (size_t)(first * CELL_NODE_BYTES),
                    (size_t)(count * CELL_NODE_BYTES), zero);
}

static bool reserve_entries(struct ldc_cells *cells, struct error *error)
{
    struct ldc_store *store = cells->store;
    struct ldc_cube *cube = &store->cubes[cells->which];
    const uint64_t count = (uint64_t)cells->counts.entries + cells->counts.further,
                   entries = cube->first_entry + count;
    if (4 * entries > store->device->facts.texture_buffer_texels_max || entries > INT32_MAX)
        return error_set(error, ERROR_LIMIT, "options.ldc_resolution",
                         "%llu samples in cells are more than the device takes", (unsigned long long)entries);
    if (!ldc_store_grow(store->device, &store->entries, cube->first_entry * ENTRY_BYTES, entries * ENTRY_BYTES,
                        error))
        return false;
    cube->entry_count = (uint32_t)count;
    return true;
}

/* ---- units, from the last to the first ---- */

/* Finds the empty space around empty nodes. */
static bool reach(struct ldc_cells *cells, struct error *error)
{
    struct ldc_store *store = cells->store;
    const struct raster_blocks nodes = {
        .buffer = &store->nodes,
        .first_texel = store->cubes[cells->which].first_node,
        .block_texels = 1,
        .grid = cells->grid,
    };
    const unsigned pass = cells->reach_passes++;
    if (cells->reach_passes == RASTER_REACH_PASSES)
        cells->next = NULL;
    return raster_reach_pass(store->device, &nodes, pass, 0, (uint32_t)node_count(cells), error);
}

/* Runs a pass that adds entries to cells that have one already. */
static bool pass_further(struct ldc_cells *cells, const char *stage, struct error *error)
{
    struct ldc_store *store = cells->store;
    bind_samples(cells);
    gpu_buffer_bind_texels(store->device, &store->nodes, UNIT_TRACER_2, GL_RGBA32UI);
    gpu_buffer_bind_image(store->device, &store->entries, IMAGE_LDC_ENTRIES, GL_R32UI);
    return cells_pass(cells, stage, cells->counts.further, error);
}

static bool sort_further(struct ldc_cells *cells, struct error *error)
{
    cells->next = reach;
    return pass_further(cells, "CELLS_SORT", error);
}

static bool fill_further(struct ldc_cells *cells, struct error *error)
{
    cells->next = sort_further;
    return pass_further(cells, "CELLS_FURTHER", error);
}

static bool fill_first(struct ldc_cells *cells, struct error *error)
{
    struct ldc_store *store = cells->store;
    cells->next = cells->counts.further > 0 ? fill_further : reach;
    bind_samples(cells);
    gpu_buffer_bind_texels(store->device, &store->nodes, UNIT_TRACER_2, GL_RGBA32UI);
    gpu_buffer_bind_image(store->device, &store->entries, IMAGE_LDC_ENTRIES, GL_RGBA32UI);
    return cells_pass(cells, "CELLS_FILL", store->cubes[cells->which].sample_count, error);
}

static bool count_entries(struct ldc_cells *cells, struct error *error)
{
    struct ldc_cell_counts *counts = &cells->counts;
    cells->next = fill_first;
    bind_nodes(cells, GL_RGBA32UI);
    if (!cells_pass(cells, "CELLS_COUNT", counts->blocks, error))
        return false;
    gpu_buffer_read(cells->store->device, &cells->counter, 0, counts, sizeof(*counts));
    return reserve_entries(cells, error);
}

static bool mark_cells(struct ldc_cells *cells, struct error *error)
{
    struct ldc_store *store = cells->store;
    cells->next = count_entries;
    bind_samples(cells);
    bind_nodes(cells, GL_R32UI);
    gpu_buffer_bind_image(store->device, &cells->list, IMAGE_LDC_ENTRIES, GL_R32UI);
    return cells_pass(cells, "CELLS_MARK", store->cubes[cells->which].sample_count, error);
}

/* Reserves blocks, now that the number of occupied nodes is known. */
static bool reserve_blocks(struct ldc_cells *cells, struct error *error)
{
    struct ldc_store *store = cells->store;
    struct ldc_cube *cube = &store->cubes[cells->which];
    const struct ldc_cell_counts *counts = &cells->counts;
    const uint64_t nodes = node_count(cells);
    for (int k = 0; k < 3; k++) {
        cube->lower_cells[k] = counts->blocks ? counts->lower_nodes[k] << LDC_NODE_SHIFT : 0;
        cube->upper_cells[k] = counts->blocks ? (counts->upper_nodes[k] + 1) << LDC_NODE_SHIFT : 0;
    }
    if (!ldc_levels_reserve(store, cells->which, nodes + counts->blocks, nodes, CELL_NODE_BYTES, error))
        return false;
    clear_nodes(store, cube->first_node + nodes, counts->blocks);
    cells->next = counts->blocks == 0 ? reach : mark_cells;
    return true;
}

static bool place_blocks(struct ldc_cells *cells, struct error *error)
{
    bind_nodes(cells, GL_RGBA32UI);
    if (!cells_pass(cells, "CELLS_PLACE", node_count(cells), error))
        return false;
    gpu_buffer_read(cells->store->device, &cells->counter, 0, &cells->counts, sizeof(cells->counts));
    return reserve_blocks(cells, error);
}

static bool mark_blocks(struct ldc_cells *cells, struct error *error)
{
    struct ldc_store *store = cells->store;
    struct ldc_cube *cube = &store->cubes[cells->which];
    const uint64_t nodes = node_count(cells);
    cells->next = place_blocks;
    if (!ldc_levels_reserve(store, cells->which, nodes, 0, CELL_NODE_BYTES, error))
        return false;
    clear_nodes(store, cube->first_node, nodes);
    if (cube->sample_count == 0)
        return reserve_blocks(cells, error);
    bind_samples(cells);
    bind_nodes(cells, GL_R32UI);
    return cells_pass(cells, "CELLS_BLOCKS", cube->sample_count, error);
}

/* Lists the texel of each sample, so that passes have samples for items and not texels, most of which are
 * empty. */
static bool list_samples(struct ldc_cells *cells, struct error *error)
{
    struct ldc_store *store = cells->store;
    const struct ldc_cube *cube = &store->cubes[cells->which];
    const uint64_t n = cube->resolution;
    const uint64_t words = (uint64_t)cube->sample_count * SAMPLE_WORDS_MAX;
    cells->next = mark_blocks;
    if (words > store->device->facts.texture_buffer_texels_max || words > INT32_MAX)
        return error_set(error, ERROR_LIMIT, "options.ldc_resolution",
                         "the cells of %u samples are more than the device takes", cube->sample_count);
    if (!gpu_buffer_reserve(store->device, &cells->list, words * sizeof(uint32_t), error))
        return false;
    gpu_buffer_bind_texels(store->device, &store->texels, UNIT_TRACER_0, GL_RGBA32UI);
    gpu_buffer_bind_image(store->device, &cells->list, IMAGE_LDC_NODES, GL_R32UI);
    return cells_pass(cells, "CELLS_LIST", 3 * n * n, error);
}

static bool begin(struct ldc_cells *cells, struct error *error)
{
    cells->next = cells->store->cubes[cells->which].sample_count > 0 ? list_samples : mark_blocks;
    return gpu_buffer_upload(cells->store->device, &cells->counter, &cells->counts, sizeof(cells->counts), error);
}

/* ---- the whole ---- */

void ldc_cells_begin(struct ldc_cells *cells, struct ldc_store *store, unsigned which, uint32_t grid)
{
    struct ldc_cube *cube = &store->cubes[which];
    *cells = (struct ldc_cells){
        .store = store,
        .which = which,
        .grid = grid,
        .next = begin,
        .counts.lower_nodes = {grid, grid, grid, 0},
    };
    cube->first_entry = cube->entry_count = 0;
    for (unsigned i = 0; i < which; i++)
        if (store->cubes[i].resolution)
            cube->first_entry = store->cubes[i].first_entry + store->cubes[i].entry_count;
}

enum tracer_progress ldc_cells_step(struct ldc_cells *cells, struct error *error)
{
    if (!cells->next(cells, error))
        return TRACER_FAILED;
    return cells->next ? TRACER_MORE : TRACER_DONE;
}

void ldc_cells_finish(struct ldc_cells *cells)
{
    if (cells->store) {
        gpu_buffer_finish(cells->store->device, &cells->counter);
        gpu_buffer_finish(cells->store->device, &cells->list);
    }
    *cells = (struct ldc_cells){0};
}
