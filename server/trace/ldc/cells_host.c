/* SPDX-License-Identifier: MIT */
/* The cells of a cube by the host, in place of ldc/cells.comp. Software GL shares its memory with the host, and
 * its compute shaders read and write lane by lane. A thread takes as many rows of an image as a node has cells: of
 * one image no other thread writes to these nodes, so nothing is atomic, and all is in the same order each time.
 */
#include "trace/ldc/cells.h"

#include "base/parallel.h"
#include "ldc/layout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NODE_CELLS (1u << LDC_NODE_SHIFT)
/* The cells of a sample: the first one along its axis, their number, and of each whether nothing was in it before.
 */
#define SPAN_COUNT_SHIFT 16u
#define SPAN_FIRST_SHIFT 24u

struct host_pass;

/* A texel of an image, where its column of cells lies in the grid. */
struct column {
    uint32_t node;      /* the first of its nodes */
    uint32_t part, bit; /* of the cells in a node's part and in a block: what u and v add to their numbers */
};

typedef void pass_sample(struct host_pass *pass, const struct column *column, uint32_t sample, uint32_t *further);

struct host_pass {
    struct ldc_cells *cells;
    const struct ldc_cube *cube;
    const uint32_t (*texels)[4], (*geometry)[2];
    uint32_t (*nodes)[4], (*entries)[4];
    pass_sample *handle;
    uint32_t axis, node_stride, shift; /* along the axis: of nodes, and of the numbers of parts */
};

static uint64_t parts_of(const uint32_t words[4])
{
    return (uint64_t)words[1] << 32 | words[0];
}

/* As ldc/plane.glsl has it. */
static float reach_of(uint32_t normal_bits, uint32_t axis)
{
    const float x = fabsf((float)(int16_t)(normal_bits & 0xffff)) / 32767.0f;
    const float y = fabsf((float)(int16_t)(normal_bits >> 16)) / 32767.0f;
    const float z = 1.0f - x - y;
    const float lean[3] = {z < 0 ? 1.0f - y : x, z < 0 ? 1.0f - x : y, fabsf(z)};
    const float along = lean[(axis + 1) % 3] + lean[(axis + 2) % 3];
    const float reach = (0.5f + LDC_SLACK) * along / lean[axis];
    return (reach < LDC_SPAN ? reach : LDC_SPAN) + LDC_ROUNDING;
}

static uint32_t cell_at(float depth, float last_cell)
{
    return (uint32_t)(depth > 0 ? depth < last_cell ? depth : last_cell : 0);
}

static uint32_t span_of(const struct host_pass *pass, const uint32_t geometry[2])
{
    const float reach = reach_of(geometry[1], pass->axis), last_cell = (float)(pass->cube->resolution - 1);
    float depth;
    memcpy(&depth, &geometry[0], sizeof(depth));
    const uint32_t first = cell_at(depth - reach, last_cell), last = cell_at(depth + reach, last_cell);
    return first | (last - first + 1) << SPAN_COUNT_SHIFT;
}

/* ---- what is done with a sample ---- */

static void mark_blocks_of(struct host_pass *pass, const struct column *column, uint32_t sample, uint32_t *further)
{
    (void)further;
    const uint32_t span = span_of(pass, pass->geometry[sample]);
    const uint32_t first = span & 0xffff, last = first + (span >> SPAN_COUNT_SHIFT) - 1;
    pass->cells->spans[sample - pass->cube->first_sample] = span;
    for (uint32_t block = first >> 2; block <= last >> 2; block++) {
        const uint32_t part = column->part + ((block & 3u) << pass->shift);
        pass->nodes[column->node + (block >> 2) * pass->node_stride][part >> 5] |= 1u << (part & 31u);
    }
}

/* The number of a part's data, behind that of all occupied parts before it. */
static uint32_t place_of(const uint32_t words[4], uint32_t part)
{
    return words[2] + (uint32_t)__builtin_popcountll(parts_of(words) & ((UINT64_C(1) << part) - 1));
}

