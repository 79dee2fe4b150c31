/* SPDX-License-Identifier: MIT */
/* 2D textures, arrays of these, and framebuffers. */
#ifndef FARLIGHT_GPU_TEXTURE_H
#define FARLIGHT_GPU_TEXTURE_H

#include "base/error.h"
#include "gpu/device.h"

#include <stdint.h>

/* A texture; all-zero is empty. */
struct gpu_texture {
    unsigned name;
    unsigned internal_format; /* GL_RGBA16F .. */
    uint32_t width, height;
    uint32_t layers; /* number of layers in an array; 0: no array */
    uint64_t size_bytes;
};

/* Makes the texture again if its size or format differs. */
bool gpu_texture_reserve(struct gpu_device *device, struct gpu_texture *texture, unsigned internal_format,
                         uint32_t width, uint32_t height, struct error *error);
/* Makes an array of `layers` layers, at least 1, in the same way. */
bool gpu_texture_reserve_array(struct gpu_device *device, struct gpu_texture *texture, unsigned internal_format,
                               uint32_t width, uint32_t height, uint32_t layers, struct error *error);
/* Writes rows; `texels` has those rows only. */
void gpu_texture_write_rows(struct gpu_texture *texture, unsigned format, unsigned type, uint32_t first_row,
                            uint32_t rows, const void *texels);
void gpu_texture_finish(struct gpu_device *device, struct gpu_texture *texture);
void gpu_texture_bind(const struct gpu_texture *texture, unsigned unit);
/* Binds an array for reading. */
void gpu_texture_bind_image(const struct gpu_texture *texture, unsigned unit);

struct gpu_framebuffer {
    unsigned name;
};
/* Creates a framebuffer. Arrays are attached with all their layers; all attachments must have the same number. */
bool gpu_framebuffer_create(struct gpu_device *device, struct gpu_framebuffer *framebuffer,
                            const struct gpu_texture *colours, unsigned colour_count,
                            const struct gpu_texture *depth, struct error *error);
/* Target made of layers of an array, and of textures that are no arrays. */
struct gpu_layer_target {
    const struct gpu_texture *colours; /* the array */
    uint32_t first, count;             /* layers of the array: the first colours */
    const struct gpu_texture *last;    /* colour after these; NULL: none */
    const struct gpu_texture *depth;   /* NULL: none */
};
bool gpu_framebuffer_create_layers(struct gpu_device *device, struct gpu_framebuffer *framebuffer,
                                   const struct gpu_layer_target *target, struct error *error);
void gpu_framebuffer_finish(struct gpu_device *device, struct gpu_framebuffer *framebuffer);

#endif
