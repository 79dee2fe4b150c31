/* SPDX-License-Identifier: MIT */
#include "trace/ldc/levels.h"

#include "base/log.h"
#include "gpu/program.h"
#include "shared/bindings.h"
#include "ldc/layout.h"
#include "trace/ldc/cells.h"

#include <epoxy/gl.h>
#include <stdio.h>

#define RANGE_BYTES (2 * sizeof(float))
/* 4 x 4 children: half the levels of 2 x 2. */
#define PYRAMID_BITS 2

struct ldc_level_layout ldc_level_layout_of(const struct ldc_store *store, uint32_t resolution,
                                            const struct tracer_options *options)
{
    struct ldc_level_layout layout = {.blocks = options->ldc.levels == LDC_LEVELS_BLOCKS};
    if (layout.blocks) {
        uint32_t block = options->ldc.block;
        while (2u << layout.bits <= block)
            layout.bits++;
        layout.top = 1;
        layout.row = (resolution + block - 1) >> layout.bits;
        layout.image_nodes = layout.row * layout.row;
        return layout;
    }
    const bool may_have_cells = options->ldc.levels == LDC_LEVELS_AUTO && !(options->ldc.tolerance > 0);
    if (options->ldc.levels == LDC_LEVELS_CELLS || (may_have_cells && !store->no_cells)) {
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

bool ldc_levels_reserve(struct ldc_store *store, unsigned which, uint64_t node_count, uint64_t kept,
                        size_t node_bytes, struct error *error)
{
    struct gpu_device *device = store->device;
    uint64_t first = 0;
    for (unsigned i = 0; i < which; i++)
        if (store->cubes[i].resolution && store->cubes[i].first_node + store->cubes[i].node_count > first)
            first = store->cubes[i].first_node + store->cubes[i].node_count;
    uint64_t nodes = first + node_count;
    /* Word by word, which is how some write them. */
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
    for (size_t i = 0; i < sizeof(parts) / sizeof(*parts); i++) {
        char name[32];
        snprintf(name, sizeof(name), "%s_%s", parts[i].name, which);
        gpu_uniform_uint(program, name, parts[i].value);
    }
}

/* One level of them; the first time, room for all. */
static enum tracer_progress build_ranges(struct ldc_levels *levels, struct error *error)
{
    struct ldc_store *store = levels->store;
    struct ldc_cube *cube = &store->cubes[levels->at];
    const struct ldc_level_layout *layout = &levels->layout;
    const uint32_t level = ++levels->level;
    if (level == 1 &&
        !ldc_levels_reserve(store, levels->at, 3 * (uint64_t)layout->image_nodes, 0, RANGE_BYTES, error))
        return TRACER_FAILED;
    char bits[4];
    snprintf(bits, sizeof(bits), "%u", layout->bits);
    const struct gpu_define defines[] = {
        {"LDC_LEVEL_BITS", bits}, {level == 1 ? "LDC_FROM_TEXELS" : NULL, "1"}, {NULL, NULL}};
    const struct gpu_program_source source = {.compute = "ldc/levels.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(store->device, &source, error);
    if (!program)
        return TRACER_FAILED;
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
    return level < layout->top ? TRACER_MORE : TRACER_DONE;
}

static void begin_cube(struct ldc_levels *levels, unsigned which)
{
    struct ldc_store *store = levels->store;
    struct ldc_cube *cube = &store->cubes[which];
    levels->at = which;
    levels->level = 0;
    cube->node_count = cube->entry_count = 0;
    if (cube->resolution == 0)
        return;
    levels->layout = ldc_level_layout_of(store, cube->resolution, levels->options);
    if (levels->layout.cells)
        ldc_cells_begin(&levels->cells, store, which, levels->layout.grid, levels->options->bench.ldc_on_device);
}

/* A unit of the cube in hand. */
static enum tracer_progress build_levels(struct ldc_levels *levels, struct error *error)
{
    struct ldc_cube *cube = &levels->store->cubes[levels->at];
    if (cube->resolution == 0)
        return TRACER_DONE;
    enum tracer_progress progress =
        levels->layout.cells ? ldc_cells_go_on(&levels->cells, error) : build_ranges(levels, error);
    if (progress == TRACER_FAILED)
        cube->node_count = cube->entry_count = 0;
    if (progress != TRACER_MORE)
        ldc_cells_finish(&levels->cells);
    return progress;
}

/* Cells failed that were chosen automatically, as there are too many. */
static bool may_have_ranges(const struct ldc_levels *levels, const struct error *of_cells)
{
    return levels->options->ldc.levels == LDC_LEVELS_AUTO && !levels->store->no_cells &&
           (of_cells->kind == ERROR_LIMIT || of_cells->kind == ERROR_OUT_OF_MEMORY);
}

void ldc_levels_begin(struct ldc_levels *levels, struct ldc_store *store, unsigned which,
                      const struct tracer_options *options)
{
    *levels = (struct ldc_levels){.store = store, .options = options, .which = which};
    if (which == LDC_CUBE_STATIC)
        store->no_cells = false;
    begin_cube(levels, which);
}

enum tracer_progress ldc_levels_go_on(struct ldc_levels *levels, struct error *error)
{
    struct ldc_store *store = levels->store;
    struct error own = {0};
    gpu_push_group(store->device, "ldc levels");
    enum tracer_progress progress = build_levels(levels, &own);
    gpu_pop_group(store->device);
    if (progress == TRACER_FAILED && may_have_ranges(levels, &own)) {
        log_write(LOG_WARNING, "ldc", "%s: rays take the slower way by a pyramid", own.text);
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
