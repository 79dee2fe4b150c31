/* SPDX-License-Identifier: MIT */
#include "tests/bench/plain_pass.h"

#include "gpu/texture.h"
#include "trace/raster/box.h"
#include "trace/raster/draw.h"

#include <epoxy/gl.h>

#include <stdlib.h>
#include <string.h>

#define RESOLUTION_DEFAULT 1024

struct plain_pass {
    struct tracer base;
    struct axes_draw draw;
    struct gpu_texture depth;
    struct gpu_framebuffer framebuffer;
    uint32_t resolution;
};

static void plain_destroy(struct tracer *tracer)
{
    struct plain_pass *pass = (struct plain_pass *)tracer;
    gpu_framebuffer_finish(pass->draw.device, &pass->framebuffer);
    gpu_texture_finish(pass->draw.device, &pass->depth);
    axes_draw_finish(&pass->draw);
    free(pass);
}

static struct tracer *plain_create(struct gpu_device *device, const struct tracer_options *options,
                                   struct error *error)
{
    struct plain_pass *pass = calloc(1, sizeof(*pass));
    if (!pass) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a pass");
        return NULL;
    }
    pass->resolution = options->bench.baseline_side ? options->bench.baseline_side : RESOLUTION_DEFAULT;
    axes_draw_init(&pass->draw, device);
    if (gpu_texture_reserve_array(device, &pass->depth, GL_DEPTH_COMPONENT32F, pass->resolution, pass->resolution,
                                  3, error) &&
        gpu_framebuffer_create(device, &pass->framebuffer, NULL, 0, &pass->depth, error))
        return &pass->base;
    plain_destroy(&pass->base);
    return NULL;
}

static bool draw(struct plain_pass *pass, struct gpu_scene *scene, const uint32_t *instances, uint32_t count,
                 struct error *error)
{
    static const struct gpu_define all_images[] = {{"ALL_IMAGES", "1"}, {0}};
    static const float farthest = 1;
    struct axes_box box;
    if (!axes_box_place(&box, scene, instances, count, pass->resolution, error) ||
        !axes_draw_prepare(&pass->draw, scene, instances, count, error))
        return false;
    struct axes_pass axes = {
        .defines = all_images,
        .cutouts_ignored = true,
        .cell_world = box.cell_world,
        .resolution = pass->resolution,
    };
    memcpy(axes.lower_world, box.lower_world, sizeof(axes.lower_world));
    gpu_scene_bind(scene);
    glDepthMask(GL_TRUE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glClearNamedFramebufferfv(pass->framebuffer.name, GL_DEPTH, 0, &farthest);
    glBindFramebuffer(GL_FRAMEBUFFER, pass->framebuffer.name);
    const bool drawn = axes_draw(&pass->draw, scene, &axes, error);
    glDisable(GL_DEPTH_TEST);
    return drawn;
}

static enum tracer_progress plain_update(struct tracer *tracer, struct gpu_scene *scene,
                                         const struct tracer_update *update, struct error *error)
{
    (void)update;
    uint32_t *instances = NULL, count = 0;
    const bool done = axes_list_instances(scene, &instances, &count, error) &&
                      (count == 0 || draw((struct plain_pass *)tracer, scene, instances, count, error));
    glFinish();
    free(instances);
    return tracer_progress_of(done);
}

static bool plain_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                              const struct ray_range *rays, struct error *error)
{
    (void)tracer, (void)scene, (void)state, (void)rays;
    return error_set(error, ERROR_UNSUPPORTED, "--form", "a plain pass can be built only");
}

const struct tracer_impl plain_pass_impl = {
    .name = "plain",
    .depends_on = CHANGED_GEOMETRY | CHANGED_DEFORMED | CHANGED_INSTANCES,
    .create = plain_create,
    .destroy = plain_destroy,
    .update = plain_update,
    .trace_range = plain_trace_range,
};
