/* SPDX-License-Identifier: MIT */
/* Textures and framebuffers: formats, allocation and bindings. */
#include "gpu/texture.h"

#include "gpu/registry.h"

#include <epoxy/gl.h>

#define COLOURS_MAX 8 /* maximum that every device supports */

struct format_row {
    GLenum format;
    unsigned texel_bytes;
    GLint filter; /* integer textures are incomplete with any other than nearest */
};

static const struct format_row format_rows[] = {
    {GL_R8, 1, GL_LINEAR},
    {GL_RG8, 2, GL_LINEAR},
    {GL_RGBA8, 4, GL_LINEAR},
    {GL_SRGB8_ALPHA8, 4, GL_LINEAR},
    {GL_RGB10_A2, 4, GL_LINEAR},
    {GL_R16F, 2, GL_LINEAR},
    {GL_RG16F, 4, GL_LINEAR},
    {GL_RGBA16F, 8, GL_LINEAR},
    {GL_R32F, 4, GL_NEAREST},
    {GL_RG32F, 8, GL_NEAREST},
    {GL_RGBA32F, 16, GL_NEAREST},
    {GL_R32UI, 4, GL_NEAREST},
    {GL_RG32UI, 8, GL_NEAREST},
    {GL_RGBA32UI, 16, GL_NEAREST},
    {GL_R32I, 4, GL_NEAREST},
    {GL_RGBA16UI, 8, GL_NEAREST},
    {GL_RGBA8UI, 4, GL_NEAREST},
    {GL_DEPTH_COMPONENT24, 4, GL_NEAREST},
    {GL_DEPTH_COMPONENT32F, 4, GL_NEAREST},
};

static const struct format_row *find_format(GLenum format)
{
    for (size_t i = 0; i < sizeof(format_rows) / sizeof(format_rows[0]); i++)
        if (format_rows[i].format == format)
            return &format_rows[i];
    return NULL;
}

static enum gpu_object_kind kind_of(const struct gpu_texture *texture)
{
    return texture->layers > 0 ? GPU_TEXTURE_2D_ARRAY : GPU_TEXTURE_2D;
}

static bool check_size(const struct gpu_device *device, uint32_t width, uint32_t height, uint32_t layers,
                       struct error *error)
{
    const struct gpu_facts *facts = &device->facts;
    if (width == 0 || height == 0 || width > facts->texture_size_max || height > facts->texture_size_max)
        return error_set(error, ERROR_LIMIT, NULL, "a texture of %ux%u; this device has at most %ux%u", width,
                         height, facts->texture_size_max, facts->texture_size_max);
    if (layers > facts->texture_layers_max)
        return error_set(error, ERROR_LIMIT, NULL, "a texture of %u layers; this device has at most %u", layers,
                         facts->texture_layers_max);
    return true;
}

/* Reserves a texture; `layers` 0: no array. */
static bool reserve(struct gpu_device *device, struct gpu_texture *texture, unsigned internal_format,
                    uint32_t width, uint32_t height, uint32_t layers, struct error *error)
{
    if (texture->name && texture->internal_format == internal_format && texture->width == width &&
        texture->height == height && texture->layers == layers)
        return true;
    gpu_texture_finish(device, texture);
    const struct format_row *row = find_format(internal_format);
    if (!row)
        return error_set(error, ERROR_INTERNAL, NULL, "texture format 0x%04x is not in the table",
                         internal_format);
    uint64_t size_bytes = (uint64_t)width * height * (layers > 0 ? layers : 1) * row->texel_bytes;
    if (!check_size(device, width, height, layers, error) ||
        !gpu_reserve_memory(device, size_bytes, "a texture", error))
        return false;
    texture->size_bytes = size_bytes;
    texture->layers = layers;
    texture->name = gpu_object_create(device->registry, kind_of(texture));
    if (texture->name) {
        (void)glGetError(); /* an earlier error would be attributed to this call */
        if (layers > 0)
            glTextureStorage3D(texture->name, 1, internal_format, (GLsizei)width, (GLsizei)height,
                               (GLsizei)layers);
        else
            glTextureStorage2D(texture->name, 1, internal_format, (GLsizei)width, (GLsizei)height);
    }
    if (!texture->name || glGetError() != GL_NO_ERROR) {
        gpu_texture_finish(device, texture);
        gpu_note_loss(device, error);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "the driver cannot allocate a texture of %ux%u", width,
                         height);
    }
    glTextureParameteri(texture->name, GL_TEXTURE_MIN_FILTER, row->filter);
    glTextureParameteri(texture->name, GL_TEXTURE_MAG_FILTER, row->filter);
    glTextureParameteri(texture->name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture->name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    texture->internal_format = internal_format;
    texture->width = width;
    texture->height = height;
    return true;
}

