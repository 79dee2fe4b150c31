/* SPDX-License-Identifier: MIT */
/* Units that build the nodes of the quadtrees, level by level. */
#include "trace/quadtree/nodes.h"

#include "gpu/program.h"

#include "shared/path.h"

#include <epoxy/gl.h>
#include <stdlib.h>

#define NODE_BYTES 8u
#define ERROR_BYTES 4u
/* Nodes per unit: some milliseconds. */
#define UNIT_ITEMS (1u << 17) /* times step_scale */

static uint32_t slice_count(const struct quadtree_uniforms *uniforms)
{
    return uniforms->faces * uniforms->layers;
}

static uint32_t slice_texels(const struct quadtree_uniforms *uniforms)
{
    return uniforms->padded_width * uniforms->padded_height;
}

uint64_t quadtree_nodes_count(const struct quadtree_uniforms *uniforms)
{
    return (uint64_t)slice_count(uniforms) * uniforms->slice_nodes;
}

static bool has_levels(const struct quadtree_uniforms *uniforms)
{
    return uniforms->slice_nodes > slice_texels(uniforms);
}

/* Stages of a slice. The order of all stages: leaves and level 1 of each slice, then each level above of all
 * slices together, then the nearest depths; or only the leaves of each slice. */
static uint32_t stages_a_slice(const struct quadtree_uniforms *uniforms)
{
    return has_levels(uniforms) ? 2 : 1;
}

static uint32_t slice_stages(const struct quadtree_uniforms *uniforms)
{
    return stages_a_slice(uniforms) * slice_count(uniforms);
}

static uint32_t stage_count(const struct quadtree_uniforms *uniforms)
{
    return slice_stages(uniforms) + (has_levels(uniforms) ? QUADTREE_TOP - 1 + 1 : 0);
}

static uint32_t stage_level(const struct quadtree_uniforms *uniforms, uint32_t stage)
{
    const uint32_t slices = slice_stages(uniforms);
    return stage < slices ? stage % stages_a_slice(uniforms) : stage - slices + 2;
}

/* Invocations of a stage; the last one has a few. */
static uint64_t stage_items(const struct quadtree_uniforms *uniforms, uint32_t stage)
{
    const uint32_t slices = stage < slice_stages(uniforms) ? 1 : slice_count(uniforms);
    const uint32_t level = stage_level(uniforms, stage);
    return has_levels(uniforms) && stage + 1 == stage_count(uniforms)
               ? uniforms->faces
               /* Four leaves per invocation. */
               : (uint64_t)(slice_texels(uniforms) >> 2 * (level > 0 ? level : 1)) * slices;
}

/* ---- stages ---- */

static uint32_t unit_items(const struct quadtree_store *store)
{
    return UNIT_ITEMS * store->device->facts.step_scale;
}

bool quadtree_nodes_begin(struct quadtree_node_build *build, struct quadtree_store *store, struct error *error)
{
    const struct quadtree_uniforms *uniforms = &store->uniforms;
    struct gpu_device *device = store->device;
    const uint64_t count = quadtree_nodes_count(uniforms);
    const uint64_t above = count - (uint64_t)slice_count(uniforms) * slice_texels(uniforms);
    if (count + uniforms->faces > device->facts.texture_buffer_texels_max || count > INT32_MAX / 2) {
        error_set(error, ERROR_LIMIT, "quadtree_resolution", "%llu nodes are more than the device takes",
                  (unsigned long long)count);
        return error_remedy(error, "take a lower resolution, or fewer layers");
    }
    build->stage = 0;
    build->first = 0;
    return gpu_buffer_reserve(device, &store->nodes, (count + uniforms->faces) * NODE_BYTES, error) &&
           gpu_buffer_reserve(device, &build->planes, (size_t)slice_texels(uniforms) * NODE_BYTES, error) &&
           gpu_buffer_reserve(device, &build->errors, above * ERROR_BYTES, error);
}

static const struct gpu_program *program_get(const struct quadtree_store *store, const char *path,
                                             const struct gpu_define *defines, struct error *error)
{
    const struct gpu_program_source source = {.compute = path, .defines = defines};
    return gpu_program_get(store->device, &source, error);
}

