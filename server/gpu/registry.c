/* SPDX-License-Identifier: MIT */
/* Creation and destruction of GL objects by kind. */
#include "gpu/registry.h"

#include "base/hashmap.h"

#include <epoxy/gl.h>
#include <stdlib.h>

/* The registry is a map, as hundreds of jobs have 100,000 objects, and end together. */
struct gpu_registry {
    struct hashmap objects; /* by kind and name; the values are meaningless */
    size_t counts[GPU_OBJECT_KIND_COUNT];
};

struct gpu_registry *gpu_registry_create(void)
{
    return calloc(1, sizeof(struct gpu_registry));
}

void gpu_registry_destroy(struct gpu_registry *registry)
{
    if (!registry)
        return;
    hashmap_finish(&registry->objects);
    free(registry);
}

static uint64_t key_of(enum gpu_object_kind kind, unsigned name)
{
    return (uint64_t)kind << 32 | name;
}

static unsigned create_name(enum gpu_object_kind kind)
{
    GLuint name = 0;
    switch (kind) {
    case GPU_BUFFER:
        glCreateBuffers(1, &name);
        break;
    case GPU_TEXTURE_2D:
        glCreateTextures(GL_TEXTURE_2D, 1, &name);
        break;
    case GPU_TEXTURE_2D_ARRAY:
        glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
        break;
    case GPU_TEXTURE_BUFFER:
        glCreateTextures(GL_TEXTURE_BUFFER, 1, &name);
        break;
    case GPU_FRAMEBUFFER:
        glCreateFramebuffers(1, &name);
        break;
    case GPU_PROGRAM:
        name = glCreateProgram();
        break;
    case GPU_TIMESTAMP_QUERY:
        glCreateQueries(GL_TIMESTAMP, 1, &name);
        break;
    case GPU_VERTEX_ARRAY:
        glCreateVertexArrays(1, &name);
        break;
    case GPU_OBJECT_KIND_COUNT:
        break;
    }
    return name;
}

static void delete_name(enum gpu_object_kind kind, GLuint name)
{
    switch (kind) {
    case GPU_BUFFER:
        glDeleteBuffers(1, &name);
        break;
    case GPU_TEXTURE_2D:
    case GPU_TEXTURE_2D_ARRAY:
    case GPU_TEXTURE_BUFFER:
        glDeleteTextures(1, &name);
        break;
    case GPU_FRAMEBUFFER:
        glDeleteFramebuffers(1, &name);
        break;
    case GPU_PROGRAM:
        glDeleteProgram(name);
        break;
    case GPU_TIMESTAMP_QUERY:
        glDeleteQueries(1, &name);
        break;
    case GPU_VERTEX_ARRAY:
        glDeleteVertexArrays(1, &name);
        break;
    case GPU_OBJECT_KIND_COUNT:
        break;
    }
}

unsigned gpu_object_create(struct gpu_registry *registry, enum gpu_object_kind kind)
{
    unsigned name = create_name(kind);
    if (!name)
        return 0;
    if (!hashmap_put(&registry->objects, key_of(kind, name), registry)) {
        delete_name(kind, name);
        return 0;
    }
    registry->counts[kind]++;
    return name;
}

void gpu_object_destroy(struct gpu_registry *registry, enum gpu_object_kind kind, unsigned name)
{
    if (!name || !hashmap_remove(&registry->objects, key_of(kind, name)))
        return;
    delete_name(kind, name);
    registry->counts[kind]--;
}

void gpu_registry_destroy_all(struct gpu_registry *registry)
{
    size_t cursor = 0;
    uint64_t key;
    while (hashmap_next(&registry->objects, &cursor, &key, NULL))
        delete_name((enum gpu_object_kind)(key >> 32), (GLuint)key);
    hashmap_finish(&registry->objects);
    *registry = (struct gpu_registry){0};
}

size_t gpu_registry_count(const struct gpu_registry *registry, enum gpu_object_kind kind)
{
    return registry->counts[kind];
}