bool gpu_texture_reserve(struct gpu_device *device, struct gpu_texture *texture, unsigned internal_format,
                         uint32_t width, uint32_t height, struct error *error)
{
    return reserve(device, texture, internal_format, width, height, 0, error);
}

bool gpu_texture_reserve_array(struct gpu_device *device, struct gpu_texture *texture, unsigned internal_format,
                               uint32_t width, uint32_t height, uint32_t layers, struct error *error)
{
    return reserve(device, texture, internal_format, width, height, layers > 0 ? layers : 1, error);
}

void gpu_texture_write_rows(struct gpu_texture *texture, unsigned format, unsigned type, uint32_t first_row,
                            uint32_t rows, const void *texels)
{
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage2D(texture->name, 0, 0, (GLint)first_row, (GLsizei)texture->width, (GLsizei)rows, format,
                        type, texels);
}

void gpu_texture_finish(struct gpu_device *device, struct gpu_texture *texture)
{
    gpu_object_destroy(device->registry, kind_of(texture), texture->name);
    gpu_memory_give(device, texture->size_bytes);
    *texture = (struct gpu_texture){0};
}

void gpu_texture_bind(const struct gpu_texture *texture, unsigned unit)
{
    glBindTextureUnit(unit, texture->name);
}

void gpu_texture_bind_image(const struct gpu_texture *texture, unsigned unit)
{
    glBindImageTexture(unit, texture->name, 0, GL_TRUE, 0, GL_READ_ONLY, texture->internal_format);
}

static bool create_framebuffer(struct gpu_device *device, struct gpu_framebuffer *framebuffer, struct error *error)
{
    framebuffer->name = gpu_object_create(device->registry, GPU_FRAMEBUFFER);
    if (framebuffer->name)
        return true;
    gpu_note_loss(device, error);
    return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no more framebuffer names");
}

static bool complete_framebuffer(struct gpu_device *device, struct gpu_framebuffer *framebuffer,
                                 const struct gpu_texture *depth, unsigned colour_count, struct error *error)
{
    GLenum attachments[COLOURS_MAX];
    for (unsigned i = 0; i < colour_count; i++)
        attachments[i] = GL_COLOR_ATTACHMENT0 + i;
    if (depth)
        glNamedFramebufferTexture(framebuffer->name, GL_DEPTH_ATTACHMENT, depth->name, 0);
    glNamedFramebufferDrawBuffers(framebuffer->name, (GLsizei)colour_count, attachments);
    GLenum status = glCheckNamedFramebufferStatus(framebuffer->name, GL_DRAW_FRAMEBUFFER);
    if (status == GL_FRAMEBUFFER_COMPLETE)
        return true;
    gpu_framebuffer_finish(device, framebuffer);
    gpu_note_loss(device, error);
    return error_set(error, ERROR_INTERNAL, NULL, "framebuffer is not complete: 0x%04x", status);
}

bool gpu_framebuffer_create(struct gpu_device *device, struct gpu_framebuffer *framebuffer,
                            const struct gpu_texture *colours, unsigned colour_count,
                            const struct gpu_texture *depth, struct error *error)
{
    if (colour_count > COLOURS_MAX)
        return error_set(error, ERROR_INTERNAL, NULL, "a framebuffer with %u colours", colour_count);
    if (!create_framebuffer(device, framebuffer, error))
        return false;
    for (unsigned i = 0; i < colour_count; i++)
        glNamedFramebufferTexture(framebuffer->name, GL_COLOR_ATTACHMENT0 + i, colours[i].name, 0);
    return complete_framebuffer(device, framebuffer, depth, colour_count, error);
}

bool gpu_framebuffer_create_layers(struct gpu_device *device, struct gpu_framebuffer *framebuffer,
                                   const struct gpu_layer_target *target, struct error *error)
{
    const unsigned colour_count = target->count + (target->last ? 1 : 0);
    if (colour_count > COLOURS_MAX)
        return error_set(error, ERROR_INTERNAL, NULL, "a framebuffer with %u colours", colour_count);
    if (!create_framebuffer(device, framebuffer, error))
        return false;
    for (uint32_t i = 0; i < target->count; i++)
        glNamedFramebufferTextureLayer(framebuffer->name, GL_COLOR_ATTACHMENT0 + i, target->colours->name, 0,
                                       (GLint)(target->first + i));
    if (target->last)
        glNamedFramebufferTexture(framebuffer->name, GL_COLOR_ATTACHMENT0 + target->count, target->last->name, 0);
    return complete_framebuffer(device, framebuffer, target->depth, colour_count, error);
}

void gpu_framebuffer_finish(struct gpu_device *device, struct gpu_framebuffer *framebuffer)
{
    gpu_object_destroy(device->registry, GPU_FRAMEBUFFER, framebuffer->name);
    framebuffer->name = 0;
}
