// SPDX-License-Identifier: MIT
// Passes that move a stream's live pairs together, segment by segment.
#include "trace/rayspace/reduce.h"

#include "gpu/program.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>
#include <stddef.h>

/* Pairs of a pass: their slots take 20 MiB. */
#define PAIRS_MAX (1u << 18)

uint32_t rayspace_reduction_pairs(const struct gpu_device *device, uint32_t pairs)
{
    const uint64_t texels = device->facts.texture_buffer_texels_max;
    const uint64_t fitting = texels / RAYSPACE_CHUNK_SLOTS * RAYSPACE_CHUNK;
    const uint32_t most = fitting < PAIRS_MAX ? (uint32_t)fitting : PAIRS_MAX;
    return pairs < most ? pairs : most;
}

bool rayspace_reduction_reserve(struct gpu_device *device, struct rayspace_reduction *reduction, uint32_t pairs,
                                struct error *error)
{
    const uint32_t slots = ((pairs - 1) / RAYSPACE_CHUNK + 1) * RAYSPACE_CHUNK_SLOTS;
    const uint32_t segments = (slots - 1) / RAYSPACE_SEGMENT + 1;
    const size_t slot_bytes = (size_t)slots * RAYSPACE_PAIR_BYTES;
    return gpu_buffer_reserve(device, &reduction->slots, slot_bytes, error) &&
           gpu_buffer_reserve(device, &reduction->packed, slot_bytes, error) &&
           gpu_buffer_reserve(device, &reduction->segments, (size_t)segments * RAYSPACE_SEGMENT_BYTES, error);
}

static const struct gpu_program *program_of(struct gpu_device *device, const struct rayspace_lists *lists,
                                            const char *compute, struct error *error)
{
    const struct gpu_program_source source = {.compute = compute};
    gpu_buffer_bind_storage(lists->control, BIND_RAYSPACE_CONTROL);
    return gpu_program_get(device, &source, error);
}

static void dispatch_over_slots(const struct gpu_program *program, const struct rayspace_lists *lists)
{
    gpu_dispatch_indirect(program, lists->control, offsetof(struct rayspace_control, pass_groups_x));
}

static bool place(struct gpu_device *device, struct rayspace_reduction *reduction,
                  const struct rayspace_lists *lists, struct error *error)
{
    const struct gpu_program *program = program_of(device, lists, "rayspace/reduce_place.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(device, &reduction->packed, UNIT_RAYSPACE_SLOTS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&reduction->segments, BIND_RAYSPACE_SEGMENTS);
    gpu_buffer_bind_storage(lists->pairs, BIND_RAYSPACE_PAIRS);
    gpu_buffer_bind_storage(lists->leaves, BIND_RAYSPACE_LEAVES);
    gpu_uniform_uint(program, "to", lists->to);
    dispatch_over_slots(program, lists);
    return true;
}

static bool reduce_segments(struct gpu_device *device, struct rayspace_reduction *reduction,
                            const struct rayspace_lists *lists, struct error *error)
{
    const struct gpu_program *reduce = program_of(device, lists, "rayspace/reduce_segments.comp", error);
    const struct gpu_program *scan = program_of(device, lists, "rayspace/reduce_scan.comp", error);
    if (!reduce || !scan)
        return false;
    gpu_buffer_bind_texels(device, &reduction->slots, UNIT_RAYSPACE_SLOTS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&reduction->packed, BIND_RAYSPACE_PACKED);
    gpu_buffer_bind_storage(&reduction->segments, BIND_RAYSPACE_SEGMENTS);
    dispatch_over_slots(reduce, lists);
    gpu_dispatch(device, scan, 1);
    return true;
}

bool rayspace_reduction_run(struct gpu_device *device, struct rayspace_reduction *reduction,
                            const struct rayspace_lists *lists, struct error *error)
{
    return reduce_segments(device, reduction, lists, error) && place(device, reduction, lists, error);
}

uint64_t rayspace_reduction_bytes(const struct rayspace_reduction *reduction)
{
    return reduction->slots.capacity_bytes + reduction->packed.capacity_bytes + reduction->segments.capacity_bytes;
}

void rayspace_reduction_finish(struct gpu_device *device, struct rayspace_reduction *reduction)
{
    gpu_buffer_finish(device, &reduction->slots);
    gpu_buffer_finish(device, &reduction->packed);
    gpu_buffer_finish(device, &reduction->segments);
}
