/* SPDX-License-Identifier: MIT */
/* Callback for the driver's messages, and a stack of group names. */
#include "gpu/debug.h"

#include "base/log.h"
#include "gpu/device.h"

#include <epoxy/gl.h>
#include <string.h>

/* Maximum depth of kept names. Passes nest two or three deep; deeper names are counted but not kept. */
#define GROUP_DEPTH_MAX 16

static _Thread_local const char *group_names[GROUP_DEPTH_MAX];
static _Thread_local unsigned group_depth;

static const char *group_name(void)
{
    if (group_depth == 0)
        return "outside of any pass";
    return group_names[group_depth <= GROUP_DEPTH_MAX ? group_depth - 1 : GROUP_DEPTH_MAX - 1];
}

static enum log_level level_of(GLenum type, GLenum severity)
{
    if (type == GL_DEBUG_TYPE_ERROR || severity == GL_DEBUG_SEVERITY_HIGH)
        return LOG_ERROR;
    /* Performance hints are numerous and do not concern the user. */
    if (type == GL_DEBUG_TYPE_PERFORMANCE || type == GL_DEBUG_TYPE_OTHER)
        return LOG_DEBUG;
    return severity == GL_DEBUG_SEVERITY_MEDIUM ? LOG_WARNING : LOG_DEBUG;
}

static void APIENTRY on_message(GLenum source, GLenum type, GLuint id, GLenum severity, GLsizei length,
                                const GLchar *text, const void *user)
{
    (void)id, (void)length, (void)user;
    /* Compile logs are part of the error that program.c makes. */
    if (source == GL_DEBUG_SOURCE_SHADER_COMPILER || severity == GL_DEBUG_SEVERITY_NOTIFICATION)
        return;
    if (type == GL_DEBUG_TYPE_PUSH_GROUP || type == GL_DEBUG_TYPE_POP_GROUP)
        return;
    log_write(level_of(type, severity), "gpu", "%s: %s", group_name(), text);
}

void gpu_debug_start(void)
{
    group_depth = 0;
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS); /* otherwise a message might get another group's name */
    glDebugMessageCallback(on_message, NULL);
}

void gpu_push_group(struct gpu_device *device, const char *name)
{
    if (group_depth < GROUP_DEPTH_MAX)
        group_names[group_depth] = name;
    group_depth++;
    if (device->facts.debug_output)
        glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, name);
}

void gpu_pop_group(struct gpu_device *device)
{
    if (group_depth == 0)
        return;
    group_depth--;
    if (device->facts.debug_output)
        glPopDebugGroup();
}
