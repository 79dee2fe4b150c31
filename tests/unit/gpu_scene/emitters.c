/* SPDX-License-Identifier: MIT */
/* The tree over emitters, and how bright a part of a texture is. */
#include "gpu_scene/emission_map.h"
#include "gpu_scene/emitter_tree.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HALF_PI 1.5707964f

ALL_TESTS(NULL, NULL)

static float random_number(void)
{
    static uint32_t state = 1;
    state = state * 1664525u + 1013904223u;
    return (float)(state >> 8) / 16777216.0f;
}

/* Small boxes; every third one lies where all of them do. */
static struct emitter_bounds *some_leaves(uint32_t count)
{
    struct emitter_bounds *leaves = calloc(count, sizeof(*leaves));
    assert_non_null(leaves);
    for (uint32_t i = 0; i < count; i++) {
        const float angle = 6.0f * random_number();
        for (int k = 0; k < 3; k++) {
            leaves[i].lower[k] = i % 3 ? 10.0f * random_number() : 1.0f;
            leaves[i].upper[k] = leaves[i].lower[k] + 0.1f;
        }
        leaves[i].axis[0] = cosf(angle);
        leaves[i].axis[1] = sinf(angle);
        leaves[i].spread = i % 5 ? 0.0f : 0.3f;
        leaves[i].power = random_number();
    }
    return leaves;
}

/* The node at the end of a leaf's trail; each on the way is a sphere around the leaf's box. */
static uint32_t follow(const struct emitter_node *nodes, uint32_t trail, const struct emitter_bounds *leaf)
{
    uint32_t at = 0, depth = 0;
    for (;; depth++) {
        const float *sphere = nodes[at].centre_radius;
        for (int corner = 0; corner < 8; corner++) {
            float squared = 0.0f;
            for (int k = 0; k < 3; k++) {
                const float off = (corner >> k & 1 ? leaf->upper : leaf->lower)[k] - sphere[k];
                squared += off * off;
            }
            assert_true(sqrtf(squared) <= sphere[3] + 1e-4f); /* places are 100 m away, rounded to 2^-17 */
        }
        if (nodes[at].link & EMITTER_LEAF)
            return nodes[at].link & ~EMITTER_LEAF;
        assert_true(depth < EMITTER_DEPTH_MAX);
        at = nodes[at].link + (trail >> depth & 1u);
    }
}

TEST(every_leaf_is_at_the_end_of_its_trail)
{
    static const uint32_t counts[] = {1, 2, 3, 1000, 5000};
    for (size_t c = 0; c < sizeof(counts) / sizeof(*counts); c++) {
        struct emitter_bounds *leaves = some_leaves(counts[c]);
        struct emitter_node *nodes = calloc(2 * counts[c] - 1, sizeof(*nodes));
        uint32_t *trails = calloc(counts[c], sizeof(*trails));
        double power = 0.0;
        assert_true(nodes && trails && emitter_tree_build(leaves, counts[c], nodes, trails));
        for (uint32_t i = 0; i < counts[c]; i++) {
            assert_int_equal(follow(nodes, trails[i], &leaves[i]), i);
            power += (double)leaves[i].power;
        }
        assert_true(fabs((double)nodes[0].power - power) < 1e-4 * power);
        for (int k = 0; k < 3; k++) { /* the first leaf moves far away */
            leaves[0].lower[k] += 100.0f;
            leaves[0].upper[k] += 100.0f;
        }
        assert_true(emitter_tree_refit(leaves, counts[c], nodes));
        for (uint32_t i = 0; i < counts[c]; i++)
            assert_int_equal(follow(nodes, trails[i], &leaves[i]), i);
        free(trails);
        free(nodes);
        free(leaves);
    }
}

/* Places that halve their distance again and again would make a tree of a node a leaf. */
TEST(the_tree_is_no_deeper_than_a_trail_is_long)
{
    enum { COUNT = 200 };
    struct emitter_bounds leaves[COUNT] = {0};
    struct emitter_node nodes[2 * COUNT - 1] = {0};
    uint32_t trails[COUNT];
    for (int i = 0; i < COUNT; i++) {
        leaves[i].lower[0] = leaves[i].upper[0] = ldexpf(1.0f, i - 100);
        leaves[i].axis[2] = 1.0f;
        leaves[i].power = ldexpf(1.0f, -i / 4);
    }
    assert_true(emitter_tree_build(leaves, COUNT, nodes, trails));
    for (uint32_t i = 0; i < COUNT; i++)
        assert_int_equal(follow(nodes, trails[i], &leaves[i]), i);
}

TEST(a_cone_of_both_has_all_normals_of_either_up_to_their_sign)
{
    for (int i = 0; i < 1000; i++) {
        struct emitter_bounds *pair = some_leaves(2);
        pair[1].axis[2] = random_number();
        const float length = sqrtf(1.0f + pair[1].axis[2] * pair[1].axis[2]);
        for (int k = 0; k < 3; k++)
            pair[1].axis[k] /= length;
        const struct emitter_bounds both = emitter_bounds_union(&pair[0], &pair[1]);
        for (int k = 0; k < 2; k++) {
            const float cosine =
                both.axis[0] * pair[k].axis[0] + both.axis[1] * pair[k].axis[1] + both.axis[2] * pair[k].axis[2];
            const float needed = acosf(fminf(fabsf(cosine), 1.0f)) + pair[k].spread;
            assert_true(both.spread >= fminf(needed, HALF_PI) - 1e-3f);
        }
        free(pair);
    }
}

TEST(a_part_of_a_texture_is_as_bright_as_its_texels)
{
    enum { SIZE = 256 };
    struct scene_texture texture = {
        .base.id = 1, .value.width = SIZE, .value.height = SIZE, .value.format = TEXTURE_RGBA8_LINEAR};
    texture.texels = blob_create(SIZE * SIZE * 4);
    struct emission_map *map = malloc(sizeof(*map));
    assert_true(texture.texels && map);
    memset(texture.texels->data, 0, SIZE * SIZE * 4);
    uint8_t *texels = texture.texels->data;
    for (int y = 0; y < SIZE / 2; y++) /* the upper half shines */
        memset(texels + (size_t)y * SIZE * 4, 255, SIZE * 4);
    emission_map_init(map, &texture);
    const float bright[3][2] = {{0.1f, 0.1f}, {0.3f, 0.1f}, {0.1f, 0.3f}};
    const float dark[3][2] = {{0.1f, 0.7f}, {0.3f, 0.7f}, {0.1f, 0.9f}};
    const float rim[3][2] = {{0.1f, 0.501f}, {0.3f, 0.501f}, {0.1f, 0.9f}}; /* filtering brings some of the half */
    const float wide[3][2] = {{-3.0f, 0.1f}, {9.0f, 0.3f}, {0.1f, -5.0f}};
    const float repeated[3][2] = {{7.1f, 3.1f}, {7.3f, 3.1f}, {7.1f, 3.3f}};
    assert_true(fabsf(emission_map_mean(map, bright) - 1.0f) < 1e-5f);
    assert_true(emission_map_mean(map, dark) < 1e-9f);
    assert_true(emission_map_mean(map, rim) > 0.01f);
    assert_true(fabsf(emission_map_mean(map, wide) - 0.5f) < 1e-5f);
    assert_true(fabsf(emission_map_mean(map, repeated) - 1.0f) < 1e-5f);
    blob_unref(texture.texels);
    free(map);
}