static bool make_leaves(struct quadtree_node_build *build, struct quadtree_store *store, struct gpu_scene *scene,
                        uint32_t slice, uint64_t count, struct error *error)
{
    struct gpu_define defines[4] = {{0}};
    unsigned n = 0;
    if (scene->has_spheres)
        defines[n++] = (struct gpu_define){"HAS_SPHERES", "1"};
    if (scene->has_spheres && scene->has_cutout)
        defines[n++] = (struct gpu_define){"HAS_CUTOUT", "1"};
    if (scene->disc_count > 0)
        defines[n++] = (struct gpu_define){"HAS_DISCS", "1"};
    const struct gpu_program *program = program_get(store, "quadtree/leaves.comp", defines, error);
    if (!program)
        return false;
    gpu_scene_bind(scene);
    gpu_texture_bind(&store->visible, UNIT_QUADTREE_VISIBLE);
    gpu_buffer_bind_texels(store->device, &store->nodes, UNIT_QUADTREE_NODES, GL_RG32UI);
    const bool apart = has_levels(&store->uniforms); /* a later stage copies them to the tree */
    struct gpu_buffer *leaves = apart ? &build->planes : &store->nodes;
    const uint32_t first_leaf = apart ? 0 : slice * store->uniforms.slice_nodes;
    gpu_buffer_bind_image(store->device, leaves, IMAGE_QUADTREE_PLANES, GL_RG32UI);
    gpu_uniform_uint(program, "first_leaf", first_leaf);
    gpu_uniform_uint(program, "slice", slice);
    gpu_uniform_uint(program, "layer", slice % store->uniforms.layers);
    gpu_uniform_uint(program, "first_item", (uint32_t)build->first);
    if (count > 0)
        gpu_dispatch(store->device, program, count);
    return true;
}

/* Makes a level: level 1 from the leaves of one slice. */
static bool make_level(struct quadtree_node_build *build, struct quadtree_store *store, uint32_t slice,
                       uint32_t level, uint64_t count, struct error *error)
{
    const struct gpu_define defines[] = {{level == 1 ? "NODES_OF_LEAVES" : NULL, "1"}, {NULL, NULL}};
    const struct gpu_program *program = program_get(store, "quadtree/nodes.comp", defines, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(store->device, &build->planes, UNIT_QUADTREE_PLANES, GL_RG32UI);
    gpu_buffer_bind_texels(store->device, &store->nodes, UNIT_QUADTREE_NODES, GL_RG32UI);
    gpu_buffer_bind_texels(store->device, &build->errors, UNIT_QUADTREE_ERRORS, GL_R32F);
    gpu_buffer_bind_image(store->device, &store->nodes, IMAGE_QUADTREE_NODES, GL_RG32UI);
    gpu_buffer_bind_image(store->device, &build->errors, IMAGE_QUADTREE_ERRORS, GL_R32F);
    gpu_uniform_uint(program, "slice", slice);
    gpu_uniform_uint(program, "level", level);
    gpu_uniform_uint(program, "first_item", (uint32_t)build->first);
    if (count > 0)
        gpu_dispatch(store->device, program, count);
    return true;
}

/* Finds the depth of the nearest surface of each face. */
static bool find_nearest(struct quadtree_store *store, struct error *error)
{
    const struct gpu_program *program = program_get(store, "quadtree/nearest.comp", NULL, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(store->device, &store->nodes, UNIT_QUADTREE_NODES, GL_RG32UI);
    gpu_buffer_bind_image(store->device, &store->nodes, IMAGE_QUADTREE_NODES, GL_RG32UI);
    gpu_dispatch(store->device, program, store->uniforms.faces);
    return true;
}

enum tracer_progress quadtree_nodes_step(struct quadtree_node_build *build, struct quadtree_store *store,
                                         struct gpu_scene *scene, struct error *error)
{
    const struct quadtree_uniforms *uniforms = &store->uniforms;
    const uint32_t slices = slice_stages(uniforms),
                   slice = build->stage < slices ? build->stage / stages_a_slice(uniforms) : 0;
    const uint32_t level = stage_level(uniforms, build->stage);
    const uint64_t left = stage_items(uniforms, build->stage) - build->first;
    const uint64_t count = left < unit_items(store) ? left : unit_items(store);
    bool good;
    gpu_push_group(store->device, "quadtree nodes");
    gpu_buffer_bind_uniform(&store->uniform_buffer, UNIFORM_QUADTREE);
    if (level == 0)
        good = make_leaves(build, store, scene, slice, count, error);
    else if (build->stage + 1 < stage_count(uniforms))
        good = make_level(build, store, slice, level, count, error);
    else
        good = find_nearest(store, error);
    gpu_pop_group(store->device);
    if (!good)
        return TRACER_FAILED;
    build->first = count < left ? build->first + count : 0;
    build->stage += count == left;
    return build->stage < stage_count(uniforms) ? TRACER_MORE : TRACER_DONE;
}

void quadtree_nodes_finish(struct quadtree_node_build *build, struct gpu_device *device)
{
    gpu_buffer_finish(device, &build->planes);
    gpu_buffer_finish(device, &build->errors);
    *build = (struct quadtree_node_build){0};
}

uint64_t quadtree_nodes_bytes(const struct quadtree_node_build *build)
{
    return (uint64_t)build->planes.capacity_bytes + build->errors.capacity_bytes;
}
