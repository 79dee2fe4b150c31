/* SPDX-License-Identifier: MIT */
/* Builds a cube in one pass over the scene, which notes every fragment that falls on a texel. The first few of
 * a texel have slots of their own; the others go into a list, in any order, and then to their texels' places. */
#include "base/log.h"
#include "ldc/layout.h"
#include "shared/bindings.h"
#include "trace/ldc/build_state.h"

#include <epoxy/gl.h>

#define FRAGMENT_BYTES 16
/* Slots of a texel. A fragment with a slot costs half of one in the list, but slots are reserved for all texels
 * alike. */
#define SLOTS_FIRST 4u
#define SLOTS_BYTES_MAX ((uint64_t)512 << 20)
/* The accepted share of fragments without a slot. */
#define UNSLOTTED_SHARE 16
/* The number of slots that the last build suggests, within memory. */
static uint32_t choose_slots(const struct ldc_task *task)
{
    const struct ldc_builder *builder = task->builder;
    uint64_t texels = task->texel_count, limit = SLOTS_BYTES_MAX / LDC_ORDERED_BYTES / texels;
    uint64_t fitting = builder->device->facts.texture_buffer_texels_max / 2 / texels;
    uint64_t slots = builder->slots_texels == task->texel_count ? builder->slots : SLOTS_FIRST;
    slots = slots < limit ? slots : limit;
    return (uint32_t)(slots < fitting ? slots : fitting);
}

static void suggest_slots(struct ldc_task *task)
{
    struct ldc_builder *builder = task->builder;
    builder->slots_texels = task->texel_count;
    builder->slots = task->slots > 0 ? task->slots : 1;
    if (task->counts.places > task->counts.fragments / UNSLOTTED_SHARE)
        builder->slots *= 2;
}

static bool reserve_fragments(struct ldc_task *task, uint32_t count, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    if (count > builder->device->facts.texture_buffer_texels_max)
        return error_set(error, ERROR_LIMIT, NULL, "%u fragments; this device's texel buffers hold %llu", count,
                         (unsigned long long)builder->device->facts.texture_buffer_texels_max);
    builder->fragments_max = 0;
    if (!gpu_buffer_reserve(builder->device, &builder->fragments, (size_t)count * FRAGMENT_BYTES, error))
        return false;
    builder->fragments_max = count;
    return true;
}

static void set_lists(const void *context, const struct gpu_program *program)
{
    const struct ldc_task *task = context;
    gpu_uniform_uint(program, "texel_count", task->texel_count);
    gpu_uniform_uint(program, "slots", task->slots);
    gpu_uniform_uint(program, "fragments_max", task->builder->fragments_max);
}

static ldc_unit give_places;

static bool draw_lists(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    if (task->drawn == 0) {
        gpu_buffer_clear(device, &builder->counts, 0);
        gpu_buffer_clear(device, &builder->build, 0);
    }
    gpu_buffer_bind_image(device, &builder->counts, IMAGE_LDC_COUNTS, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->ordered, IMAGE_LDC_ORDERED, GL_RG32UI);
    gpu_buffer_bind_image(device, &builder->fragments, IMAGE_LDC_FRAGMENTS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&builder->build, BIND_LDC_BUILD_COUNTS);
    return axes_draw_bind_plain(&builder->draw, task->cube->resolution, error) &&
           ldc_draw(task, LDC_PASS_LISTS, set_lists, give_places, error);
}

/* Sorts texels with many fragments on their own. */
static bool sort_deep(struct ldc_task *task, struct error *error)
{
    task->next = ldc_pack;
    const struct gpu_program *program = ldc_use(task->builder->device, "ldc/sort.comp", error);
    if (!program)
        return false;
    ldc_bind_runs(task, program);
    gpu_dispatch(task->builder->device, program, task->counts.occupied);
    return true;
}

static ldc_unit *sort_or_pack(const struct ldc_task *task)
{
    return task->counts.layers_needed > LDC_PACK_SORTS ? sort_deep : ldc_pack;
}

/* Moves fragments without slots behind those with slots. */
static bool order(struct ldc_task *task, struct error *error)
{
    task->next = sort_or_pack(task);
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    uint64_t slot_bytes = (uint64_t)task->slots * task->texel_count * LDC_ORDERED_BYTES;
    const struct gpu_program *program = ldc_use(device, "ldc/order.comp", error);
    if (!program || !ldc_store_grow(device, &builder->ordered, slot_bytes,
                                    slot_bytes + (uint64_t)task->counts.places * LDC_ORDERED_BYTES, error))
        return false;
    gpu_buffer_bind_texels(device, &builder->fragments, UNIT_LDC_FRAGMENTS, GL_RGBA32UI);
    gpu_buffer_bind_texels(device, &builder->places, UNIT_LDC_PLACES, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->ordered, IMAGE_LDC_ORDERED, GL_RG32UI);
    gpu_uniform_uint(program, "fragment_count", task->counts.places);
    gpu_uniform_uint(program, "texel_count", task->texel_count);
    gpu_uniform_uint(program, "slots", task->slots);
    gpu_dispatch(device, program, task->counts.places);
    return true;
}

/* Reserves the lists. False: they do not fit, or loops of the sort would be cut short. */
static bool can_list(struct ldc_task *task)
{
    struct ldc_builder *builder = task->builder;
    uint64_t texels_max = builder->device->facts.texture_buffer_texels_max, wanted = task->counts.places;
    if (task->counts.fragments_wraps > 0 || task->counts.layers_needed > LDC_LISTED_LAYERS_MAX ||
        (uint64_t)task->slots * task->texel_count + wanted > texels_max)
        return false;
    if (wanted <= builder->fragments_max)
        return true;
    wanted += wanted / 8;
    return reserve_fragments(task, (uint32_t)(wanted < texels_max ? wanted : texels_max), NULL);
}

static bool peel_instead(struct ldc_task *task)
{
    log_write(LOG_DEBUG, "trace", "layered depth cube: no room for lists of fragments, it is peeled");
    task->next = ldc_peel;
    return true;
}

static bool give_places(struct ldc_task *task, struct error *error)
{
    if (!ldc_give_places(task, UINT32_MAX, error))
        return false;
    bool complete = task->drawn_again || task->counts.places <= task->builder->fragments_max;
    if (!can_list(task))
        return peel_instead(task);
    if (!complete) { /* draw again, with memory for all */
        task->drawn_again = true;
        task->next = draw_lists;
        return true;
    }
    suggest_slots(task);
    task->next = task->counts.places > 0 ? order : sort_or_pack(task);
    return ldc_limit(task, error);
}

bool ldc_lists(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    (void)error; /* without memory it is peeled */
    task->slots = choose_slots(task);
    task->next = draw_lists;
    size_t ordered_bytes = (size_t)task->slots * task->texel_count * LDC_ORDERED_BYTES;
    bool room = builder->ordered.size_bytes >= ordered_bytes ||
                gpu_buffer_reserve(builder->device, &builder->ordered, ordered_bytes, NULL);
    room = room && (builder->fragments_max > 0 || reserve_fragments(task, task->texel_count / 4, NULL));
    return room || peel_instead(task);
}
