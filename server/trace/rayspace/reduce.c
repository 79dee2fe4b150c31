// SPDX-License-Identifier: MIT
#include "trace/rayspace/reduce.h"

#include "gpu/barrier.h"
#include "gpu/program.h"
#include "gpu/registry.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>
#include <stddef.h>

/* Of a pass: its slots take 20 MiB. */
#define PAIRS_MAX (1u << 18)
#define DRAW_BYTES 16u /* arguments of glDrawArraysIndirect */

uint32_t rayspace_reduction_pairs(const struct gpu_device *device, uint32_t pairs)
{
    const uint64_t texels = device->facts.texture_buffer_texels_max / RAYSPACE_LISTS;
    const uint64_t fitting = texels / RAYSPACE_CHUNK_SLOTS * RAYSPACE_CHUNK;
    const uint32_t most = fitting < PAIRS_MAX ? (uint32_t)fitting : PAIRS_MAX;
    return pairs < most ? pairs : most;
}

static bool make_objects(struct gpu_device *device, struct rayspace_reduction *reduction, struct error *error)
{
    if (!reduction->framebuffer)
        reduction->framebuffer = gpu_object_create(device->registry, GPU_FRAMEBUFFER);
    bool made = reduction->framebuffer != 0;
    for (unsigned list = 0; list < RAYSPACE_LISTS; list++) {
        if (!reduction->queries[list])
            reduction->queries[list] = gpu_object_create(device->registry, GPU_PRIMITIVES_QUERY);
        made = made && reduction->queries[list];
    }
    if (!made) {
        gpu_note_loss(device, error);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a framebuffer and its queries");
    }
    glNamedFramebufferParameteri(reduction->framebuffer, GL_FRAMEBUFFER_DEFAULT_WIDTH, 1);
    glNamedFramebufferParameteri(reduction->framebuffer, GL_FRAMEBUFFER_DEFAULT_HEIGHT, 1);
    return true;
}

bool rayspace_reduction_reserve(struct gpu_device *device, struct rayspace_reduction *reduction,
                                enum rayspace_reduce way, uint32_t pairs, struct error *error)
{
    const uint32_t slots = ((pairs - 1) / RAYSPACE_CHUNK + 1) * RAYSPACE_CHUNK_SLOTS;
    const uint32_t segments = (slots - 1) / RAYSPACE_SEGMENT + 1;
    const size_t slot_bytes = (size_t)slots * RAYSPACE_PAIR_BYTES;
    reduction->way = way;
    reduction->slot_count = slots;
    if (!gpu_buffer_reserve(device, &reduction->slots, slot_bytes, error))
        return false;
    if (way == RAYSPACE_REDUCE_SEGMENTS)
        return gpu_buffer_reserve(device, &reduction->packed, slot_bytes, error) &&
               gpu_buffer_reserve(device, &reduction->segments, (size_t)segments * RAYSPACE_SEGMENT_BYTES, error);
    return gpu_buffer_reserve(device, &reduction->packed, RAYSPACE_LISTS * slot_bytes, error) &&
           gpu_buffer_reserve(device, &reduction->draw, DRAW_BYTES, error) &&
           make_objects(device, reduction, error);
}

