/* SPDX-License-Identifier: MIT */
/* `xs`, `x` and what their braces hold. */
#include "aff.h"

#include "model.h"

#include <stdlib.h>

struct aff_group *aff_add_group(struct aff *aff)
{
    struct import_scene *scene = aff->nff.scene;
    const struct aff_block *block = &aff->blocks[aff->block];
    struct aff_group **grown, *group;

    if (aff->group_count == AFF_GROUPS_MAX) {
        import_fail(scene, word_reader_where(&aff->nff.reader), "more than %u transforms that move",
                    AFF_GROUPS_MAX);
        return NULL;
    }
    grown = import_grow(scene, aff->groups, aff->group_count, &aff->group_capacity, sizeof(*grown));
    if (!grown)
        return NULL;
    aff->groups = grown;
    group = calloc(1, sizeof(*group));
    if (!group) {
        import_fail(scene, NULL, "out of memory");
        return NULL;
    }
    group->parent = block->group;
    group->parent_from_group = block->group_from_block;
    shapes_init(&group->shapes, scene, &aff->nff.polygon_budget);
    grown[aff->group_count++] = group;
    return group;
}

void aff_group_finish(struct aff_group *group)
{
    shapes_free(&group->shapes);
    for (size_t i = 0; i < group->morph_count; i++)
        aff_morph_finish(&group->morphs[i]);
    free(group->morphs);
    free(group);
}

/* Shapes go to these from now on, with the same material. */
static void collect_in(struct aff *aff, struct shapes *shapes, const struct placement *place)
{
    shapes->material = aff->nff.shapes->material;
    shapes_place(shapes, place);
    aff->nff.shapes = shapes;
}

static void enter_block(struct aff *aff)
{
    const struct aff_block *block = &aff->blocks[aff->block];

    collect_in(aff, &aff->groups[block->group]->shapes, &block->group_from_block);
}

static bool open_block(struct aff *aff, const struct aff_block *block, const char *of)
{
    struct word_reader *reader = &aff->nff.reader;
    struct word word;

    if (!word_reader_get(reader, &word, of))
        return false;
    if (!word_is(word, "{"))
        return import_fail(aff->nff.scene, word_reader_where(reader),
                           "'{' should follow '%s', but there is '%.*s'", of, word_shown(word), word.text);
    if (aff->block == AFF_BLOCKS_MAX)
        return import_fail(aff->nff.scene, word_reader_where(reader), "more than %d transforms in one another",
                           AFF_BLOCKS_MAX);
    aff->blocks[++aff->block] = *block;
    enter_block(aff);
    return true;
}

bool aff_read_static_transform(struct aff *aff)
{
    struct aff_block block = aff->blocks[aff->block];
    double scale[3], axis[3], translation[3], rotation[4];
    struct placement own;
    float n[10];

    if (!word_reader_numbers(&aff->nff.reader, n, 10, "xs"))
        return false;
    for (int c = 0; c < 3; c++) {
        scale[c] = (double)n[c];
        axis[c] = (double)n[3 + c];
        translation[c] = (double)n[7 + c];
    }
    placement_turn(axis, (double)n[6], rotation);
    own = placement_from_parts(scale, rotation, translation);
    block.group_from_block = placement_product(&block.group_from_block, &own);
    block.spheres = 0;
    if (!placement_within(&block.group_from_block, 1e12))
        return import_fail(aff->nff.scene, word_reader_where(&aff->nff.reader),
                           "transforms in one another go beyond 1e12");
    return open_block(aff, &block, "xs");
}

bool aff_read_moving_transform(struct aff *aff)
{
    struct aff_block block = {.group_from_block = placement_identity()};
    struct aff_group *group = aff_add_group(aff);

    if (!group || !aff_read_name(aff, group->name, "x"))
        return false;
    block.group = (uint32_t)aff->group_count - 1;
    return open_block(aff, &block, "x");
}

/* What is scaled unevenly is no sphere: a node of its own scales it. */
bool aff_read_sphere(struct aff *aff, struct word word)
{
    struct aff_block *block = &aff->blocks[aff->block];
    const struct placement identity = placement_identity();
    bool read = true;

    if (!placement_is_even(&block->group_from_block)) {
        if (block->spheres == 0) {
            if (!aff_add_group(aff))
                return false;
            block->spheres = (uint32_t)aff->group_count - 1;
        }
        collect_in(aff, &aff->groups[block->spheres]->shapes, &identity);
    }
    nff_statement(&aff->nff, word, &read);
    enter_block(aff);
    return read;
}

void aff_close_block(struct aff *aff)
{
    aff->block--;
    enter_block(aff);
}
