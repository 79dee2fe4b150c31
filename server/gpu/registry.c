/* SPDX-License-Identifier: MIT */
#include "gpu/registry.h"

#include <epoxy/gl.h>
#include <stdlib.h>

struct object {
    enum gpu_object_kind kind;
    unsigned name;
};

struct gpu_registry {
    struct object *objects;
    size_t count, capacity;
};

struct gpu_registry *gpu_registry_create(void)
{
    return calloc(1, sizeof(struct gpu_registry));
}

void gpu_registry_destroy(struct gpu_registry *registry)
{
    if (!registry)
        return;
    free(registry->objects);
    free(registry);
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
    if (registry->count == registry->capacity) {
        size_t capacity = registry->capacity ? registry->capacity * 2 : 64;
        struct object *objects = realloc(registry->objects, capacity * sizeof(*objects));
        if (!objects)
            return 0;
        registry->objects = objects;
        registry->capacity = capacity;
    }
    unsigned name = create_name(kind);
    if (name)
        registry->objects[registry->count++] = (struct object){kind, name};
    return name;
}

void gpu_object_destroy(struct gpu_registry *registry, enum gpu_object_kind kind, unsigned name)
{
    if (!name)
        return;
    /* The newest objects tend to go first. */
    for (size_t i = registry->count; i-- > 0;) {
        if (registry->objects[i].kind == kind && registry->objects[i].name == name) {
            delete_name(kind, name);
            registry->objects[i] = registry->objects[--registry->count];
            return;
        }
    }
}

void gpu_registry_destroy_all(struct gpu_registry *registry)
{
    while (registry->count > 0) {
        struct object object = registry->objects[--registry->count];
        delete_name(object.kind, object.name);
    }
}

size_t gpu_registry_count(const struct gpu_registry *registry, enum gpu_object_kind kind)
{
    size_t count = 0;
    for (size_t i = 0; i < registry->count; i++)
        count += registry->objects[i].kind == kind;
    return count;
}
