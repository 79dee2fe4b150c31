/* SPDX-License-Identifier: MIT */
#include "trace/ldc_levels.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "shared/ldc.h"

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#define RANGE_BYTES (2 * sizeof(float))
#define CELL_NODE_BYTES (4 * sizeof(uint32_t))
/* 4 x 4 children: half the levels of 2 x 2. */
#define PYRAMID_BITS 2
#define BLOCK_DEFAULT 8

struct ldc_level_layout ldc_level_layout_of(uint32_t resolution, const struct tracer_options *options)
{
    struct ldc_level_layout layout = {.blocks = options->ldc_levels == LDC_LEVELS_BLOCKS};
    if (layout.blocks) {
        uint32_t block = options->ldc_block ? options->ldc_block : BLOCK_DEFAULT;
        while (2u << layout.bits <= block)
            layout.bits++;
        layout.top = 1;
        layout.row = (resolution + block - 1) >> layout.bits;
        layout.image_nodes = layout.row * layout.row;
        return layout;
    }
    if (options->ldc_levels == LDC_LEVELS_CELLS ||
        (options->ldc_levels == LDC_LEVELS_AUTO && !(options->ldc_tolerance > 0))) {
        layout.cells = true;
        layout.grid = (resolution + (1u << LDC_NODE_SHIFT) - 1) >> LDC_NODE_SHIFT;
        return layout;
    }
    layout.bits = PYRAMID_BITS;
    for (layout.top = 1; 1u << layout.bits * layout.top < resolution; layout.top++)
        ;
    for (uint32_t k = 0; k < layout.top; k++)
        layout.image_nodes += 1u << 2 * layout.bits * k;
    return layout;
}

/* Room for the cube's nodes behind those of the one before it, which stay, as do `kept` of its own. */
static bool reserve(struct ldc_store *store, unsigned which, uint64_t node_count, uint64_t kept, size_t node_bytes,
                    struct error *error)
{
    struct gpu_device *device = store->device;
    uint64_t first = 0;
    for (unsigned i = 0; i < which; i++)
        if (store->cubes[i].resolution && store->cubes[i].first_node + store->cubes[i].node_count > first)
            first = store->cubes[i].first_node + store->cubes[i].node_count;
    uint64_t nodes = first + node_count;
    /* Atomics take them word by word. */
    if (nodes * (node_bytes / sizeof(uint32_t)) > device->facts.texture_buffer_texels_max || nodes > INT32_MAX)
        return error_set(error, ERROR_LIMIT, "options.ldc_resolution", "%llu nodes are more than the device takes",
                         (unsigned long long)nodes);
    store->cubes[which].first_node = (uint32_t)first;
    store->cubes[which].node_count = (uint32_t)node_count;
    return ldc_store_grow(device, &store->nodes, (first + kept) * node_bytes, nodes * node_bytes, error);
}

/* Where the nodes of a level lie, or the texels. */
struct place {
    uint32_t first, row, width, image;
};

static struct place place_of(const struct ldc_cube *cube, const struct ldc_level_layout *layout, uint32_t level)
{
    uint32_t n = cube->resolution;
    if (level == 0)
        return (struct place){cube->first_texel, n, n, n * n};
    if (layout->blocks)
        return (struct place){cube->first_node, layout->row, layout->row, layout->image_nodes};
    uint32_t above = layout->top - level, first = cube->first_node;
    for (uint32_t k = 0; k < above; k++)
        first += 1u << 2 * layout->bits * k;
    uint32_t row = 1u << layout->bits * above;
    return (struct place){first, row, row, layout->image_nodes};
}

static void set_place(const struct gpu_program *program, const char *which, const struct place *place)
{
    const struct {
        const char *name;
        uint32_t value;
    } parts[] = {{"first", place->first}, {"row", place->row}, {"width", place->width}, {"image", place->image}};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        char name[32];
        snprintf(name, sizeof name, "%s_%s", parts[i].name, which);
        gpu_uniform_uint(program, name, parts[i].value);
    }
}

