/* SPDX-License-Identifier: MIT */
#include "tests/bench/svo_build.h"

#include "base/clock.h"
#include "gpu/program.h"
#include "tests/bench/svo/svo.h"
#include "trace/raster/box.h"
#include "trace/ldc/store.h"

#include <epoxy/gl.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RECORD_BYTES 16u
#define SUMS_BYTES 16u
#define FRAGMENTS_FIRST (1u << 20)

void svo_tree_init(struct svo_tree *tree, struct gpu_device *device, uint32_t resolution, enum svo_kind kind)
{
    *tree = (struct svo_tree){.device = device, .resolution = resolution, .kind = kind};
    while (1u << tree->levels < resolution)
        tree->levels++;
    while (4u << tree->top_shift < resolution)
        tree->top_shift += 2;
    axes_draw_init(&tree->draw, device);
}

#define BUFFERS(tree)                                                                                             \
    {                                                                                                             \
        &(tree)->records, &(tree)->ids, &(tree)->planes, &(tree)->fragments, &(tree)->current, &(tree)->sums,     \
            &(tree)->counts                                                                                       \
    }

void svo_tree_finish(struct svo_tree *tree)
{
    struct gpu_buffer *buffers[] = BUFFERS(tree);
    for (size_t i = 0; i < sizeof(buffers) / sizeof(*buffers); i++)
        gpu_buffer_finish(tree->device, buffers[i]);
    axes_draw_finish(&tree->draw);
}

uint64_t svo_tree_bytes(const struct svo_tree *tree)
{
    const struct gpu_buffer *buffers[] = BUFFERS(tree);
    uint64_t bytes = 0;
    for (size_t i = 0; i < sizeof(buffers) / sizeof(*buffers); i++)
        bytes += buffers[i]->capacity_bytes;
    return bytes;
}

/* ---- the cube ---- */

/* The one that A-buffers of as many texels have: leaves' cells are their texels. */
static bool place(struct svo_tree *tree, const struct gpu_scene *scene, const uint32_t *instances, uint32_t count,
                  struct error *error)
{
    struct axes_box box;
    if (!axes_box_place(&box, scene, instances, count, tree->resolution, error))
        return false;
    tree->cell_world = box.cell_world;
    memcpy(tree->lower_world, box.lower_world, sizeof(tree->lower_world));
    for (int k = 0; k < 3; k++) {
        float upper_world = box.lower_world[k], lower[3], upper[3];
        for (uint32_t i = 0; i < count; i++) {
            gpu_scene_instance_bounds(scene, instances[i], lower, upper);
            upper_world = fmaxf(upper_world, upper[k]);
        }
        tree->lower_cells[k] = 0;
        tree->upper_cells[k] =
            fminf(ceilf((upper_world - box.lower_world[k]) / box.cell_world + 1), (float)tree->resolution);
    }
    return true;
}

/* ---- the list ---- */

static void read_counts(struct svo_tree *tree, struct svo_counts *counts)
{
    gpu_buffer_read(tree->device, &tree->counts, 0, counts, sizeof(*counts));
}

static void set_list(const void *context, const struct gpu_program *program)
{
    gpu_uniform_uint(program, "fragments_max", ((const struct svo_tree *)context)->fragments_max);
}

static GLenum fragment_format(const struct svo_tree *tree)
{
    return tree->kind == SVO_KIND_CELLS ? GL_RG32UI : GL_RGBA32UI;
}

static uint32_t fragment_bytes(const struct svo_tree *tree)
{
    return tree->kind == SVO_KIND_CELLS ? 8 : 16;
}

/* Once more with room for all, where there was too little. */
static bool voxelise(struct svo_tree *tree, const struct gpu_scene *scene, struct error *error)
{
    static const struct gpu_define defines[][2] = {[SVO_KIND_CELLS] = {{0}},
                                                   [SVO_KIND_PLANES] = {{"SVO_PLANES", "1"}, {0}},
                                                   [SVO_KIND_TILES] = {{"SVO_TILES", "1"}, {0}}};
    struct axes_pass pass = {.fragment = "svo/voxelise.frag",
                             .defines = defines[tree->kind],
                             .cell_world = tree->cell_world,
                             .resolution = tree->resolution,
                             .overlap = 1,
                             .set = set_list,
                             .context = tree};
    struct gpu_device *device = tree->device;
    struct svo_counts counts = {0};
    memcpy(pass.lower_world, tree->lower_world, sizeof(pass.lower_world));
    do {
        const uint32_t wanted = counts.fragments > tree->fragments_max ? counts.fragments
                                : tree->fragments_max                  ? tree->fragments_max
                                                                       : FRAGMENTS_FIRST;
        if (wanted > device->facts.texture_buffer_texels_max)
            return error_set(error, ERROR_LIMIT, NULL, "%u fragments of an octree", wanted);
        if (!gpu_buffer_reserve(device, &tree->fragments, (size_t)wanted * fragment_bytes(tree), error))
            return false;
        tree->fragments_max = wanted;
        gpu_buffer_clear(device, &tree->counts, 0);
        gpu_buffer_bind_storage(&tree->counts, BIND_SVO_COUNTS);
        gpu_buffer_bind_image(device, &tree->fragments, IMAGE_SVO_FRAGMENTS, fragment_format(tree));
        if (!axes_draw_bind_plain(&tree->draw, tree->resolution, error) ||
            !axes_draw(&tree->draw, scene, &pass, error))
            return false;
        read_counts(tree, &counts);
    } while (counts.fragments > tree->fragments_max);
    tree->facts.fragments = counts.fragments;
    return true;
}

