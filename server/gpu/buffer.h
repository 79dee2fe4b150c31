/* SPDX-License-Identifier: MIT */
/* Buffers and the texel buffers over them. */
#ifndef FARLIGHT_GPU_BUFFER_H
#define FARLIGHT_GPU_BUFFER_H

#include "base/error.h"
#include "gpu/device.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Alignment of storage; OpenGL lets no device require more. */
#define GPU_STORAGE_ALIGNMENT 256

/* A buffer; all-zero is empty. */
struct gpu_buffer {
    unsigned name;         /* GL buffer, 0: none yet */
    unsigned texture;      /* GL buffer texture over it, 0: none */
    unsigned texel_format; /* GL_RGBA32F .. of that texture */
    size_t size_bytes;     /* in use */
    size_t capacity_bytes;
    bool was_cleared; /* cleared since the last write; private to buffer.c */
};

/* Reserves at least size_bytes (growth is geometric; contents are lost when it grows). The memory counts in the
 * device; fails with ERROR_OUT_OF_MEMORY before the driver would. */
bool gpu_buffer_reserve(struct gpu_device *device, struct gpu_buffer *buffer, size_t size_bytes,
                        struct error *error);
/* Reserves the buffer and writes all of it. `data` NULL: left undefined. */
bool gpu_buffer_upload(struct gpu_device *device, struct gpu_buffer *buffer, const void *data, size_t size_bytes,
                       struct error *error);
void gpu_buffer_write(struct gpu_device *device, struct gpu_buffer *buffer, size_t offset_bytes, const void *data,
                      size_t size_bytes);
/* Reserves the buffer and maps all of it for writing: each byte once, in order where that is easy (the memory may
 * be write-combined). NULL and *error on failure. Unmap it before the GPU uses it. */
void *gpu_buffer_map(struct gpu_device *device, struct gpu_buffer *buffer, size_t size_bytes, struct error *error);
/* Maps the contents of a buffer to read and write them, for software GL, whose memory is the host's. NULL and
 * *error on failure. Unmap it before the GPU uses it. */
void *gpu_buffer_open(struct gpu_device *device, struct gpu_buffer *buffer, struct error *error);
void gpu_buffer_unmap(struct gpu_device *device, struct gpu_buffer *buffer);
void gpu_buffer_read(struct gpu_device *device, const struct gpu_buffer *buffer, size_t offset_bytes, void *data,
                     size_t size_bytes); /* waits for the GPU */
/* Sets every u32 of the buffer to the value. */
void gpu_buffer_clear(struct gpu_device *device, struct gpu_buffer *buffer, uint32_t value);
/* Clears a part of it, in whole u32. */
void gpu_buffer_clear_part(struct gpu_device *device, struct gpu_buffer *buffer, size_t offset_bytes,
                           size_t size_bytes, uint32_t value);
/* Fills a part with four words, repeated; size in whole fours. */
void gpu_buffer_fill(struct gpu_device *device, struct gpu_buffer *buffer, size_t offset_bytes, size_t size_bytes,
                     const uint32_t words[4]);
/* A place in a buffer, for copies. */
struct gpu_buffer_place {
    const struct gpu_buffer *buffer;
    size_t offset_bytes;
};
void gpu_buffer_copy(struct gpu_device *device, struct gpu_buffer_place from, struct gpu_buffer_place to,
                     size_t size_bytes);
void gpu_buffer_finish(struct gpu_device *device, struct gpu_buffer *buffer); /* leaves it empty */

/* Binds an SSBO; an empty one is bound as a few zeros. */
void gpu_buffer_bind_storage(const struct gpu_buffer *buffer, unsigned binding);
/* Binds a part that begins at a multiple of GPU_STORAGE_ALIGNMENT. */
void gpu_buffer_bind_storage_part(struct gpu_buffer_place place, size_t size_bytes, unsigned binding);
void gpu_buffer_bind_uniform(const struct gpu_buffer *buffer, unsigned binding); /* UBO */
/* Binds a samplerBuffer / usamplerBuffer of `texel_format` (GL_RGBA32F, GL_RGBA32UI, GL_RG32UI, GL_R32UI,
 * GL_RGBA8 ..) on a texture unit. An empty buffer is bound as one of zeros. Reads behind size_bytes are
 * undefined. */
void gpu_buffer_bind_texels(struct gpu_device *device, struct gpu_buffer *buffer, unsigned unit,
                            unsigned texel_format);
/* Binds a writable uimageBuffer / imageBuffer on an image unit. */
void gpu_buffer_bind_image(struct gpu_device *device, struct gpu_buffer *buffer, unsigned unit,
                           unsigned texel_format);

#endif