static bool build_ranges(struct ldc_store *store, unsigned which, const struct ldc_level_layout *layout,
                         struct error *error)
{
    struct ldc_cube *cube = &store->cubes[which];
    if (!reserve(store, which, 3 * (uint64_t)layout->image_nodes, 0, RANGE_BYTES, error))
        return false;
    char bits[4];
    snprintf(bits, sizeof bits, "%u", layout->bits);
    bool ok = true;
    for (uint32_t level = 1; ok && level <= layout->top; level++) {
        const struct gpu_define defines[] = {
            {"LDC_LEVEL_BITS", bits}, {level == 1 ? "LDC_FROM_TEXELS" : NULL, "1"}, {NULL, NULL}};
        const struct gpu_program_source source = {.compute = "ldc/levels.comp", .defines = defines};
        const struct gpu_program *program = gpu_program_get(store->device, &source, error);
        ok = program != NULL;
        if (!ok)
            break;
        const struct place below = place_of(cube, layout, level - 1), here = place_of(cube, layout, level);
        if (level == 1) {
            gpu_buffer_bind_texels(store->device, &store->texels, UNIT_TRACER_0, GL_RGBA32UI);
            gpu_buffer_bind_texels(store->device, &store->geometry, UNIT_TRACER_1, GL_RG32UI);
        } else {
            gpu_buffer_bind_texels(store->device, &store->nodes, UNIT_TRACER_0, GL_RG32F);
        }
        gpu_buffer_bind_image(store->device, &store->nodes, IMAGE_LDC_NODES, GL_RG32F);
        set_place(program, "below", &below);
        set_place(program, "here", &here);
        gpu_dispatch(store->device, program, 3 * (uint64_t)here.width * here.width);
    }
    return ok;
}

/* ---- cells ---- */

#define ENTRY_BYTES (4 * sizeof(uint32_t))

/* counts of ldc/cells.comp */
struct cell_counts {
    uint32_t blocks, entries, further, unused;
    uint32_t lower_nodes[4], upper_nodes[4];
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
    gpu_uniform_uint(program, "sample_count", cube->sample_count);
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
    if (!gpu_buffer_reserve(store->device, &build->list, cube->sample_count * sizeof(uint32_t), error))
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
    if (!reserve(store, build->which, nodes, 0, CELL_NODE_BYTES, error))
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
    if (!reserve(store, build->which, nodes + counts->blocks, nodes, CELL_NODE_BYTES, error))
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
    /* From now on where the next further entry goes. */
    const uint32_t further = cube->first_entry + counts->entries;
    gpu_buffer_write(store->device, &build->counter, offsetof(struct cell_counts, further), &further,
                     sizeof further);
    bind_nodes(build, GL_R32UI);
    gpu_buffer_bind_image(store->device, &store->entries, IMAGE_LDC_ENTRIES, GL_RGBA32UI);
    if (!cells_pass(build, "CELLS_FILL", cube->sample_count, error))
        return false;
    gpu_buffer_bind_image(store->device, &store->entries, IMAGE_LDC_ENTRIES, GL_R32UI);
    return counts->further == 0 || cells_pass(build, "CELLS_FURTHER", cube->sample_count, error);
}

/* How far it is empty around empty nodes. */
static bool measure_emptiness(struct cell_build *build, struct error *error)
{
    const uint64_t nodes = (uint64_t)build->grid * build->grid * build->grid;
    bind_nodes(build, GL_RGBA32UI);
    return cells_pass(build, "CELLS_REACH_X", nodes, error) && cells_pass(build, "CELLS_REACH_Y", nodes, error) &&
           cells_pass(build, "CELLS_REACH_Z", nodes, error);
}

static bool build_cells(struct ldc_store *store, unsigned which, uint32_t grid, struct error *error)
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

bool ldc_levels_build(struct ldc_store *store, unsigned which, const struct tracer_options *options,
                      struct error *error)
{
    struct ldc_cube *cube = &store->cubes[which];
    cube->node_count = 0;
    if (cube->resolution == 0)
        return true;
    const struct ldc_level_layout layout = ldc_level_layout_of(cube->resolution, options);
    gpu_push_group(store->device, "ldc levels");
    bool ok =
        layout.cells ? build_cells(store, which, layout.grid, error) : build_ranges(store, which, &layout, error);
    gpu_pop_group(store->device);
    if (!ok)
        cube->node_count = 0;
    return ok;
}
