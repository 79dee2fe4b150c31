// SPDX-License-Identifier: MIT
/* Order in which a tree's boxes are refitted after its primitives have moved. */
#include "trace/tree/build.h"

#include <stdlib.h>
#include <string.h>

/* Limit of a shader's loop: software GL silently leaves the loops of an invocation after 65,535 rounds. */
#define ROUNDS_MAX 30000u

struct heights {
    uint32_t *of;     /* height of each element */
    uint32_t *rounds; /* rounds of each element's loop: its children */
    uint32_t *begin;  /* first record of each height, and their end */
    uint32_t count;
};

static bool find_heights(struct heights *heights, const struct bvh_baked *baked)
{
    uint32_t count = baked->element_count;
    heights->of = calloc(count, sizeof(*heights->of));
    heights->rounds = calloc(count, sizeof(*heights->rounds));
    if (!heights->of || !heights->rounds)
        return false;
    for (uint32_t e = count; e-- > 1;) {
        uint32_t parent = baked->parent[e], above = heights->of[e] + 1;
        heights->rounds[parent]++;
        if (heights->of[parent] < above)
            heights->of[parent] = above;
    }
    heights->count = heights->of[0] + 1;
    heights->begin = calloc((size_t)heights->count + 2, sizeof(*heights->begin));
    if (!heights->begin)
        return false;
    for (uint32_t e = 0; e < count; e++)
        heights->begin[heights->of[e] + 1]++;
    for (uint32_t h = 0; h < heights->count; h++)
        heights->begin[h + 1] += heights->begin[h];
    return true;
}

/* Makes a step of each height. False: an element has too many children. */
static bool find_steps(struct bvh_refit_plan *plan, const struct heights *heights)
{
    for (uint32_t h = 1; h < heights->count; h++)
        plan->steps[plan->step_count++] =
            (struct bvh_refit_step){heights->begin[h], heights->begin[h + 1] - heights->begin[h]};
    for (uint32_t i = 0; i < plan->record_count; i++)
        if (heights->rounds[i] > ROUNDS_MAX)
            return false;
    return true;
}

static void fill_records(struct bvh_refit_plan *plan, const struct bvh_baked *baked, const uint32_t *leaves,
                         const struct heights *heights, uint32_t *next)
{
    for (uint32_t e = 0; e < baked->element_count; e++) {
        struct bvh_refit_record *record = &plan->records[next[heights->of[e]]++];
        *record = (struct bvh_refit_record){.element = e, .size = baked->size[e], .leaf = leaves[e]};
        for (uint32_t octant = 0; octant < (baked->place ? BVH_OCTANTS : 1); octant++) {
            uint32_t place = baked->place ? baked->place[(size_t)octant * baked->element_count + e] : e;
            (octant < 4 ? record->places_0123 : record->places_4567)[octant % 4] = place;
        }
    }
}

bool bvh_refit_plan_make(struct bvh_refit_plan *plan, const struct bvh_baked *baked, const uint32_t *leaves)
{
    struct heights heights = {0};
    *plan = (struct bvh_refit_plan){.record_count = baked->element_count};
    bool ok = find_heights(&heights, baked);
    uint32_t *next = ok ? malloc(((size_t)heights.count + 1) * sizeof(*next)) : NULL;
    plan->records = malloc(baked->element_count * sizeof(*plan->records));
    plan->steps = malloc(baked->element_count * sizeof(*plan->steps)); /* no step is empty */
    ok = ok && next && plan->records && plan->steps;
    if (ok) {
        memcpy(next, heights.begin, heights.count * sizeof(*next));
        plan->leaf_count = heights.begin[1];
        fill_records(plan, baked, leaves, &heights, next);
    }
    if (!ok || !find_steps(plan, &heights))
        bvh_refit_plan_finish(plan);
    free(next);
    free(heights.of);
    free(heights.rounds);
    free(heights.begin);
    return ok;
}

void bvh_refit_plan_finish(struct bvh_refit_plan *plan)
{
    free(plan->corners);
    free(plan->records);
    free(plan->steps);
    *plan = (struct bvh_refit_plan){0};
}