static uint32_t *block_of(const struct host_pass *pass, const struct column *column, uint32_t cell)
{
    const uint32_t part = column->part + ((cell >> 2 & 3u) << pass->shift);
    return pass->nodes[place_of(pass->nodes[column->node + (cell >> LDC_NODE_SHIFT) * pass->node_stride], part)];
}

static void mark_cells_of(struct host_pass *pass, const struct column *column, uint32_t sample, uint32_t *further)
{
    uint32_t *span = &pass->cells->spans[sample - pass->cube->first_sample], *block = NULL;
    const uint32_t first = *span & 0xffff, count = *span >> SPAN_COUNT_SHIFT;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t cell = first + i, bit = column->bit + ((cell & 3u) << pass->shift);
        block = block && (cell & 3u) > 0 ? block : block_of(pass, column, cell);
        const bool is_first = (block[bit >> 5] >> (bit & 31u) & 1u) == 0;
        block[bit >> 5] |= 1u << (bit & 31u);
        *span |= (uint32_t)is_first << (SPAN_FIRST_SHIFT + i);
        *further += !is_first;
    }
}

/* Samples come in descending order: each goes before those that are in the cell already. */
static void fill_cells_of(struct host_pass *pass, const struct column *column, uint32_t sample, uint32_t *further)
{
    const uint32_t span = pass->cells->spans[sample - pass->cube->first_sample], *block = NULL;
    const uint32_t first = span & 0xffff, count = span >> SPAN_COUNT_SHIFT & 0xff;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t cell = first + i;
        block = block && (cell & 3u) > 0 ? block : block_of(pass, column, cell);
        uint32_t *entry = pass->entries[place_of(block, column->bit + ((cell & 3u) << pass->shift))];
        uint32_t next = 0;
        if ((span >> (SPAN_FIRST_SHIFT + i) & 1u) == 0) {
            next = (*further)++;
            memcpy(pass->entries[next], entry, sizeof(*pass->entries));
        }
        entry[0] = sample | pass->axis << LDC_ENTRY_AXIS_SHIFT;
        entry[1] = next;
        entry[2] = pass->geometry[sample][0];
        entry[3] = pass->geometry[sample][1];
    }
}

/* ---- passes over samples ---- */

/* The texels of some rows, which are in one row of nodes. */
static void do_rows(void *context, uint32_t row)
{
    struct host_pass *pass = context;
    struct ldc_cells *cells = pass->cells;
    const uint32_t n = pass->cube->resolution, grid = cells->grid, strides[3] = {1, grid, grid * grid};
    const uint32_t u_axis = (pass->axis + 1) % 3, v_axis = (pass->axis + 2) % 3;
    const uint32_t end = (row + 1) * NODE_CELLS < n ? (row + 1) * NODE_CELLS : n;
    uint32_t *further = &cells->further[pass->axis * grid + row], count = *further;
    for (uint32_t v = row * NODE_CELLS; v < end; v++) {
        const uint32_t(*texels)[4] = &pass->texels[pass->cube->first_texel + (pass->axis * n + v) * n];
        for (uint32_t u = 0; u < n; u++) {
            const struct column column = {
                .node = pass->cube->first_node + (u >> LDC_NODE_SHIFT) * strides[u_axis] + row * strides[v_axis],
                .part = (u >> 2 & 3u) << 2 * u_axis | (v >> 2 & 3u) << 2 * v_axis,
                .bit = (u & 3u) << 2 * u_axis | (v & 3u) << 2 * v_axis,
            };
            for (uint32_t i = texels[u][1] & LDC_TEXEL_COUNT_MASK; i-- > 0;)
                pass->handle(pass, &column, texels[u][0] + i, &count);
        }
    }
    *further = count;
}