/* ---- the tree ---- */

const struct gpu_program *svo_use(struct svo_tree *tree, const char *path, const char *define, struct error *error)
{
    const struct gpu_define defines[] = {{define, "1"}, {0}};
    const struct gpu_program *program = gpu_program_get(
        tree->device, &(struct gpu_program_source){.compute = path, .defines = define ? defines : NULL}, error);
    return program;
}

bool svo_add_records(struct svo_tree *tree, uint32_t count, uint32_t record_bytes, struct error *error)
{
    const uint64_t before = (uint64_t)tree->facts.records * record_bytes, bytes = (uint64_t)count * record_bytes;
    if (before + bytes > tree->device->facts.storage_block_bytes_max)
        return error_set(error, ERROR_LIMIT, NULL, "an octree of more than %u records", tree->facts.records);
    if (!ldc_store_grow(tree->device, &tree->records, before, before + bytes, error))
        return false;
    glClearNamedBufferSubData(tree->records.name, GL_R32UI, (GLintptr)before, (GLsizeiptr)bytes, GL_RED_INTEGER,
                              GL_UNSIGNED_INT, NULL);
    tree->facts.records += count;
    return true;
}

uint32_t svo_allocate(struct svo_tree *tree, const struct gpu_program *program, uint32_t first, uint32_t next)
{
    struct svo_counts counts = {.fragments = tree->facts.fragments, .children = next};
    gpu_buffer_write(tree->device, &tree->counts, 0, &counts, sizeof(counts));
    gpu_buffer_bind_storage(&tree->counts, BIND_SVO_COUNTS);
    gpu_uniform_uint(program, "first_record", first);
    gpu_uniform_uint(program, "record_count", tree->facts.records - first);
    gpu_dispatch(tree->device, program, tree->facts.records - first);
    read_counts(tree, &counts);
    return counts.children;
}

void svo_bind_fragments(struct svo_tree *tree, const struct gpu_program *program)
{
    gpu_buffer_bind_texels(tree->device, &tree->fragments, UNIT_SVO_FRAGMENTS, fragment_format(tree));
    gpu_uniform_uint(program, "fragment_count", tree->facts.fragments);
}

static void bind(struct svo_tree *tree, const struct gpu_program *program)
{
    svo_bind_fragments(tree, program);
    gpu_buffer_bind_texels(tree->device, &tree->records, UNIT_SVO_RECORDS, GL_RGBA32UI);
    gpu_buffer_bind_image(tree->device, &tree->current, IMAGE_SVO_CURRENT, GL_R32UI);
}

static bool mark(struct svo_tree *tree, uint32_t shift, struct error *error)
{
    const struct gpu_program *program =
        svo_use(tree, "svo/mark.comp", shift == tree->top_shift ? "SVO_TOP" : NULL, error);
    if (!program)
        return false;
    bind(tree, program);
    gpu_buffer_bind_storage(&tree->records, BIND_SVO_MARKS);
    gpu_uniform_int(program, "shift", (int32_t)shift);
    gpu_dispatch(tree->device, program, tree->facts.fragments);
    return true;
}

/* Children of the records from `first` on; *children: how many these are. */
static bool allocate(struct svo_tree *tree, uint32_t first, bool are_leaves, uint32_t *children,
                     struct error *error)
{
    const struct gpu_program *program = svo_use(tree, "svo/allocate.comp", NULL, error);
    const uint32_t next = are_leaves ? 0 : tree->facts.records;
    if (!program)
        return false;
    gpu_buffer_bind_image(tree->device, &tree->records, IMAGE_SVO_RECORDS, GL_RGBA32UI);
    *children = svo_allocate(tree, program, first, next) - next;
    return true;
}

