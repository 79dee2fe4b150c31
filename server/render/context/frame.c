/* SPDX-License-Identifier: MIT */
/* Questions of passes about the frame in progress, and its uniforms on the device. */
#include "render/context/frame.h"

#include "shared/bindings.h"
#include "shared/key_view.h"
#include "shared/path.h"

#include <epoxy/gl.h>

#define AO_RAYS_DEFAULT 8               /* lambda of the paper on voxels and A-buffers */
#define AO_DISTANCE_DEFAULT (1 / 10.0f) /* a share of the scene's diagonal */

void context_bind_frame(const struct render_frame *frame)
{
    gpu_scene_bind(frame->scene);
    gpu_buffer_bind_uniform(&frame->uniform_buffer, UNIFORM_FRAME);
}

void context_bind_tiles(const struct render_frame *frame, const struct gpu_program *program)
{
    if (!frame->tiles.list)
        return;
    gpu_buffer_bind_texels(frame->device->gpu, frame->tiles.list, UNIT_KEY_TILES, GL_R32UI);
    gpu_uniform_uint(program, "first_tile", frame->tiles.first_tile);
}

/* Numbers of lights share a word with the state of emitters along a path. */
bool context_samples_emitters(const struct render_frame *frame)
{
    return frame->scene->has_emitters && frame->scene->light_count < PATH_LIGHT_MASK &&
           !(frame->tracer->impl->sampled && frame->scene->has_emissive_spheres);
}

uint32_t context_ao_rays(const struct render_frame *frame)
{
    return frame->request.light.ao_rays > 0 ? frame->request.light.ao_rays : AO_RAYS_DEFAULT;
}

float context_ao_distance(const struct render_frame *frame)
{
    float asked = frame->request.light.ao_distance;
    return asked > 0.0f ? asked : frame->scene->diagonal * AO_DISTANCE_DEFAULT;
}

bool context_upload_uniforms(struct render_frame *frame, struct error *error)
{
    return gpu_buffer_upload(frame->device->gpu, &frame->uniform_buffer, &frame->uniforms, sizeof(frame->uniforms),
                             error);
}