/* Image after image, as they write to the same nodes. */
static void over_samples(struct host_pass *pass, pass_sample *handle)
{
    const uint32_t grid = pass->cells->grid, strides[3] = {1, grid, grid * grid};
    pass->handle = handle;
    for (uint32_t axis = 3; axis-- > 0;) {
        pass->axis = axis;
        pass->node_stride = strides[axis];
        pass->shift = 2 * axis;
        parallel_run(parallel_processors(), grid, do_rows, pass);
    }
}

/* ---- buffers ---- */

enum { OPENED_BUFFERS = 4 };

static int list_opened(struct ldc_store *store, struct gpu_buffer *buffers[OPENED_BUFFERS])
{
    struct gpu_buffer *all[OPENED_BUFFERS] = {&store->nodes, &store->texels, &store->geometry, &store->entries};
    memcpy(buffers, all, sizeof(all));
    return store->entries.name ? OPENED_BUFFERS : OPENED_BUFFERS - 1;
}

static bool with_buffers(struct ldc_cells *cells, void (*work)(struct host_pass *pass), struct error *error)
{
    struct gpu_buffer *buffers[OPENED_BUFFERS];
    void *opened[OPENED_BUFFERS] = {0};
    struct gpu_device *device = cells->store->device;
    const int count = list_opened(cells->store, buffers);
    if (!gpu_buffers_open(device, buffers, count, opened, error))
        return false;
    struct host_pass pass = {.cells = cells,
                             .cube = &cells->store->cubes[cells->which],
                             .nodes = opened[0],
                             .texels = opened[1],
                             .geometry = opened[2],
                             .entries = opened[3]};
    work(&pass);
    gpu_buffers_close(device, buffers, count);
    return true;
}

/* ---- what cells.c does with shaders elsewhere ---- */

static void mark_and_place_blocks(struct host_pass *pass)
{
    struct ldc_cell_counts *counts = &pass->cells->counts;
    const uint32_t grid = pass->cells->grid;
    over_samples(pass, mark_blocks_of);
    for (uint32_t i = 0; i < grid * grid * grid; i++) {
        uint32_t *node = pass->nodes[pass->cube->first_node + i];
        const uint32_t place[3] = {i % grid, i / grid % grid, i / (grid * grid)};
        if (parts_of(node) == 0)
            continue;
        node[2] = pass->cube->first_node + grid * grid * grid + counts->blocks;
        counts->blocks += (uint32_t)__builtin_popcountll(parts_of(node));
        for (int k = 0; k < 3; k++) {
            counts->lower_nodes[k] = place[k] < counts->lower_nodes[k] ? place[k] : counts->lower_nodes[k];
            counts->upper_nodes[k] = place[k] > counts->upper_nodes[k] ? place[k] : counts->upper_nodes[k];
        }
    }
}

bool ldc_cells_host_blocks(struct ldc_cells *cells, struct error *error)
{
    const uint32_t samples = cells->store->cubes[cells->which].sample_count;
    cells->spans = malloc((size_t)samples * sizeof(*cells->spans));
    cells->further = calloc(3 * (size_t)cells->grid, sizeof(*cells->further));
    if (!cells->spans || !cells->further)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the cells of %u samples", samples);
    return with_buffers(cells, mark_and_place_blocks, error);
}

static void mark_and_count_cells(struct host_pass *pass)
{
    struct ldc_cell_counts *counts = &pass->cells->counts;
    const uint32_t grid = pass->cells->grid;
    uint32_t(*blocks)[4] = &pass->nodes[pass->cube->first_node + grid * grid * grid];
    over_samples(pass, mark_cells_of);
    for (uint32_t i = 0; i < counts->blocks; i++) {
        blocks[i][2] = pass->cube->first_entry + counts->entries;
        counts->entries += (uint32_t)__builtin_popcountll(parts_of(blocks[i]));
    }
    /* From here on: where those of a row begin. */
    for (uint32_t i = 0; i < 3 * grid; i++) {
        const uint32_t count = pass->cells->further[i];
        pass->cells->further[i] = pass->cube->first_entry + counts->entries + counts->further;
        counts->further += count;
    }
}

