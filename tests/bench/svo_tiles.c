/* SPDX-License-Identifier: MIT */
/* The octree as it was published: tiles of eight children (svo/svo.h). */
#include "tests/bench/svo/svo.h"
#include "tests/bench/svo_build.h"

#include <epoxy/gl.h>

#define NODE_BYTES 4u

/* Binds what all its passes look at. */
static const struct gpu_program *use(struct svo_tree *tree, const char *path, struct error *error)
{
    const struct gpu_program *program = svo_use(tree, path, NULL, error);
    if (!program)
        return NULL;
    gpu_buffer_bind_texels(tree->device, &tree->records, UNIT_SVO_RECORDS, GL_R32UI);
    gpu_buffer_bind_image(tree->device, &tree->records, IMAGE_SVO_RECORDS, GL_R32UI);
    gpu_uniform_int(program, "levels", (int32_t)tree->levels);
    return program;
}

static bool mark(struct svo_tree *tree, uint32_t level, struct error *error)
{
    const struct gpu_program *program = use(tree, "svo/tile_mark.comp", error);
    if (!program)
        return false;
    svo_bind_fragments(tree, program);
    gpu_uniform_int(program, "level", (int32_t)level);
    gpu_dispatch(tree->device, program, tree->facts.fragments);
    return true;
}

static bool fill_leaves(struct svo_tree *tree, struct error *error)
{
    const struct gpu_program *program = use(tree, "svo/tile_leaves.comp", error);
    if (!program)
        return false;
    svo_bind_fragments(tree, program);
    gpu_buffer_bind_image(tree->device, &tree->ids, IMAGE_SVO_IDS, GL_R32UI);
    gpu_buffer_bind_image(tree->device, &tree->planes, IMAGE_SVO_PLANES, GL_R32UI);
    gpu_uniform_uint(program, "first_leaf", tree->first_leaf);
    gpu_dispatch(tree->device, program, tree->facts.fragments);
    return true;
}

bool svo_tiles_grow(struct svo_tree *tree, struct error *error)
{
    uint32_t first = 0, children = 1;
    tree->facts.records = 0;
    for (uint32_t level = 0; level < tree->levels; level++) {
        first = tree->facts.records;
        if (!svo_add_records(tree, children, NODE_BYTES, error) || !mark(tree, level, error))
            return false;
        const struct gpu_program *program = use(tree, "svo/tile_allocate.comp", error);
        if (!program)
            return false;
        children = svo_allocate(tree, program, first, tree->facts.records) - tree->facts.records;
    }
    tree->first_leaf = tree->facts.records;
    tree->facts.leaves = children;
    return svo_add_records(tree, children, NODE_BYTES, error) && svo_reserve_leaves(tree, error) &&
           fill_leaves(tree, error);
}
