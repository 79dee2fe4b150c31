/* SPDX-License-Identifier: MIT */
/* The yardstick of the build: the same draws, and nothing kept of them but the nearest depths. */
#include "trace/abuffer_build_state.h"

#include <epoxy/gl.h>
#include <string.h>

static bool reserve_target(struct abuffer_builder *builder, uint32_t along, struct error *error)
{
    struct gpu_device *device = builder->device;
    if (builder->plain.name && builder->plain_depth.width == along)
        return true;
    gpu_framebuffer_finish(device, &builder->plain);
    return gpu_texture_reserve_array(device, &builder->plain_depth, GL_DEPTH_COMPONENT32F, along, along, 3,
                                     error) &&
           gpu_framebuffer_create(device, &builder->plain, NULL, 0, &builder->plain_depth, error);
}

bool abuffer_build_plain(struct abuffer_builder *builder, const struct abuffer_store *store,
                         struct scene_gpu *scene, struct error *error)
{
    static const struct gpu_define defines[] = {{"ALL_IMAGES", "1"}, {0}};
    static const GLfloat farthest = 1.0f;
    struct axes_pass pass = {
        .defines = defines,
        .cutouts_ignored = true,
        .cell_world = store->cell_world,
        .resolution = store->resolution,
    };
    memcpy(pass.lower_world, store->lower_world, sizeof(pass.lower_world));
    scene_gpu_bind(scene);
    if (!abuffer_list_instances(builder, scene, error) || !reserve_target(builder, store->resolution, error))
        return false;
    glDepthMask(GL_TRUE);
    glClearNamedFramebufferfv(builder->plain.name, GL_DEPTH, 0, &farthest);
    glBindFramebuffer(GL_FRAMEBUFFER, builder->plain.name);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    bool drawn = axes_draw(&builder->draw, scene, &pass, error);
    glDisable(GL_DEPTH_TEST);
    return drawn;
}
