/* SPDX-License-Identifier: MIT */
/* Barriers from the accesses that programs declare. */
#include "gpu/barrier.h"

#include "gpu/uniforms.h"

#include <epoxy/gl.h>
#include <string.h>

#define PASS_ACCESSES                                                                                             \
    (GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |          \
     GL_UNIFORM_BARRIER_BIT)
#define ALL_ACCESSES                                                                                              \
    (PASS_ACCESSES | GL_COMMAND_BARRIER_BIT | GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT | \
     GL_TRANSFORM_FEEDBACK_BARRIER_BIT | GL_QUERY_BUFFER_BARRIER_BIT)
#define LINE_BYTES 256

static unsigned accesses_of_line(const char *line)
{
    static const struct {
        const char *word;
        unsigned access;
    } rows[] = {
        {" buffer ", GL_SHADER_STORAGE_BARRIER_BIT},     {"sampler", GL_TEXTURE_FETCH_BARRIER_BIT},
        {" image", GL_SHADER_IMAGE_ACCESS_BARRIER_BIT},  {" uimage", GL_SHADER_IMAGE_ACCESS_BARRIER_BIT},
        {" iimage", GL_SHADER_IMAGE_ACCESS_BARRIER_BIT}, {"std140", GL_UNIFORM_BARRIER_BIT},
    };
    unsigned accesses = 0;
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++)
        accesses |= strstr(line, rows[i].word) ? rows[i].access : 0;
    return accesses;
}

void gpu_accesses_add(struct gpu_program *program, const char *text)
{
    while (*text) {
        const size_t length = strcspn(text, "\n");
        const char *begin = text + strspn(text, " \t");
        if (strncmp(begin, "layout(", strlen("layout(")) == 0) {
            char line[LINE_BYTES] = "";
            memcpy(line, text, length < LINE_BYTES ? length : LINE_BYTES - 1);
            program->accesses |= accesses_of_line(line);
        }
        text += length + (text[length] == '\n');
    }
}

/* ---- resources known to the driver ---- */

static GLint resources(const struct gpu_program *program, GLenum kind)
{
    GLint count = 0;
    glGetProgramInterfaceiv(program->name, kind, GL_ACTIVE_RESOURCES, &count);
    return count;
}

static unsigned access_of_type(GLenum type)
{
    switch (type) {
    case GL_UNSIGNED_INT:
    case GL_INT:
    case GL_BOOL:
    case GL_FLOAT:
    case GL_FLOAT_VEC2:
    case GL_FLOAT_VEC3:
    case GL_FLOAT_VEC4:
        return 0;
    default:
        return type >= GL_IMAGE_1D && type <= GL_UNSIGNED_INT_IMAGE_2D_MULTISAMPLE_ARRAY
                   ? GL_SHADER_IMAGE_ACCESS_BARRIER_BIT
                   : GL_TEXTURE_FETCH_BARRIER_BIT;
    }
}

bool gpu_accesses_check(const struct gpu_program *program, struct error *error)
{
    unsigned seen = resources(program, GL_SHADER_STORAGE_BLOCK) > 0 ? GL_SHADER_STORAGE_BARRIER_BIT : 0;
    for (GLint i = resources(program, GL_UNIFORM_BLOCK) - 1; i >= 0; i--) {
        const GLenum property = GL_BUFFER_BINDING;
        GLint binding = 0;
        glGetProgramResourceiv(program->name, GL_UNIFORM_BLOCK, (GLuint)i, 1, &property, 1, NULL, &binding);
        seen |= binding != GPU_UNIFORMS_BINDING ? GL_UNIFORM_BARRIER_BIT : 0;
    }
    for (GLint i = resources(program, GL_UNIFORM) - 1; i >= 0; i--) {
        const GLenum properties[] = {GL_TYPE, GL_BLOCK_INDEX};
        GLint values[2] = {0};
        glGetProgramResourceiv(program->name, GL_UNIFORM, (GLuint)i, 2, properties, 2, NULL, values);
        const unsigned access = access_of_type((GLenum)values[0]);
        if (values[1] == -1 && access == 0)
            return error_set(error, ERROR_INTERNAL, NULL, "a uniform lies outside the block of its program");
        seen |= access;
    }
    return (seen & ~program->accesses) == 0 ||
           error_set(error, ERROR_INTERNAL, NULL,
                     "a program accesses buffers in ways that no line of it declares (0x%x, not 0x%x)", seen,
                     program->accesses);
}

/* ---- barriers ---- */

static void issue(struct gpu_device *device, unsigned accesses)
{
    if (accesses) {
        device->barriers++;
        glMemoryBarrier(accesses);
    }
    device->unseen.before &= ~accesses;
    device->unseen.together &= ~accesses;
}

void gpu_await(struct gpu_device *device, unsigned accesses)
{
    issue(device, accesses & (device->unseen.before | device->unseen.together));
}

void gpu_await_pass(struct gpu_device *device, const struct gpu_program *program, unsigned accesses)
{
    accesses |= program->accesses ? program->accesses : PASS_ACCESSES;
    issue(device, accesses & device->unseen.before);
    if (device->unseen.are_together)
        device->unseen.together = ALL_ACCESSES;
    else
        device->unseen.before = ALL_ACCESSES;
}

void gpu_together_begin(struct gpu_device *device)
{
    device->unseen.are_together = true;
}

void gpu_together_end(struct gpu_device *device)
{
    device->unseen.before |= device->unseen.together;
    device->unseen.together = 0;
    device->unseen.are_together = false;
}
