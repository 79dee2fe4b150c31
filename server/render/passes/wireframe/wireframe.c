/* SPDX-License-Identifier: MIT */
#include "render/passes/wireframe/wireframe.h"

#include "shared/path.h"

#include <epoxy/gl.h>

bool wireframe_paint(struct render_context *context, struct error *error)
{
    if (!(context->request.wireframe > 0.0f))
        return true;
    const struct gpu_define defines[] = {{context->scene->has_motion ? "HAS_MOTION" : NULL, "1"}, {0}};
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = context_use_with(context, "render/wireframe.comp", defines, error);
    if (program) {
        context_bind_hits(context);
        gpu_buffer_bind_storage(&context->hits, BIND_HITS);
        gpu_uniform_uint(program, "ray_count", context->ray_count);
        gpu_uniform_float(program, "half_width", context->request.wireframe / 2.0f);
        gpu_dispatch(context->device, program, context->ray_count);
    }
    context_span_end(context);
    return program && gpu_check(context->device, "edges of triangles", error);
}
