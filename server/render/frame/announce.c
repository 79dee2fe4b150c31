/* SPDX-License-Identifier: MIT */
/* Announces programs, so that threads compile them while the scene and the structures are brought to the device.
 */
#include "render/frame/announce.h"

#include "render/frame/check.h"
#include "render/frame/key.h"
#include "render/picture/resolve.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>

static const struct gpu_texel_formats texel_formats = {.of_unit = {[UNIT_TANGENTS] = GL_R32UI,
                                                                   [UNIT_COLOURS] = GL_RGBA16,
                                                                   [UNIT_SPHERE_MATERIALS] = GL_R32UI,
                                                                   [UNIT_TEXELS] = GL_RGBA8,
                                                                   [UNIT_SHADE_ENVIRONMENT] = GL_R32F,
                                                                   [UNIT_RAY_TIMES] = GL_R32F}};

/* Announces the program that depends on the scene's materials alone, for exact hits. A wrong guess costs
 * time, so nothing is announced if more decides. */
void announce_first(struct frame_renderer *renderer)
{
    struct frame_work *work = renderer->work;
    const struct scene *scene = renderer->scene;
    struct tracer kind = {
        .impl = frame_find_tracer(renderer, work->frame.request.tracing.tracer, "tracer", &(struct error){0})};
    const bool tells = !renderer->announced_first && kind.impl && !kind.impl->sampled &&
                       !work->frame.request.comparison.compare && !frame_is_from_layers(&renderer->request) &&
                       !work->frame.request.hidden_layer && !work->frame.integrator->lit_by_surfaces &&
                       renderer->shared->copy.revision == 0 && !renderer->motion &&
                       scene->objects[OBJECT_SPHERES].count == 0;
    renderer->announced_first = true;
    if (!tells || work->frame.request.sampling.samples == 0)
        return;
    work->frame.features = scene_features_of(scene);
    work->wave.sampled_hits = false;
    work->frame.tracer = &kind;
    gpu_program_announce(renderer->device, &texel_formats);
    wave_shading_announce_hits(&work->shading, &work->wave);
    gpu_program_announce(renderer->device, NULL);
    work->frame.tracer = NULL;
}

/* Programs of a frame that is made in one pass, as far as they depend on no structure. */
void announce_shading(struct frame_renderer *renderer)
{
    struct frame_work *work = renderer->work;
    gpu_program_announce(renderer->device, &texel_formats);
    work->wave.sampled_hits = !work->primary.rasterises && work->frame.tracer->impl->sampled;
    wave_shading_announce_shading(&work->shading, &work->wave);
    picture_announce(renderer->target, &work->wave);
    gpu_program_announce(renderer->device, NULL);
}

/* Threads compile while the calling thread continues. */
void announce_programs(struct frame_renderer *renderer)
{
    struct frame_work *work = renderer->work;
    struct wave_shading *shading = &work->shading;
    gpu_program_announce(renderer->device, &texel_formats);
    /* The longest one begins first; the rest is in the order of its use. */
    if (frame_is_eyes_pass(renderer)) {
        key_eyes_announce(&work->eyes, &work->wave);
    } else {
        work->wave.sampled_hits = !work->primary.rasterises && work->frame.tracer->impl->sampled;
        if (!work->primary.rasterises)
            primary_announce(&work->wave, false);
        wave_shading_announce_long(shading, &work->wave);
        if (work->primary.rasterises)
            primary_announce(&work->wave, true);
        wave_shading_announce(shading, &work->wave);
    }
    picture_announce(renderer->target, &work->wave);
    gpu_program_announce(renderer->device, NULL);
    renderer->announced = true;
}
