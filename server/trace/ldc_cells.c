/* SPDX-License-Identifier: MIT */
#include "trace/ldc_cells.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "shared/ldc.h"
#include "trace/ldc_levels.h"

#include <epoxy/gl.h>

#define CELL_NODE_BYTES (4 * sizeof(uint32_t))
#define ENTRY_BYTES (4 * sizeof(uint32_t))
/* A sample has a word, and one more for each cell that its plane passes in which another came first: for all of up
 * to four, as a plane spans up to 2 LDC_SPAN cells. */
#define SAMPLE_WORDS_MAX 5u

/* counts of ldc/cells.comp */
struct cell_counts {
    uint32_t lower_nodes[4], upper_nodes[4], unused[8];
    uint32_t blocks, entries, further, padding;
};

struct cell_build {
    struct ldc_store *store;
    unsigned which;
    uint32_t grid; /* nodes along a side */
    struct gpu_buffer list, counter;
    struct cell_counts counts;
};

static bool cells_pass(struct cell_build *build, const char *stage, uint64_t items, struct error *error)
{
    struct ldc_store *store = build->store;
    const struct ldc_cube *cube = &store->cubes[build->which];
    const struct gpu_define defines[] = {{stage, "1"}, {NULL, NULL}};
    const struct gpu_program_source source = {.compute = "ldc/cells.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(store->device, &source, error);
    if (!program)
        return false;
    gpu_uniform_int(program, "first_node", (int32_t)cube->first_node);
    gpu_uniform_int(program, "grid", (int32_t)build->grid);
    gpu_uniform_int(program, "first_texel", (int32_t)cube->first_texel);
    gpu_uniform_int(program, "resolution", (int32_t)cube->resolution);
    gpu_uniform_int(program, "blocks", (int32_t)build->counts.blocks);
    gpu_uniform_uint(program, "first_entry", cube->first_entry);
    gpu_uniform_uint(program, "first_sample", cube->first_sample);
    gpu_uniform_uint(program, "first_further", cube->first_entry + build->counts.entries);
    gpu_uniform_uint(program, "sample_count", cube->sample_count);
    gpu_uniform_uint(program, "item_count", (uint32_t)items);
    gpu_dispatch(store->device, program, items);
    return true;
}

static void bind_nodes(struct cell_build *build, uint32_t format)
{
    gpu_buffer_bind_image(build->store->device, &build->store->nodes, IMAGE_LDC_NODES, format);
}

static void clear_nodes(struct gpu_buffer *nodes, uint64_t first, uint64_t count)
{
    const uint32_t zero[4] = {0};
    if (count > 0)
        glClearNamedBufferSubData(nodes->name, GL_RGBA32UI, (GLintptr)(first * CELL_NODE_BYTES),
                                  (GLsizeiptr)(count * CELL_NODE_BYTES), GL_RGBA_INTEGER, GL_UNSIGNED_INT, zero);
}

static bool reserve_entries(struct cell_build *build, struct error *error)
{
    struct ldc_store *store = build->store;
    struct ldc_cube *cube = &store->cubes[build->which];
    const uint64_t count = (uint64_t)build->counts.entries + build->counts.further,
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

/* Which texel a sample is in: then passes have samples, and not texels most of which are empty, for items. */
static bool list_samples(struct cell_build *build, struct error *error)
{
    struct ldc_store *store = build->store;
    const struct ldc_cube *cube = &store->cubes[build->which];
    const uint64_t n = cube->resolution;
    const uint64_t words = (uint64_t)cube->sample_count * SAMPLE_WORDS_MAX;
    if (words > store->device->facts.texture_buffer_texels_max || words > INT32_MAX)
        return error_set(error, ERROR_LIMIT, "options.ldc_resolution",
                         "the cells of %u samples are more than the device takes", cube->sample_count);
    if (!gpu_buffer_reserve(store->device, &build->list, words * sizeof(uint32_t), error))
        return false;
    gpu_buffer_bind_texels(store->device, &store->texels, UNIT_TRACER_0, GL_RGBA32UI);
    gpu_buffer_bind_image(store->device, &build->list, IMAGE_LDC_NODES, GL_R32UI);
    if (!cells_pass(build, "CELLS_LIST", 3 * n * n, error))
        return false;
    gpu_buffer_bind_texels(store->device, &build->list, UNIT_TRACER_0, GL_R32UI);
    gpu_buffer_bind_texels(store->device, &store->geometry, UNIT_TRACER_1, GL_RG32UI);
    return true;
}

/* The nodes and their blocks, which are marked. */
static bool place_blocks(struct cell_build *build, struct error *error)
{
    struct ldc_store *store = build->store;
    struct ldc_cube *cube = &store->cubes[build->which];
    struct cell_counts *counts = &build->counts;
    const uint64_t nodes = (uint64_t)build->grid * build->grid * build->grid;
    if (!ldc_levels_reserve(store, build->which, nodes, 0, CELL_NODE_BYTES, error))
        return false;
    clear_nodes(&store->nodes, cube->first_node, nodes);
    bind_nodes(build, GL_R32UI);
    if (cube->sample_count > 0 && !cells_pass(build, "CELLS_BLOCKS", cube->sample_count, error))
        return false;
    bind_nodes(build, GL_RGBA32UI);
    if (!cells_pass(build, "CELLS_PLACE", nodes, error))
        return false;
    gpu_buffer_read(store->device, &build->counter, 0, counts, sizeof *counts);
    for (int k = 0; k < 3; k++) {
        cube->lower_cells[k] = counts->blocks ? counts->lower_nodes[k] << LDC_NODE_SHIFT : 0;
        cube->upper_cells[k] = counts->blocks ? (counts->upper_nodes[k] + 1) << LDC_NODE_SHIFT : 0;
    }
    if (!ldc_levels_reserve(store, build->which, nodes + counts->blocks, nodes, CELL_NODE_BYTES, error))
        return false;
    clear_nodes(&store->nodes, cube->first_node + nodes, counts->blocks);
    return true;
}

static bool fill_blocks(struct cell_build *build, struct error *error)
{
    struct ldc_store *store = build->store;
    struct ldc_cube *cube = &store->cubes[build->which];
    struct cell_counts *counts = &build->counts;
    bind_nodes(build, GL_R32UI);
    gpu_buffer_bind_image(store->device, &build->list, IMAGE_LDC_ENTRIES, GL_R32UI);
    if (!cells_pass(build, "CELLS_MARK", cube->sample_count, error))
        return false;
    bind_nodes(build, GL_RGBA32UI);
    if (!cells_pass(build, "CELLS_COUNT", counts->blocks, error))
        return false;
    gpu_buffer_read(store->device, &build->counter, 0, counts, sizeof *counts);
    if (!reserve_entries(build, error))
        return false;
    gpu_buffer_bind_texels(store->device, &store->nodes, UNIT_TRACER_2, GL_RGBA32UI);
    gpu_buffer_bind_image(store->device, &store->entries, IMAGE_LDC_ENTRIES, GL_RGBA32UI);
    if (!cells_pass(build, "CELLS_FILL", cube->sample_count, error))
        return false;
    gpu_buffer_bind_image(store->device, &store->entries, IMAGE_LDC_ENTRIES, GL_R32UI);
    return counts->further == 0 || (cells_pass(build, "CELLS_FURTHER", counts->further, error) &&
                                    cells_pass(build, "CELLS_SORT", counts->further, error));
}

/* How far it is empty around empty nodes. */
static bool measure_emptiness(struct cell_build *build, struct error *error)
{
    const uint64_t nodes = (uint64_t)build->grid * build->grid * build->grid;
    bind_nodes(build, GL_RGBA32UI);
    return cells_pass(build, "CELLS_REACH_X", nodes, error) && cells_pass(build, "CELLS_REACH_Y", nodes, error) &&
           cells_pass(build, "CELLS_REACH_Z", nodes, error);
}

bool ldc_cells_build(struct ldc_store *store, unsigned which, uint32_t grid, struct error *error)
{
    struct ldc_cube *cube = &store->cubes[which];
    struct cell_build build = {
        .store = store, .which = which, .grid = grid, .counts.lower_nodes = {grid, grid, grid, 0}};
    cube->first_entry = cube->entry_count = 0;
    for (unsigned i = 0; i < which; i++)
        if (store->cubes[i].resolution)
            cube->first_entry = store->cubes[i].first_entry + store->cubes[i].entry_count;
    bool ok = gpu_buffer_upload(store->device, &build.counter, &build.counts, sizeof build.counts, error);
    if (ok)
        gpu_buffer_bind_storage(&build.counter, BIND_TRACER_0);
    ok = ok && (cube->sample_count == 0 || list_samples(&build, error)) && place_blocks(&build, error) &&
         (build.counts.blocks == 0 || fill_blocks(&build, error)) && measure_emptiness(&build, error);
    gpu_buffer_finish(store->device, &build.counter);
    gpu_buffer_finish(store->device, &build.list);
    return ok;
}
