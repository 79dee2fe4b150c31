/* SPDX-License-Identifier: MIT */
#include "tests/bench/svo.h"

#include "gpu/timer.h"
#include "tests/bench/svo/svo.h"
#include "tests/bench/svo_build.h"
#include "trace/program.h"

#include <epoxy/gl.h>

#include <stdio.h>
#include <stdlib.h>

#define RESOLUTION_MIN 16

struct svo {
    struct tracer base;
    struct svo_tree tree;
    struct gpu_timer *timer;
};

static void svo_destroy(struct tracer *tracer)
{
    struct svo *svo = (struct svo *)tracer;
    if (!svo)
        return;
    svo_tree_finish(&svo->tree);
    gpu_timer_destroy(svo->timer);
    free(svo);
}

static struct tracer *create(struct gpu_device *device, const struct tracer_options *options, enum svo_kind kind,
                             struct error *error)
{
    const uint32_t resolution = options->bench.baseline_side ? options->bench.baseline_side : SVO_SIDE_MAX;
    if (resolution < RESOLUTION_MIN || resolution > SVO_SIDE_MAX) {
        error_set(error, ERROR_INVALID, "options.baseline_side", "an octree has %d to %d cells along a side",
                  RESOLUTION_MIN, SVO_SIDE_MAX);
        return NULL;
    }
    struct svo *svo = calloc(1, sizeof(*svo));
    if (!svo) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer");
        return NULL;
    }
    svo_tree_init(&svo->tree, device, resolution, kind);
    svo->timer = gpu_timer_create(device);
    if (svo->timer)
        return &svo->base;
    error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer's timer");
    svo_destroy(&svo->base);
    return NULL;
}

static struct tracer *create_cells(struct gpu_device *device, const struct tracer_options *options,
                                   struct error *error)
{
    return create(device, options, SVO_KIND_CELLS, error);
}

static struct tracer *create_planes(struct gpu_device *device, const struct tracer_options *options,
                                    struct error *error)
{
    return create(device, options, SVO_KIND_PLANES, error);
}

static struct tracer *create_tiles(struct gpu_device *device, const struct tracer_options *options,
                                   struct error *error)
{
    return create(device, options, SVO_KIND_TILES, error);
}

static enum tracer_progress svo_update(struct tracer *tracer, struct gpu_scene *scene,
                                       const struct tracer_update *update, struct error *error)
{
    struct svo *svo = (struct svo *)tracer;
    gpu_timer_begin(svo->timer, STAGE_BUILD, 0);
    const bool done = svo_tree_build(&svo->tree, scene, error);
    gpu_timer_end(svo->timer);
    gpu_timer_collect(svo->timer, update->times);
    tracer->stats = (struct tracer_stats){.device_bytes = svo_tree_bytes(&svo->tree),
                                          .nodes = svo->tree.facts.records,
                                          .nodes_rebuilt = svo->tree.facts.records};
    return tracer_progress_of(done);
}

static bool svo_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                            const struct ray_range *rays, struct error *error)
{
    struct svo_tree *tree = &((struct svo *)tracer)->tree;
    const bool tiles = tree->kind == SVO_KIND_TILES;
    char top_shift[4], levels[4];
    snprintf(top_shift, sizeof(top_shift), "%u", tree->top_shift & 31);
    snprintf(levels, sizeof(levels), "%u", tree->levels & 31);
    struct gpu_define defines[] = {{"TRACER_SVO", "1"}, {"SVO_TOP_SHIFT", top_shift}, {0}, {0}};
    if (tiles)
        defines[1] = (struct gpu_define){"SVO_LEVELS", levels};
    if (tree->kind == SVO_KIND_PLANES)
        defines[2] = (struct gpu_define){"SVO_PLANES", "1"};
    const struct trace_program_source source = {.traverse = tiles ? "svo/tile_traverse.glsl" : "svo/traverse.glsl",
                                                .defines = defines};
    const struct gpu_program *program = trace_program_get(scene, &state->wave, &source, error);
    static const float nothing[3] = {0};
    if (!program)
        return false;
    gpu_buffer_bind_texels(tree->device, &tree->records, UNIT_SVO_RECORDS, tiles ? GL_R32UI : GL_RGBA32UI);
    gpu_buffer_bind_texels(tree->device, &tree->ids, UNIT_SVO_IDS, GL_R32UI);
    gpu_buffer_bind_texels(tree->device, &tree->planes, UNIT_SVO_PLANES, GL_R32UI);
    gpu_buffer_bind_texels(tree->device, &tree->draw.drawn, UNIT_SVO_DRAWN, GL_RGBA32UI);
    gpu_uniform_vec(program, "lower_world", 3, tree->lower_world);
    gpu_uniform_float(program, "cell_world", tree->cell_world);
    gpu_uniform_vec(program, "lower_cells", 3, tree->lower_cells);
    gpu_uniform_vec(program, "upper_cells", 3, tree->facts.fragments ? tree->upper_cells : nothing);
    gpu_uniform_uint(program, "first_leaf", tree->first_leaf);
    gpu_uniform_uint(program, "drawn_count", tree->draw.drawn_count);
    trace_program_run(program, scene, rays, &source);
    return true;
}

struct svo_build_facts svo_facts(const struct tracer *tracer)
{
    return ((const struct svo *)tracer)->tree.facts;
}

#define SVO_IMPL(own_name, own_create)                                                                            \
    {                                                                                                             \
        .name = own_name,                                                                                         \
        .depends_on = CHANGED_GEOMETRY | CHANGED_DEFORMED | CHANGED_INSTANCES | CHANGED_SURFACES, .still = true,  \
        .create = own_create, .destroy = svo_destroy, .update = svo_update, .trace_range = svo_trace_range        \
    }

const struct tracer_impl svo_cells_impl = SVO_IMPL("svo, cells", create_cells);
const struct tracer_impl svo_planes_impl = SVO_IMPL("svo, planes", create_planes);
const struct tracer_impl svo_tiles_impl = SVO_IMPL("svo, tiles", create_tiles);
