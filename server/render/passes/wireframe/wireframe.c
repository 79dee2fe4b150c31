/* SPDX-License-Identifier: MIT */
/* Paints edges of triangles on first hits. */
#include "render/passes/wireframe/wireframe.h"

#include "shared/path.h"

#include <epoxy/gl.h>

/* Stored samples name no triangle and get no edges; eyes of a key view have no hits. */
static bool wants(const void *self, const struct render_wave *wave)
{
    (void)self;
    return wave->number == 0 && wave->frame->request.picture.wireframe > 0.0f &&
           wave->frame->request.picture.view_source != VIEW_SOURCE_LAYERS;
}

static enum pass_progress run(void *self, struct render_wave *wave, struct error *error)
{
    (void)self;
    const struct gpu_define defines[] = {{wave->frame->scene->has_motion ? "HAS_MOTION" : NULL, "1"}, {0}};
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = context_use_with(wave->device, "render/wireframe.comp", defines, error);
    if (program) {
        context_bind_hits(wave);
        gpu_buffer_bind_storage(&wave->hits, BIND_HITS);
        gpu_uniform_uint(program, "ray_count", wave->ray_count);
        gpu_uniform_float(program, "half_width", wave->frame->request.picture.wireframe / 2.0f);
        gpu_dispatch(wave->device->gpu, program, wave->ray_count);
    }
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "edges of triangles", error) ? PASS_DONE : PASS_FAILED;
}

const struct pass wireframe_pass = {.name = "wireframe", .wants = wants, .run = run};
