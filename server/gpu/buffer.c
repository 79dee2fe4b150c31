/* SPDX-License-Identifier: MIT */
/* Buffers: allocation, transfers and bindings. */
#include "gpu/buffer.h"

#include "base/progress.h"
#include "gpu/barrier.h"
#include "gpu/readback.h"
#include "gpu/registry.h"

#include <epoxy/gl.h>

#define STORAGE_FLAGS (GL_DYNAMIC_STORAGE_BIT | GL_MAP_WRITE_BIT)
/* Minimum capacity: one page. */
#define CAPACITY_MIN_BYTES 4096
#define STEP_BYTES ((size_t)256)

static void release(struct gpu_device *device, struct gpu_buffer *buffer)
{
    gpu_object_destroy(device->registry, GPU_TEXTURE_BUFFER, buffer->texture);
    gpu_object_destroy(device->registry, GPU_BUFFER, buffer->name);
    gpu_memory_give(device, buffer->capacity_bytes);
    *buffer = (struct gpu_buffer){0};
}

/* Rounds a size so that all capacities look alike to llvmpipe. It compiles a program for the bound buffer
 * textures: whether their memory is a power of two, and whether the first or second byte of their size is 0, as
 * it takes these for levels. With others bound, the program is compiled again, which takes up to a second. */
static size_t alike(size_t bytes)
{
    size_t capacity = (bytes + STEP_BYTES - 1) & ~(STEP_BYTES - 1);
    while ((capacity & 0xff00) == 0 || (capacity & (capacity - 1)) == 0)
        capacity += STEP_BYTES;
    return capacity;
}

static size_t grown_capacity(size_t old_bytes, size_t size_bytes)
{
    /* A first allocation is exact, as most buffers are filled once. A buffer that grows will probably grow
     * again. */
    size_t capacity = old_bytes ? size_bytes + size_bytes / 2 : size_bytes;
    if (capacity < size_bytes)
        capacity = size_bytes;
    if (capacity < CAPACITY_MIN_BYTES)
        capacity = CAPACITY_MIN_BYTES;
    return capacity > PTRDIFF_MAX ? capacity : alike(capacity);
}

static bool allocate(struct gpu_device *device, struct gpu_buffer *buffer, size_t capacity, struct error *error)
{
    if (capacity > PTRDIFF_MAX)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "a buffer of %zu bytes", capacity);
    if (!gpu_reserve_memory(device, capacity, "a buffer", error))
        return false;
    buffer->capacity_bytes = capacity;
    buffer->name = gpu_object_create(device->registry, GPU_BUFFER);
    if (!buffer->name) {
        release(device, buffer);
        gpu_note_loss(device, error);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no more buffer names");
    }
    /* Earlier errors are not this allocation's, and must not hide its own. */
    GLenum before = glGetError();
    glNamedBufferStorage(buffer->name, (GLsizeiptr)capacity, NULL,
                         device->facts.software ? STORAGE_FLAGS | GL_MAP_READ_BIT : STORAGE_FLAGS);
    if (glGetError() != GL_NO_ERROR) {
        release(device, buffer);
        gpu_note_loss(device, error);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "the driver cannot allocate a buffer of %zu bytes",
                         capacity);
    }
    if (before != GL_NO_ERROR)
        gpu_note_loss(device, error);
    if (before != GL_NO_ERROR)
        return error_set(error, ERROR_INTERNAL, NULL, "GL error 0x%04x before a buffer was made", before);
    return true;
}

bool gpu_buffer_reserve(struct gpu_device *device, struct gpu_buffer *buffer, size_t size_bytes,
                        struct error *error)
{
    if (size_bytes > buffer->capacity_bytes) {
        size_t old_bytes = buffer->capacity_bytes;
        release(device, buffer);
        if (!allocate(device, buffer, grown_capacity(old_bytes, size_bytes), error))
            return false;
    } else if (size_bytes != buffer->size_bytes) {
        /* A buffer texture spans the used bytes; the next bind makes it again. */
        gpu_object_destroy(device->registry, GPU_TEXTURE_BUFFER, buffer->texture);
        buffer->texture = 0;
    }
    buffer->size_bytes = size_bytes;
    return true;
}

