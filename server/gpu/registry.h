/* SPDX-License-Identifier: MIT */
/* List of every living GL object, so that a context can be emptied. */
#ifndef FARLIGHT_GPU_REGISTRY_H
#define FARLIGHT_GPU_REGISTRY_H

#include <stddef.h>

enum gpu_object_kind {
    GPU_BUFFER,
    GPU_TEXTURE_2D,
    GPU_TEXTURE_2D_ARRAY,
    GPU_TEXTURE_BUFFER,
    GPU_FRAMEBUFFER,
    GPU_PROGRAM,
    GPU_TIMESTAMP_QUERY,
    GPU_VERTEX_ARRAY,
    GPU_OBJECT_KIND_COUNT
};

struct gpu_registry;

struct gpu_registry *gpu_registry_create(void);               /* NULL: out of memory */
void gpu_registry_destroy(struct gpu_registry *registry);     /* frees the list, not the objects; accepts NULL */
void gpu_registry_destroy_all(struct gpu_registry *registry); /* destroys all remaining objects */
size_t gpu_registry_count(const struct gpu_registry *registry, enum gpu_object_kind kind);
/* Makes an object; 0: out of memory. */
unsigned gpu_object_create(struct gpu_registry *registry, enum gpu_object_kind kind);
/* Deletes an object of this registry; name 0 is ignored. */
void gpu_object_destroy(struct gpu_registry *registry, enum gpu_object_kind kind, unsigned name);

#endif
