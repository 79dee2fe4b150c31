/* SPDX-License-Identifier: MIT */
/* The pass of a wave through the cubes. */
#include "trace/ldc/trace.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "trace/ldc/levels.h"
#include "trace/program.h"

#include <epoxy/gl.h>
#include <stdio.h>

static void set_cube(const struct gpu_program *program, unsigned slot, const struct ldc_cube *cube,
                     const struct ldc_level_layout *layout)
{
    const struct {
        const char *name;
        uint32_t value;
    } whole[] = {
        {"ldc_resolution", cube->resolution}, {"ldc_first_texel", cube->first_texel},
        {"ldc_first_node", cube->first_node}, {"ldc_row", layout->row},
        {"ldc_grid", layout->grid},
    };
    char name[32];
    for (size_t i = 0; i < sizeof(whole) / sizeof(*whole); i++) {
        snprintf(name, sizeof(name), "%s[%u]", whole[i].name, slot);
        gpu_uniform_int(program, name, (int32_t)whole[i].value);
    }
    const float place[4] = {cube->lower_world[0], cube->lower_world[1], cube->lower_world[2], cube->cell_world};
    snprintf(name, sizeof(name), "ldc_place[%u]", slot);
    gpu_uniform_vec(program, name, 4, place);
    const float lower[3] = {(float)cube->lower_cells[0], (float)cube->lower_cells[1], (float)cube->lower_cells[2]};
    const float upper[3] = {(float)cube->upper_cells[0], (float)cube->upper_cells[1], (float)cube->upper_cells[2]};
    snprintf(name, sizeof(name), "ldc_lower[%u]", slot);
    gpu_uniform_vec(program, name, 3, lower);
    snprintf(name, sizeof(name), "ldc_upper[%u]", slot);
    gpu_uniform_vec(program, name, 3, upper);
}

static void bind(struct ldc_store *store, bool cells)
{
    gpu_buffer_bind_texels(store->device, &store->texels, UNIT_TRACER_0, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &store->quads, UNIT_TRACER_1, GL_RGBA32F);
    gpu_buffer_bind_texels(store->device, &store->geometry, UNIT_TRACER_2, GL_RG32UI);
    gpu_buffer_bind_texels(store->device, &store->surface, UNIT_TRACER_3, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &store->nodes, UNIT_TRACER_4, cells ? GL_RGBA32UI : GL_RG32F);
    gpu_buffer_bind_texels(store->device, &store->entries, UNIT_TRACER_5, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &store->primitives, UNIT_TRACER_6, GL_RG32UI);
}

/* Maximum of rounds for each cube, with R cells along a side and at most L samples in a texel: a ray passes 3 R
 * cells, 3 R / 4 blocks and 3 R / 16 nodes, each step leading to the next; in a cell it tests the samples of
 * three texels. Image by image it is less: 2 R texels of each image and the nodes above them, down to each and
 * on from it. */
static uint64_t ldc_rounds_of_a_ray(const struct ldc_store *store)
{
    uint64_t rounds = 0;
    for (unsigned i = 0; i < LDC_CUBES_MAX; i++)
        rounds += store->cubes[i].resolution * (18 + 9 * (uint64_t)store->cubes[i].layers_kept);
    return rounds;
}

bool ldc_intersect(struct ldc_store *store, struct gpu_scene *scene, const struct ray_range *rays,
                   const struct tracer_options *options, struct error *error)
{
    static const struct ldc_cube nothing = {.cell_world = 1};
    const struct ldc_cube *cubes[LDC_CUBES_MAX] = {&nothing};
    unsigned cube_count = 0;
    for (unsigned i = 0; i < LDC_CUBES_MAX; i++)
        if (store->cubes[i].resolution)
            cubes[cube_count++] = &store->cubes[i];
    cube_count = cube_count ? cube_count : 1;
    char number_of_cubes[12];
    snprintf(number_of_cubes, sizeof(number_of_cubes), "%u", cube_count);
    const struct ldc_level_layout layout = ldc_level_layout_of(store, cubes[0]->resolution, options);
    struct gpu_define defines[4] = {{"LDC_CUBES", number_of_cubes}};
    size_t n = 1;
    if (layout.cells)
        defines[n++] = (struct gpu_define){"LDC_CELLS", "1"};
    if (options->ldc.form == TRACER_FORM_PAPER)
        defines[n++] = (struct gpu_define){"LDC_TOLERANCE", "1"};
    const struct trace_program_source source = {
        .traverse = "ldc/traverse.glsl",
        .defines = defines,
        .rays_a_dispatch = trace_rays_a_dispatch(store->device, ldc_rounds_of_a_ray(store)),
    };
    const struct gpu_program *program = trace_program_get(scene, rays->wave, &source, error);
    if (!program)
        return false;
    bind(store, layout.cells);
    for (unsigned i = 0; i < cube_count; i++) {
        const struct ldc_level_layout own = ldc_level_layout_of(store, cubes[i]->resolution, options);
        set_cube(program, i, cubes[i], &own);
    }
    trace_program_run(program, scene, rays, &source);
    return true;
}
