// SPDX-License-Identifier: MIT
// Passes that refit a tree of a deformed geometry.
#include "trace/tree/refit.h"

#include "gpu/program.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>
#include <stdlib.h>

#define TEXEL_BYTES 16u
#define PART_ALIGNMENT 256u /* maximum that OpenGL lets a device require */

bool bvh_refit_init(struct bvh_refit *refit, struct gpu_device *device, struct bvh_refit_plan *plan,
                    struct error *error)
{
    *refit = (struct bvh_refit){0};
    if (plan->record_count == 0)
        return true;
    if (!gpu_buffer_upload(device, &refit->records, plan->records, plan->record_count * sizeof(*plan->records),
                           error))
        return false;
    if (!gpu_buffer_upload(device, &refit->corners, plan->corners,
                           plan->triangle_count * 4 * sizeof(*plan->corners), error))
        return false;
    refit->record_count = plan->record_count;
    refit->leaf_count = plan->leaf_count;
    refit->steps = plan->steps;
    refit->step_count = plan->step_count;
    plan->steps = NULL;
    return true;
}

void bvh_refit_finish(struct bvh_refit *refit, struct gpu_device *device)
{
    gpu_buffer_finish(device, &refit->records);
    gpu_buffer_finish(device, &refit->corners);
    free(refit->steps);
    *refit = (struct bvh_refit){0};
}

/* Binds a part of a buffer as storage from the nearest offset that the device allows; returns the number of
 * texels between that offset and the part. */
static uint32_t bind_part(unsigned binding, const struct gpu_buffer *buffer, uint64_t first_texel, uint64_t texels)
{
    uint32_t before = (uint32_t)(first_texel % (PART_ALIGNMENT / TEXEL_BYTES));
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, buffer->name,
                      (GLintptr)((first_texel - before) * TEXEL_BYTES),
                      (GLsizeiptr)((before + texels) * TEXEL_BYTES));
    return before;
}

static void dispatch(struct gpu_device *device, const struct gpu_program *program, uint32_t first, uint32_t count)
{
    gpu_uniform_uint(program, "first_record", first);
    gpu_uniform_uint(program, "record_count", count);
    gpu_dispatch(device, program, count);
}

bool bvh_refit_bounds(struct bvh_refit *refit, struct gpu_device *device, const struct bvh_refit_place *place,
                      struct error *error)
{
    const struct gpu_define of_leaves[] = {
        {"REFIT_LEAVES", "1"}, {place->close_offset ? "REFIT_CLOSE" : NULL, "1"}, {NULL, NULL}};
    const struct gpu_program_source leaf_source = {.compute = "tree/refit_bounds.comp", .defines = of_leaves};
    const struct gpu_program_source source = {.compute = "tree/refit_bounds.comp"};
    const struct gpu_program *leaves = gpu_program_get(device, &leaf_source, error);
    const struct gpu_program *above = leaves ? gpu_program_get(device, &source, error) : NULL;
    if (!above)
        return false;
    gpu_buffer_bind_texels(device, &refit->records, UNIT_TRACER_0, GL_RGBA32UI);
    uint32_t first_box = bind_part(BIND_TRACER_1, place->boxes, (uint64_t)place->first_box * BVH_REFIT_BOX_TEXELS,
                                   (uint64_t)refit->record_count * BVH_REFIT_BOX_TEXELS);
    gpu_buffer_bind_texels(device, &refit->corners, UNIT_TRACER_1, GL_RGBA32UI);
    uint32_t first_texel =
        bind_part(BIND_TRACER_0, place->primitives, place->first_texel, 2 * (uint64_t)place->close_texels);
    gpu_uniform_uint(leaves, "first_box", first_box);
    gpu_uniform_uint(leaves, "first_texel", first_texel);
    gpu_uniform_uint(leaves, "close_texels", place->close_texels);
    gpu_uniform_uint(leaves, "first_vertex", place->first_vertex);
    gpu_uniform_uint(leaves, "close_offset", place->close_offset);
    dispatch(device, leaves, 0, refit->leaf_count);
    gpu_uniform_uint(above, "first_box", first_box);
    for (uint32_t i = 0; i < refit->step_count; i++)
        dispatch(device, above, refit->steps[i].first, refit->steps[i].count);
    return true;
}

bool bvh_refit_write(struct bvh_refit *refit, struct gpu_device *device, const struct bvh_refit_place *place,
                     const struct bvh_form *settings, const struct bvh_grid *grid, struct error *error)
{
    struct gpu_define defines[3] = {{NULL, NULL}};
    size_t n = 0;
    if (settings->wide)
        defines[n++] = (struct gpu_define){"BVH_WIDE", "1"};
    if (settings->spheres)
        defines[n++] = (struct gpu_define){"BVH_SPHERES", "1"};
    else if (bvh_is_packed(settings))
        defines[n++] = (struct gpu_define){"BVH_PACKED", "1"};
    if (settings->one_order)
        defines[n++] = (struct gpu_define){"BVH_ONE_ORDER", "1"};
    const struct gpu_program_source source = {.compute = "tree/refit_write.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(device, &source, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(device, &refit->records, UNIT_TRACER_0, GL_RGBA32UI);
    gpu_buffer_bind_texels(device, place->boxes, UNIT_TRACER_1, GL_RGBA32UI);
    uint64_t each = bvh_element_bytes(settings) / TEXEL_BYTES;
    uint32_t first_texel =
        bind_part(BIND_TRACER_0, place->elements, place->first_element * each, place->element_count * each);
    gpu_uniform_uint(program, "first_box", place->first_box);
    gpu_uniform_uint(program, "first_texel", first_texel);
    if (bvh_is_packed(settings)) {
        gpu_uniform_vec(program, "grid_lower", 3, grid->lower);
        gpu_uniform_vec(program, "cells_per_unit", 3, grid->cells_per_unit);
    }
    const uint32_t first = settings->wide ? refit->leaf_count : 0; /* a leaf has no node */
    dispatch(device, program, first, refit->record_count - first);
    return true;
}
