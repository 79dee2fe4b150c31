/* SPDX-License-Identifier: MIT */
/* Dispatches without groups, which make llvmpipe compile. */
#include "gpu/program_rehearse.h"

#include <epoxy/gl.h>

static bool is_of_floats(GLenum format)
{
    return format != GL_R32UI;
}

/* Format of a unit's buffer texture; 0: it is no buffer texture. */
static GLenum format_of(const struct gpu_texel_formats *formats, GLenum type, GLint unit)
{
    const bool floats = type == GL_SAMPLER_BUFFER;
    if (!floats && type != GL_UNSIGNED_INT_SAMPLER_BUFFER && type != GL_UNSIGNED_INT_IMAGE_BUFFER)
        return 0;
    const GLenum own = type != GL_UNSIGNED_INT_IMAGE_BUFFER ? formats->of_unit[unit % GPU_TEXEL_UNITS] : 0;
    return own && is_of_floats(own) == floats ? own : floats ? GL_RGBA32F : GL_RGBA32UI;
}

/* Binds a texture that stands for a drawn one. Its size matters to llvmpipe only where it is a power of two, as
 * few pictures' is. */
static GLuint bind_drawn(GLuint unit)
{
    GLuint texture = 0;
    glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture);
    glTextureStorage3D(texture, 1, GL_RG32UI, 3, 3, 1);
    glBindImageTexture(unit, texture, 0, GL_TRUE, 0, GL_READ_ONLY, GL_RG32UI);
    return texture;
}

void gpu_program_rehearse(const struct gpu_texel_formats *formats, unsigned program)
{
    static const unsigned char zeros[GPU_EMPTY_BUFFER_BYTES];
    GLuint buffer = 0, textures[GPU_TEXEL_UNITS];
    GLint count = 0, used = 0;
    glCreateBuffers(1, &buffer);
    glNamedBufferStorage(buffer, sizeof(zeros), zeros, 0);
    glUseProgram(program);
    glGetProgramInterfaceiv(program, GL_UNIFORM, GL_ACTIVE_RESOURCES, &count);
    for (GLint i = 0; i < count && used < GPU_TEXEL_UNITS; i++) {
        static const GLenum asked[] = {GL_TYPE, GL_LOCATION};
        GLint answers[2] = {0, -1}, unit = 0;
        glGetProgramResourceiv(program, GL_UNIFORM, (GLuint)i, 2, asked, 2, NULL, answers);
        if (answers[1] < 0)
            continue;
        glGetUniformiv(program, answers[1], &unit);
        const GLenum type = (GLenum)answers[0], format = format_of(formats, type, unit);
        if (type == GL_UNSIGNED_INT_IMAGE_2D_ARRAY)
            textures[used++] = bind_drawn((GLuint)unit);
        if (!format)
            continue;
        glCreateTextures(GL_TEXTURE_BUFFER, 1, &textures[used]);
        glTextureBufferRange(textures[used], format, buffer, 0, sizeof(zeros));
        if (type == GL_UNSIGNED_INT_IMAGE_BUFFER)
            glBindImageTexture((GLuint)unit, textures[used], 0, GL_FALSE, 0, GL_READ_WRITE, format);
        else
            glBindTextureUnit((GLuint)unit, textures[used]);
        used++;
    }
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, buffer);
    glDispatchComputeIndirect(0);
    glUseProgram(0);
    glDeleteTextures(used, textures);
    glDeleteBuffers(1, &buffer);
}
