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

static uint64_t texel_count(const struct ldc_cube *cube)
{
    return 3 * (uint64_t)cube->resolution * cube->resolution;
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

struct cell_pass {
    const char *stage;
    uint64_t items;
    uint32_t blocks;
};

static bool cells_pass(struct ldc_store *store, const struct ldc_cube *cube, uint32_t grid,
                       const struct cell_pass *pass, struct error *error)
{
    const struct gpu_define defines[] = {{pass->stage, "1"}, {NULL, NULL}};
    const struct gpu_program_source source = {.compute = "ldc/cells.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(store->device, &source, error);
    if (!program)
        return false;
    bool of_texels = pass->items == texel_count(cube);
    gpu_uniform_int(program, "first_node", (int32_t)cube->first_node);
    gpu_uniform_int(program, "grid", (int32_t)grid);
    gpu_uniform_int(program, "first_texel", (int32_t)cube->first_texel);
    gpu_uniform_int(program, "resolution", (int32_t)cube->resolution);
    gpu_uniform_int(program, "blocks", (int32_t)pass->blocks);
    gpu_uniform_uint(program, "first_entry", cube->first_entry);
    gpu_buffer_bind_image(store->device, &store->nodes, IMAGE_LDC_NODES, of_texels ? GL_R32UI : GL_RGBA32UI);
    gpu_dispatch(store->device, program, pass->items);
    return true;
}

static void clear_words(struct gpu_buffer *buffer, uint64_t first_byte, uint64_t bytes, uint32_t format,
                        const uint32_t *value)
{
    if (bytes > 0)
        glClearNamedBufferSubData(buffer->name, format, (GLintptr)first_byte, (GLsizeiptr)bytes,
                                  format == GL_R32UI ? GL_RED_INTEGER : GL_RGBA_INTEGER, GL_UNSIGNED_INT, value);
}

static bool reserve_entries(struct ldc_store *store, unsigned which, uint64_t count, struct error *error)
{
    struct ldc_cube *cube = &store->cubes[which];
    const uint32_t empty[4] = {LDC_ENTRY_NONE};
    uint64_t entries = cube->first_entry + count;
    if (4 * entries > store->device->facts.texture_buffer_texels_max || entries > INT32_MAX)
        return error_set(error, ERROR_LIMIT, "options.ldc_resolution",
                         "%llu samples in cells are more than the device takes", (unsigned long long)entries);
    if (!ldc_store_grow(store->device, &store->entries, cube->first_entry * ENTRY_BYTES, entries * ENTRY_BYTES,
                        error))
        return false;
    cube->entry_count = (uint32_t)count;
    clear_words(&store->entries, cube->first_entry * ENTRY_BYTES, count * ENTRY_BYTES, GL_RGBA32UI, empty);
    return true;
}

/* The nodes and their blocks, which are marked. */
static bool place_blocks(struct ldc_store *store, unsigned which, uint32_t grid, struct gpu_buffer *counter,
                         struct cell_counts *counts, struct error *error)
{
    struct ldc_cube *cube = &store->cubes[which];
    const uint64_t nodes = (uint64_t)grid * grid * grid, texels = texel_count(cube);
    const uint32_t zero[2] = {0};
    if (!reserve(store, which, nodes, 0, CELL_NODE_BYTES, error))
        return false;
    clear_words(&store->nodes, cube->first_node * CELL_NODE_BYTES, nodes * CELL_NODE_BYTES, GL_R32UI, zero);
    if (!cells_pass(store, cube, grid, &(struct cell_pass){"CELLS_BLOCKS", texels, 0}, error) ||
        !cells_pass(store, cube, grid, &(struct cell_pass){"CELLS_PLACE", nodes, 0}, error))
        return false;
    gpu_buffer_read(store->device, counter, 0, counts, sizeof *counts);
    for (int k = 0; k < 3; k++) {
        cube->lower_cells[k] = counts->blocks ? counts->lower_nodes[k] << LDC_NODE_SHIFT : 0;
        cube->upper_cells[k] = counts->blocks ? (counts->upper_nodes[k] + 1) << LDC_NODE_SHIFT : 0;
    }
    if (!reserve(store, which, nodes + counts->blocks, nodes, CELL_NODE_BYTES, error))
        return false;
    clear_words(&store->nodes, (cube->first_node + nodes) * CELL_NODE_BYTES, counts->blocks * CELL_NODE_BYTES,
                GL_R32UI, zero);
    return cells_pass(store, cube, grid, &(struct cell_pass){"CELLS_MARK", texels, 0}, error);
}

static bool fill_blocks(struct ldc_store *store, unsigned which, uint32_t grid, struct gpu_buffer *counter,
                        struct cell_counts *counts, struct error *error)
{
    struct ldc_cube *cube = &store->cubes[which];
    if (!cells_pass(store, cube, grid, &(struct cell_pass){"CELLS_COUNT", counts->blocks, counts->blocks}, error))
        return false;
    gpu_buffer_read(store->device, counter, 0, counts, sizeof *counts);
    if (!reserve_entries(store, which, (uint64_t)counts->entries + counts->further, error))
        return false;
    /* From now on where the next further entry goes. */
    const uint32_t further = cube->first_entry + counts->entries;
    gpu_buffer_write(store->device, counter, offsetof(struct cell_counts, further), &further, sizeof further);
    gpu_buffer_bind_image(store->device, &store->entries, IMAGE_LDC_ENTRIES, GL_R32UI);
    return cells_pass(store, cube, grid, &(struct cell_pass){"CELLS_FILL", texel_count(cube), 0}, error);
}

static bool build_cells(struct ldc_store *store, unsigned which, uint32_t grid, struct error *error)
{
    static const char *const reaches[] = {"CELLS_REACH_X", "CELLS_REACH_Y", "CELLS_REACH_Z"};
    struct gpu_device *device = store->device;
    struct ldc_cube *cube = &store->cubes[which];
    struct cell_counts counts = {.lower_nodes = {grid, grid, grid, 0}};
    struct gpu_buffer counter = {0};
    cube->first_entry = cube->entry_count = 0;
    for (unsigned i = 0; i < which; i++)
        if (store->cubes[i].resolution)
            cube->first_entry = store->cubes[i].first_entry + store->cubes[i].entry_count;
    if (!gpu_buffer_upload(device, &counter, &counts, sizeof counts, error))
        return false;
    gpu_buffer_bind_storage(&counter, BIND_TRACER_0);
    gpu_buffer_bind_texels(device, &store->texels, UNIT_TRACER_0, GL_RGBA32UI);
    gpu_buffer_bind_texels(device, &store->geometry, UNIT_TRACER_1, GL_RG32UI);
    bool ok = place_blocks(store, which, grid, &counter, &counts, error) &&
              (counts.blocks == 0 || fill_blocks(store, which, grid, &counter, &counts, error));
    gpu_buffer_finish(device, &counter);
    for (int k = 0; ok && k < 3; k++)
        ok =
            cells_pass(store, cube, grid, &(struct cell_pass){reaches[k], (uint64_t)grid * grid * grid, 0}, error);
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
