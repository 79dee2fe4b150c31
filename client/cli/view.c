/* SPDX-License-Identifier: MIT */
/* The viewer is a program of its own, so that nothing else links SDL and libavcodec. */
#include "commands.h"
#include "options/talk.h"
#include "lib/process.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

int cli_view(int argc, char **argv)
{
    char path[4096];
    struct fl_error error = {0};
    (void)argc;
    if (!fl_find_program("farlight-view", path, sizeof(path), &error))
        return cli_report(&error);
    execv(path, argv);
    fl_error_set(&error, FL_ERROR_SYSTEM, path, "cannot be started: %s", strerror(errno));
    return cli_report(&error);
}
