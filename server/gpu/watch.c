/* SPDX-License-Identifier: MIT */
/* Time stamps round dispatches. */
#include "gpu/watch.h"

#include "gpu/registry.h"

#include <epoxy/gl.h>

void gpu_watch_begin(struct gpu_device *device, struct gpu_watch *watch)
{
    *watch = (struct gpu_watch){0};
    for (int i = 0; i < 2; i++)
        watch->queries[i] = gpu_object_create(device->registry, GPU_TIMESTAMP_QUERY);
    device->watch = watch;
}

void gpu_watch_end(struct gpu_device *device)
{
    for (int i = 0; i < 2; i++) {
        gpu_object_destroy(device->registry, GPU_TIMESTAMP_QUERY, device->watch->queries[i]);
        device->watch->queries[i] = 0;
    }
    device->watch = NULL;
}

static bool has_queries(const struct gpu_watch *watch)
{
    return watch && watch->queries[0] && watch->queries[1];
}

void gpu_watch_before(struct gpu_device *device)
{
    if (has_queries(device->watch))
        glQueryCounter(device->watch->queries[0], GL_TIMESTAMP);
}

void gpu_watch_after(struct gpu_device *device, unsigned program)
{
    struct gpu_watch *watch = device->watch;
    GLuint64 ns[2] = {0};
    if (!has_queries(watch))
        return;
    glQueryCounter(watch->queries[1], GL_TIMESTAMP);
    for (int i = 0; i < 2; i++)
        glGetQueryObjectui64v(watch->queries[i], GL_QUERY_RESULT, &ns[i]);
    watch->count++;
    if (ns[1] <= ns[0] || ns[1] - ns[0] <= watch->longest_ns)
        return;
    watch->longest_ns = ns[1] - ns[0];
    watch->longest_program = program;
}
