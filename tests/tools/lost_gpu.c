/* SPDX-License-Identifier: MIT */
/* Linked with all of farlightd, this makes of it a daemon whose GPU is lost when a test wants it: once for each
 * byte of the file that $FARLIGHT_TEST_LOSSES names, whose last byte is taken away as the driver tells of it. A
 * context is not lost while it is made, so the first question in each is answered well. */
#include <epoxy/gl.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static int losses_fd = -1;
static bool is_made; /* the context */

/* Asked on the thread that owns GL only. */
static GLenum status_of_a_lost_context(void)
{
    struct stat file;
    if (!is_made) {
        is_made = true;
        return GL_NO_ERROR;
    }
    if (fstat(losses_fd, &file) < 0 || file.st_size == 0 || ftruncate(losses_fd, file.st_size - 1) < 0)
        return GL_NO_ERROR;
    is_made = false;
    return GL_GUILTY_CONTEXT_RESET;
}

__attribute__((constructor)) static void begin(void)
{
    const char *path = getenv("FARLIGHT_TEST_LOSSES");
    if (!path || (losses_fd = open(path, O_RDWR | O_CLOEXEC)) < 0)
        return;
    epoxy_glGetGraphicsResetStatus = status_of_a_lost_context;
}
