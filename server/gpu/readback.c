/* SPDX-License-Identifier: MIT */
/* Copies to a mapped buffer, with a number and a fence behind each. A fence alone is not enough: Mesa's zink 22.3
 * sometimes says that a fence is signalled about a millisecond before the device has come to it. */
#include "gpu/readback.h"

#include "gpu/barrier.h"
#include "gpu/registry.h"

#include <epoxy/gl.h>
#include <string.h>
#include <time.h>

#define MAP_FLAGS (GL_MAP_READ_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT)
/* Interval between two checks whether the device still lives. */
#define WAIT_NS 1000000000u
/* Pause while a copy is not there though its fence is signalled. */
#define EARLY_FENCE_NS 50000

void gpu_readback_drop(struct gpu_readback *readback)
{
    if (readback->fence)
        glDeleteSync(readback->fence);
    readback->fence = NULL;
}

void gpu_readback_finish(struct gpu_device *device, struct gpu_readback *readback)
{
    gpu_readback_drop(readback);
    /* Destroying the buffer unmaps it, too. */
    gpu_object_destroy(device->registry, GPU_BUFFER, readback->name);
    gpu_memory_give(device, readback->capacity_bytes);
    *readback = (struct gpu_readback){0};
}

static size_t number_offset(size_t capacity_bytes)
{
    return (capacity_bytes + 3) / 4 * 4;
}

static bool reserve(struct gpu_device *device, struct gpu_readback *readback, size_t size_bytes,
                    struct error *error)
{
    if (size_bytes <= readback->capacity_bytes)
        return true;
    gpu_readback_finish(device, readback);
    if (!gpu_memory_take(device, size_bytes, "a copy on its way to the host", error))
        return false;
    const GLsizeiptr bytes = (GLsizeiptr)(number_offset(size_bytes) + sizeof(readback->copies));
    readback->capacity_bytes = size_bytes;
    readback->name = gpu_object_create(device->registry, GPU_BUFFER);
    if (readback->name) {
        glNamedBufferStorage(readback->name, bytes, NULL, MAP_FLAGS | GL_CLIENT_STORAGE_BIT);
        readback->mapped = glMapNamedBufferRange(readback->name, 0, bytes, MAP_FLAGS);
    }
    if (readback->mapped)
        return true;
    gpu_readback_finish(device, readback);
    gpu_note_loss(device, error);
    return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "the driver cannot allocate a copy of %zu bytes",
                     size_bytes);
}

bool gpu_readback_copy(struct gpu_device *device, struct gpu_readback *readback, const struct gpu_buffer *from,
                       size_t offset_bytes, size_t size_bytes, struct error *error)
{
    gpu_readback_drop(readback);
    if (!reserve(device, readback, size_bytes, error))
        return false;
    readback->size_bytes = size_bytes;
    gpu_await(device, GL_BUFFER_UPDATE_BARRIER_BIT);
    glCopyNamedBufferSubData(from->name, readback->name, (GLintptr)offset_bytes, 0, (GLsizeiptr)size_bytes);
    readback->copies++;
    glClearNamedBufferSubData(readback->name, GL_R32UI, (GLintptr)number_offset(readback->capacity_bytes),
                              sizeof(readback->copies), GL_RED_INTEGER, GL_UNSIGNED_INT, &readback->copies);
    return true;
}

bool gpu_readback_fence(struct gpu_readback *readback, struct error *error)
{
    readback->fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glFlush();
    return readback->fence || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "the driver cannot allocate a fence");
}

static bool has_come(const struct gpu_readback *readback)
{
    const char *number = (const char *)readback->mapped + number_offset(readback->capacity_bytes);
    return *(const volatile uint32_t *)number == readback->copies;
}

bool gpu_readback_is_done(const struct gpu_readback *readback)
{
    if (!readback->fence)
        return true;
    const GLenum status = glClientWaitSync(readback->fence, 0, 0);
    return status == GL_WAIT_FAILED || (status != GL_TIMEOUT_EXPIRED && has_come(readback));
}

bool gpu_readback_take(struct gpu_device *device, struct gpu_readback *readback, void *data, struct error *error)
{
    GLenum status = readback->fence ? glClientWaitSync(readback->fence, 0, 0) : GL_TIMEOUT_EXPIRED;
    device->waits += readback->fence && status == GL_TIMEOUT_EXPIRED;
    while (readback->fence && status == GL_TIMEOUT_EXPIRED && gpu_check_reset(device, "reading back", error))
        status = glClientWaitSync(readback->fence, 0, WAIT_NS);
    gpu_readback_drop(readback);
    if (status != GL_ALREADY_SIGNALED && status != GL_CONDITION_SATISFIED) {
        gpu_note_loss(device, error);
        return error_set(error, ERROR_INTERNAL, NULL, "a copy from the device did not arrive");
    }
    const struct timespec pause = {.tv_nsec = EARLY_FENCE_NS};
    while (!has_come(readback)) {
        if (!gpu_check_reset(device, "reading back", error))
            return false;
        nanosleep(&pause, NULL);
    }
    memcpy(data, readback->mapped, readback->size_bytes);
    return true;
}
