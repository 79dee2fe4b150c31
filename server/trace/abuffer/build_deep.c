/* SPDX-License-Identifier: MIT */
/* Sorts long lists on the host: a loop over more than ABUFFER_LIST_MAX samples would be cut short on some
 * devices. Few texels, if any, have such lists. */
#include "trace/abuffer/build_state.h"

#include <stdlib.h>

struct abuffer_node { /* abuffer/layout.h */
    uint32_t next, depth, bits, id;
};

struct abuffer_deep {
    struct abuffer_node *nodes, *sorted;
    uint32_t (*samples)[2], *ids;
    uint32_t *texels; /* texels with long lists */
    uint32_t place;   /* where the next list goes in the store's samples */
};

static int compare(const void *a, const void *b)
{
    const struct abuffer_node *left = a, *right = b;
    if (left->depth != right->depth) /* depths are not negative: their bits ascend as they do */
        return left->depth < right->depth ? -1 : 1;
    return (left->id > right->id) - (left->id < right->id);
}

/* Twin of sample_bits() in abuffer/run.glsl. */
static uint32_t sample_bits(uint32_t bits, int64_t winding)
{
    int64_t stored = winding + ABUFFER_WINDING_ZERO, maximum = ABUFFER_WINDING_MASK;
    stored = stored < 0 ? 0 : stored > maximum ? maximum : stored;
    return (bits & ABUFFER_NODE_NORMAL) | (uint32_t)stored << ABUFFER_WINDING_SHIFT |
           (bits & ABUFFER_NODE_CLOSED ? ABUFFER_SAMPLE_BODY : 0);
}

/* Sorts the list that begins at `head` and counts its winding. Returns its length. */
static uint32_t sort_list(struct abuffer_deep *lists, uint32_t head)
{
    uint32_t count = 0;
    int64_t winding = 0;
    for (; head != 0; head = lists->nodes[head - 1].next)
        lists->sorted[count++] = lists->nodes[head - 1];
    qsort(lists->sorted, count, sizeof(*lists->sorted), compare);
    for (uint32_t i = 0; i < count; i++) {
        const struct abuffer_node *node = &lists->sorted[i];
        if (node->bits & ABUFFER_NODE_CLOSED)
            winding += node->bits & ABUFFER_NODE_LEAVES ? -1 : 1;
        lists->samples[i][0] = node->depth;
        lists->samples[i][1] = sample_bits(node->bits, winding);
        lists->ids[i] = node->id;
    }
    return count;
}

static void write_list(struct abuffer_task *task, struct abuffer_deep *lists, uint32_t texel)
{
    struct gpu_device *device = task->builder->device;
    struct abuffer_store *store = task->store;
    uint32_t head;
    gpu_buffer_read(device, &task->builder->heads, texel * sizeof(head), &head, sizeof(head));
    uint32_t count = sort_list(lists, head);
    uint32_t words[2] = {lists->place, count};
    gpu_buffer_write(device, &store->texels, (size_t)texel * ABUFFER_TEXEL_BYTES, words, sizeof(words));
    gpu_buffer_write(device, &store->samples, (size_t)lists->place * ABUFFER_SAMPLE_BYTES, lists->samples,
                     (size_t)count * ABUFFER_SAMPLE_BYTES);
    gpu_buffer_write(device, &store->ids, (size_t)lists->place * ABUFFER_ID_BYTES, lists->ids,
                     (size_t)count * ABUFFER_ID_BYTES);
    store->depth_max = count > store->depth_max ? count : store->depth_max;
    lists->place += count;
}

void abuffer_deep_end(struct abuffer_task *task)
{
    struct abuffer_deep *lists = task->deep;
    if (!lists)
        return;
    free(lists->nodes);
    free(lists->sorted);
    free(lists->samples);
    free(lists->ids);
    free(lists->texels);
    free(lists);
    task->deep = NULL;
}

bool abuffer_deep_begin(struct abuffer_task *task, uint32_t *items, struct error *error)
{
    struct abuffer_builder *builder = task->builder;
    const size_t nodes = task->counts.nodes, left = nodes - task->counts.samples, deep = task->counts.deep;
    *items = task->counts.deep;
    if (deep == 0)
        return true;
    struct abuffer_deep *lists = task->deep = calloc(1, sizeof(*lists));
    if (lists)
        *lists = (struct abuffer_deep){
            .nodes = malloc(nodes * sizeof(struct abuffer_node)),
            .sorted = malloc(left * sizeof(struct abuffer_node)),
            .samples = malloc(left * sizeof(*lists->samples)),
            .ids = malloc(left * sizeof(*lists->ids)),
            .texels = malloc(deep * sizeof(*lists->texels)),
            .place = task->counts.samples,
        };
    if (!lists || !lists->nodes || !lists->sorted || !lists->samples || !lists->ids || !lists->texels)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory to sort %zu samples", left);
    gpu_buffer_read(builder->device, &builder->nodes, 0, lists->nodes, nodes * sizeof(struct abuffer_node));
    gpu_buffer_read(builder->device, &builder->deep, 0, lists->texels, deep * sizeof(*lists->texels));
    return true;
}

bool abuffer_deep_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error)
{
    (void)error;
    for (uint32_t i = first; i < end; i++)
        write_list(task, task->deep, task->deep->texels[i]);
    return true;
}