static const struct gpu_program *program_of(struct gpu_device *device, const struct rayspace_lists *lists,
                                            const char *compute, const struct gpu_define *defines,
                                            struct error *error)
{
    const struct gpu_program_source source = {.compute = compute, .defines = defines};
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
    const bool in_segments = reduction->way == RAYSPACE_REDUCE_SEGMENTS;
    const struct gpu_define defines[] = {{in_segments ? "REDUCE_SEGMENTS" : NULL, "1"}, {0}};
    const struct gpu_program *program = program_of(device, lists, "rayspace/reduce_place.comp", defines, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(device, &reduction->packed, UNIT_RAYSPACE_SLOTS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&reduction->segments, BIND_RAYSPACE_SEGMENTS);
    gpu_buffer_bind_storage(lists->pairs, BIND_RAYSPACE_PAIRS);
    gpu_buffer_bind_storage(lists->leaves, BIND_RAYSPACE_LEAVES);
    gpu_buffer_bind_storage(lists->put_off, BIND_RAYSPACE_PUT_OFF);
    gpu_uniform_uint(program, "to", lists->to);
    gpu_uniform_uint(program, "later", lists->later);
    gpu_uniform_uint(program, "list_slots", reduction->slot_count);
    dispatch_over_slots(program, lists);
    return true;
}

/* ---- by segments ---- */

static bool reduce_segments(struct gpu_device *device, struct rayspace_reduction *reduction,
                            const struct rayspace_lists *lists, struct error *error)
{
    const struct gpu_program *reduce = program_of(device, lists, "rayspace/reduce_segments.comp", NULL, error);
    const struct gpu_program *scan = program_of(device, lists, "rayspace/reduce_scan.comp", NULL, error);
    if (!reduce || !scan)
        return false;
    gpu_buffer_bind_texels(device, &reduction->slots, UNIT_RAYSPACE_SLOTS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&reduction->packed, BIND_RAYSPACE_PACKED);
    gpu_buffer_bind_storage(&reduction->segments, BIND_RAYSPACE_SEGMENTS);
    dispatch_over_slots(reduce, lists);
    gpu_dispatch(device, scan, 1);
    return true;
}

/* ---- by a geometry shader ---- */

static const size_t written_at[RAYSPACE_LISTS] = {offsetof(struct rayspace_control, written),
                                                  offsetof(struct rayspace_control, leaves_written),
                                                  offsetof(struct rayspace_control, put_off)};

/* The counts go from the queries to the device's own words, and nobody waits for them. */
static void take_counts(struct gpu_device *device, const struct rayspace_reduction *reduction,
                        const struct rayspace_lists *lists)
{
    gpu_await(device, GL_QUERY_BUFFER_BARRIER_BIT);
    glBindBuffer(GL_QUERY_BUFFER, lists->control->name);
    for (unsigned list = 0; list < RAYSPACE_LISTS; list++)
        glGetQueryObjectuiv(reduction->queries[list], GL_QUERY_RESULT, (void *)written_at[list]);
    glBindBuffer(GL_QUERY_BUFFER, 0);
}

static void draw_slots(struct gpu_device *device, struct rayspace_reduction *reduction,
                       const struct gpu_program *program)
{
    const size_t list_bytes = (size_t)reduction->slot_count * RAYSPACE_PAIR_BYTES;
    gpu_buffer_bind_texels(device, &reduction->slots, UNIT_RAYSPACE_SLOTS, GL_RGBA32UI);
    glBindFramebuffer(GL_FRAMEBUFFER, reduction->framebuffer);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, reduction->draw.name);
    glEnable(GL_RASTERIZER_DISCARD);
    gpu_await(device, GL_TRANSFORM_FEEDBACK_BARRIER_BIT);
    gpu_program_use(device, program);
    for (unsigned list = 0; list < RAYSPACE_LISTS; list++) {
        glBindBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, list, reduction->packed.name,
                          (GLintptr)(list * list_bytes), (GLsizeiptr)list_bytes);
        glBeginQueryIndexed(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, list, reduction->queries[list]);
    }
    glBeginTransformFeedback(GL_POINTS);
    glDrawArraysIndirect(GL_POINTS, NULL);
    glEndTransformFeedback();
    for (unsigned list = 0; list < RAYSPACE_LISTS; list++) {
        glEndQueryIndexed(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, list);
        glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, list, 0);
    }
    glDisable(GL_RASTERIZER_DISCARD);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

static bool reduce_by_geometry(struct gpu_device *device, struct rayspace_reduction *reduction,
                               const struct rayspace_lists *lists, struct error *error)
{
    const struct gpu_program_source source = {.vertex = "rayspace/reduce.vert",
                                              .geometry = "rayspace/reduce.geom"};
    const struct gpu_program *draw = gpu_program_get(device, &source, error);
    const struct gpu_program *arguments = program_of(device, lists, "rayspace/reduce_draw.comp", NULL, error);
    if (!draw || !arguments)
        return false;
    gpu_buffer_bind_storage(&reduction->draw, BIND_RAYSPACE_DRAW);
    gpu_dispatch(device, arguments, 1);
    draw_slots(device, reduction, draw);
    take_counts(device, reduction, lists);
    return true;
}

bool rayspace_reduction_run(struct gpu_device *device, struct rayspace_reduction *reduction,
                            const struct rayspace_lists *lists, struct error *error)
{
    const bool reduced = reduction->way == RAYSPACE_REDUCE_SEGMENTS
                             ? reduce_segments(device, reduction, lists, error)
                             : reduce_by_geometry(device, reduction, lists, error);
    return reduced && place(device, reduction, lists, error);
}

uint64_t rayspace_reduction_bytes(const struct rayspace_reduction *reduction)
{
    return reduction->slots.capacity_bytes + reduction->packed.capacity_bytes +
           reduction->segments.capacity_bytes + reduction->draw.capacity_bytes;
}

void rayspace_reduction_finish(struct gpu_device *device, struct rayspace_reduction *reduction)
{
    gpu_buffer_finish(device, &reduction->slots);
    gpu_buffer_finish(device, &reduction->packed);
    gpu_buffer_finish(device, &reduction->segments);
    gpu_buffer_finish(device, &reduction->draw);
    gpu_object_destroy(device->registry, GPU_FRAMEBUFFER, reduction->framebuffer);
    for (unsigned list = 0; list < RAYSPACE_LISTS; list++)
        gpu_object_destroy(device->registry, GPU_PRIMITIVES_QUERY, reduction->queries[list]);
    *reduction = (struct rayspace_reduction){0};
}