bool gpu_buffer_upload(struct gpu_device *device, struct gpu_buffer *buffer, const void *data, size_t size_bytes,
                       struct error *error)
{
    if (!gpu_buffer_reserve(device, buffer, size_bytes, error))
        return false;
    if (data)
        gpu_buffer_write(device, buffer, 0, data, size_bytes);
    return true;
}

/* Waits for a clear. NVIDIA's driver (580) clears a buffer of more than some pages after a later write into it:
 * only glFinish() keeps them in order, no barrier and no flush does. */
static void wait_for_clear(const struct gpu_device *device, struct gpu_buffer *buffer)
{
    if (buffer->was_cleared && !device->facts.software)
        glFinish();
    buffer->was_cleared = false;
}

void *gpu_buffer_map(struct gpu_device *device, struct gpu_buffer *buffer, size_t size_bytes, struct error *error)
{
    if (!gpu_buffer_reserve(device, buffer, size_bytes ? size_bytes : 1, error))
        return NULL;
    gpu_await(device, GL_BUFFER_UPDATE_BARRIER_BIT);
    wait_for_clear(device, buffer);
    void *data = glMapNamedBufferRange(buffer->name, 0, (GLsizeiptr)buffer->size_bytes,
                                       GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT);
    if (data)
        return data;
    gpu_note_loss(device, error);
    error_set(error, ERROR_OUT_OF_MEMORY, NULL, "the driver does not map a buffer of %zu bytes", size_bytes);
    return NULL;
}

void *gpu_buffer_open(struct gpu_device *device, struct gpu_buffer *buffer, struct error *error)
{
    device->waits++;
    gpu_await(device, GL_BUFFER_UPDATE_BARRIER_BIT);
    void *data =
        glMapNamedBufferRange(buffer->name, 0, (GLsizeiptr)buffer->size_bytes, GL_MAP_READ_BIT | GL_MAP_WRITE_BIT);
    if (data)
        return data;
    gpu_note_loss(device, error);
    error_set(error, ERROR_OUT_OF_MEMORY, NULL, "the driver does not map a buffer of %zu bytes",
              buffer->size_bytes);
    return NULL;
}

void gpu_buffer_unmap(struct gpu_device *device, struct gpu_buffer *buffer)
{
    (void)device;
    glUnmapNamedBuffer(buffer->name);
}

void gpu_buffer_write(struct gpu_device *device, struct gpu_buffer *buffer, size_t offset_bytes, const void *data,
                      size_t size_bytes)
{
    gpu_await(device, GL_BUFFER_UPDATE_BARRIER_BIT);
    wait_for_clear(device, buffer);
    if (size_bytes)
        glNamedBufferSubData(buffer->name, (GLintptr)offset_bytes, (GLsizeiptr)size_bytes, data);
    progress_report();
}

/* Reads by way of a copy. A driver may move a buffer that is read directly into the host's memory, and every later
 * pass then reads it from there (NVIDIA's says "is being copied/moved from VIDEO memory to HOST memory"). False:
 * there is no memory for the copy. */
static bool read_copy(struct gpu_device *device, const struct gpu_buffer *buffer, size_t offset_bytes, void *data,
                      size_t size_bytes)
{
    struct gpu_readback copy = {0};
    struct error ignored;
    const bool is_read = gpu_readback_copy(device, &copy, buffer, offset_bytes, size_bytes, &ignored) &&
                         gpu_readback_fence(&copy, &ignored) && gpu_readback_take(device, &copy, data, &ignored);
    gpu_readback_finish(device, &copy);
    return is_read;
}

void gpu_buffer_read(struct gpu_device *device, const struct gpu_buffer *buffer, size_t offset_bytes, void *data,
                     size_t size_bytes)
{
    if (!size_bytes)
        return;
    const uint64_t waits = device->waits + 1; /* a read is one, also if the device is done already */
    if (device->facts.shares_memory || !read_copy(device, buffer, offset_bytes, data, size_bytes)) {
        gpu_await(device, GL_BUFFER_UPDATE_BARRIER_BIT);
        glGetNamedBufferSubData(buffer->name, (GLintptr)offset_bytes, (GLsizeiptr)size_bytes, data);
    }
    device->waits = waits;
}

void gpu_buffer_clear(struct gpu_device *device, struct gpu_buffer *buffer, uint32_t value)
{
    gpu_await(device, GL_BUFFER_UPDATE_BARRIER_BIT);
    buffer->was_cleared = true;
    if (buffer->name)
        glClearNamedBufferData(buffer->name, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &value);
}