static bool grow(struct svo_tree *tree, struct error *error)
{
    uint32_t first = 0, children = 1;
    tree->facts.records = 0;
    for (uint32_t shift = tree->top_shift;; shift -= 2) {
        first = tree->facts.records;
        if (!svo_add_records(tree, children, RECORD_BYTES, error) || !mark(tree, shift, error) ||
            !allocate(tree, first, shift == 0, &children, error))
            return false;
        if (shift == 0)
            break;
    }
    tree->facts.leaves = children;
    return true;
}

/* ---- leaves ---- */

static bool make_planes(struct svo_tree *tree, struct error *error)
{
    const struct gpu_program *program = svo_use(tree, "svo/planes.comp", NULL, error);
    if (!program)
        return false;
    gpu_buffer_bind_image(tree->device, &tree->sums, IMAGE_SVO_SUMS, GL_R32I);
    gpu_buffer_bind_image(tree->device, &tree->planes, IMAGE_SVO_PLANES, GL_R32UI);
    gpu_uniform_uint(program, "leaf_count", tree->facts.leaves);
    gpu_dispatch(tree->device, program, tree->facts.leaves);
    return true;
}

bool svo_reserve_leaves(struct svo_tree *tree, struct error *error)
{
    const size_t leaves = tree->facts.leaves, planes = tree->kind == SVO_KIND_CELLS ? 0 : leaves;
    struct gpu_device *device = tree->device;
    if (leaves > device->facts.texture_buffer_texels_max / 4)
        return error_set(error, ERROR_LIMIT, NULL, "an octree of %zu leaves", leaves);
    if (!gpu_buffer_reserve(device, &tree->ids, leaves * sizeof(uint32_t), error) ||
        !gpu_buffer_reserve(device, &tree->planes, planes * sizeof(uint32_t), error))
        return false;
    gpu_buffer_clear(device, &tree->ids, UINT32_MAX);
    if (planes > 0)
        gpu_buffer_clear(device, &tree->planes, 0);
    return true;
}

static bool fill_leaves(struct svo_tree *tree, struct error *error)
{
    struct gpu_device *device = tree->device;
    const bool has_planes = tree->kind == SVO_KIND_PLANES;
    if (!svo_reserve_leaves(tree, error) ||
        (has_planes && !gpu_buffer_reserve(device, &tree->sums, (size_t)tree->facts.leaves * SUMS_BYTES, error)))
        return false;
    if (has_planes)
        gpu_buffer_clear(device, &tree->sums, 0);
    const struct gpu_program *program = svo_use(tree, "svo/leaves.comp", has_planes ? "SVO_PLANES" : NULL, error);
    if (!program)
        return false;
    bind(tree, program);
    gpu_buffer_bind_image(device, &tree->ids, IMAGE_SVO_IDS, GL_R32UI);
    if (has_planes)
        gpu_buffer_bind_image(device, &tree->sums, IMAGE_SVO_SUMS, GL_R32I);
    gpu_dispatch(device, program, tree->facts.fragments);
    return !has_planes || make_planes(tree, error);
}

/* From fragments to a tree of records. */
static bool grow_records(struct svo_tree *tree, struct error *error)
{
    return gpu_buffer_reserve(tree->device, &tree->current, tree->facts.fragments * sizeof(uint32_t), error) &&
           grow(tree, error) && fill_leaves(tree, error);
}

/* ---- all ---- */

static bool build(struct svo_tree *tree, struct gpu_scene *scene, struct error *error)
{
    struct gpu_device *device = tree->device;
    const uint64_t start_ns = clock_now_ns();
    if (!gpu_buffer_reserve(device, &tree->counts, sizeof(struct svo_counts), error) ||
        !voxelise(tree, scene, error))
        return false;
    tree->facts.voxelise_ns = clock_now_ns() - start_ns;
    if (tree->facts.fragments > 0 &&
        !(tree->kind == SVO_KIND_TILES ? svo_tiles_grow(tree, error) : grow_records(tree, error)))
        return false;
    glFinish();
    tree->facts.tree_ns = clock_now_ns() - start_ns - tree->facts.voxelise_ns;
    return gpu_check(device, "building an octree", error);
}

bool svo_tree_build(struct svo_tree *tree, struct gpu_scene *scene, struct error *error)
{
    uint32_t *instances = malloc((scene->instance_count + 1u) * sizeof(*instances)), count = 0;
    tree->facts = (struct svo_build_facts){0};
    if (!instances)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %u instances", scene->instance_count);
    for (uint32_t i = 0; i < scene->instance_count; i++)
        if (scene->geometries[scene->instances[i].geometry].device.primitive_count > 0)
            instances[count++] = i;
    gpu_scene_bind(scene);
    bool done = true;
    if (count > 0)
        done = place(tree, scene, instances, count, error) &&
               axes_draw_prepare(&tree->draw, scene, instances, count, error) && build(tree, scene, error);
    tree->facts.cell_world = tree->cell_world;
    free(instances);
    return done;
}