bool ldc_cells_host_count(struct ldc_cells *cells, struct error *error)
{
    return with_buffers(cells, mark_and_count_cells, error);
}

static void fill_cells(struct host_pass *pass)
{
    over_samples(pass, fill_cells_of);
}

bool ldc_cells_host_fill(struct ldc_cells *cells, struct error *error)
{
    return with_buffers(cells, fill_cells, error);
}

/* ---- the empty space around empty nodes ---- */

/* Nodes of all octants of directions: the sides of the empty cubes that begin there, with a border beyond the
 * grid, where all is empty. */
struct host_reach {
    const struct host_pass *pass;
    uint8_t *sides;
};

static uint8_t *sides_of(const struct host_reach *reach, uint32_t octant)
{
    const size_t row = (size_t)reach->pass->cells->grid + 1;
    return &reach->sides[octant * row * row * row];
}

/* Of a node whose coordinates count along the octant, from where its directions come. */
static uint32_t node_along(uint32_t grid, uint32_t octant, const uint32_t at[3])
{
    uint32_t place[3];
    for (int k = 0; k < 3; k++)
        place[k] = octant >> k & 1u ? grid - 1 - at[k] : at[k];
    return (place[2] * grid + place[1]) * grid + place[0];
}

static uint8_t smaller(uint8_t a, uint8_t b)
{
    return a < b ? a : b;
}

/* A cube is one larger than the smallest of the seven that begin beside it. */
static void reach_along(void *context, uint32_t octant)
{
    const struct host_reach *reach = context;
    const uint32_t grid = reach->pass->cells->grid, row = grid + 1, plane = row * row;
    uint8_t *sides = sides_of(reach, octant);
    memset(sides, BLOCK_REACH_MAX, (size_t)plane * row);
    for (uint32_t z = grid; z-- > 0;)
        for (uint32_t y = grid; y-- > 0;)
            for (uint32_t x = grid; x-- > 0;) {
                const uint32_t node = node_along(grid, octant, (const uint32_t[3]){x, y, z});
                uint8_t *here = &sides[z * plane + y * row + x], side = here[1];
                for (uint32_t k = 0; k < 2; k++)
                    side = smaller(side, smaller(here[row + k], smaller(here[plane + k], here[plane + row + k])));
                side = (uint8_t)(side < BLOCK_REACH_MAX ? side + 1u : BLOCK_REACH_MAX);
                *here = parts_of(reach->pass->nodes[reach->pass->cube->first_node + node]) == 0 ? side : 0;
            }
}

static void write_reaches(const struct host_reach *reach)
{
    const uint32_t grid = reach->pass->cells->grid, row = grid + 1;
    for (uint32_t octant = 0; octant < 8; octant++) {
        const uint8_t *sides = sides_of(reach, octant);
        for (uint32_t z = 0; z < grid; z++)
            for (uint32_t y = 0; y < grid; y++)
                for (uint32_t x = 0; x < grid; x++) {
                    const uint32_t node = node_along(grid, octant, (const uint32_t[3]){x, y, z});
                    const uint32_t side = sides[(z * row + y) * row + x];
                    reach->pass->nodes[reach->pass->cube->first_node + node][2] |= side << 4 * octant;
                }
    }
}

static void reach(struct host_pass *pass)
{
    const struct host_reach all = {pass, pass->cells->sides};
    parallel_run(parallel_processors(), 8, reach_along, (void *)&all);
    write_reaches(&all);
}

bool ldc_cells_host_reach(struct ldc_cells *cells, struct error *error)
{
    const size_t row = (size_t)cells->grid + 1;
    cells->sides = malloc(8 * row * row * row);
    if (!cells->sides)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the nodes of a layered depth cube");
    return with_buffers(cells, reach, error);
}