void gpu_buffer_clear_part(struct gpu_device *device, struct gpu_buffer *buffer, size_t offset_bytes,
                           size_t size_bytes, uint32_t value)
{
    gpu_await(device, GL_BUFFER_UPDATE_BARRIER_BIT);
    buffer->was_cleared = true;
    if (buffer->name && size_bytes > 0)
        glClearNamedBufferSubData(buffer->name, GL_R32UI, (GLintptr)offset_bytes, (GLsizeiptr)size_bytes,
                                  GL_RED_INTEGER, GL_UNSIGNED_INT, &value);
}

void gpu_buffer_fill(struct gpu_device *device, struct gpu_buffer *buffer, size_t offset_bytes, size_t size_bytes,
                     const uint32_t words[4])
{
    gpu_await(device, GL_BUFFER_UPDATE_BARRIER_BIT);
    buffer->was_cleared = true;
    if (buffer->name && size_bytes > 0)
        glClearNamedBufferSubData(buffer->name, GL_RGBA32UI, (GLintptr)offset_bytes, (GLsizeiptr)size_bytes,
                                  GL_RGBA_INTEGER, GL_UNSIGNED_INT, words);
}

void gpu_buffer_copy(struct gpu_device *device, struct gpu_buffer_place from, struct gpu_buffer_place to,
                     size_t size_bytes)
{
    gpu_await(device, GL_BUFFER_UPDATE_BARRIER_BIT);
    glCopyNamedBufferSubData(from.buffer->name, to.buffer->name, (GLintptr)from.offset_bytes,
                             (GLintptr)to.offset_bytes, (GLsizeiptr)size_bytes);
}

void gpu_buffer_finish(struct gpu_device *device, struct gpu_buffer *buffer)
{
    /* A buffer that was bound while empty has only its texture. */
    if (buffer->name || buffer->texture)
        release(device, buffer);
    *buffer = (struct gpu_buffer){0};
}

static unsigned name_or_empty(const struct gpu_buffer *buffer)
{
    return buffer->name && buffer->size_bytes ? buffer->name : gpu_device_current()->empty_buffer;
}

void gpu_buffer_bind_storage(const struct gpu_buffer *buffer, unsigned binding)
{
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, name_or_empty(buffer));
}

void gpu_buffer_bind_storage_part(struct gpu_buffer_place place, size_t size_bytes, unsigned binding)
{
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, place.buffer->name, (GLintptr)place.offset_bytes,
                      (GLsizeiptr)size_bytes);
}

void gpu_buffer_bind_uniform(const struct gpu_buffer *buffer, unsigned binding)
{
    glBindBufferBase(GL_UNIFORM_BUFFER, binding, name_or_empty(buffer));
}

static size_t spanned_bytes(const struct gpu_device *device, const struct gpu_buffer *buffer)
{
    if (!buffer->name || !buffer->size_bytes)
        return GPU_EMPTY_BUFFER_BYTES;
    return device->facts.software ? buffer->capacity_bytes : buffer->size_bytes;
}

static void need_texture(struct gpu_device *device, struct gpu_buffer *buffer, unsigned texel_format)
{
    if (!buffer->texture || buffer->texel_format != texel_format) {
        gpu_object_destroy(device->registry, GPU_TEXTURE_BUFFER, buffer->texture);
        buffer->texture = gpu_object_create(device->registry, GPU_TEXTURE_BUFFER);
        buffer->texel_format = texel_format;
        glTextureBufferRange(buffer->texture, texel_format, name_or_empty(buffer), 0,
                             (GLsizeiptr)spanned_bytes(device, buffer));
    }
}

void gpu_buffer_bind_texels(struct gpu_device *device, struct gpu_buffer *buffer, unsigned unit,
                            unsigned texel_format)
{
    need_texture(device, buffer, texel_format);
    glBindTextureUnit(unit, buffer->texture);
}

void gpu_buffer_bind_image(struct gpu_device *device, struct gpu_buffer *buffer, unsigned unit,
                           unsigned texel_format)
{
    need_texture(device, buffer, texel_format);
    glBindImageTexture(unit, buffer->texture, 0, GL_FALSE, 0, GL_READ_WRITE, texel_format);
}
